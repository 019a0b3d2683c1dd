// NAME.hdf.journal: everything passed to the writer since NAME.hdf was last written.
//
//   header   8 bytes "TUBULEJ1", 8 bytes id of the result
//   record   8 bytes length of the payload, 8 bytes sequence number, 4 bytes kind, 4 bytes CRC-32, payload
//
// in the byte order of the machine. The CRC runs over the id, the record's first 20 bytes and its payload, so that a
// record of another result is never accepted. Sequence numbers go up by one; NAME.hdf stores the last one it includes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <vector>

#include "common/result/contents.hpp"
#include "common/result/durable_io.hpp"

namespace tubule {

// The journal may grow by this many bytes beyond the size of the file before it is merged; the tests lower it.
inline std::size_t journal_slack = std::size_t{4} << 20;

// The kinds; a new number wherever the layout of the payload changes. Version 0 wrote points of scans as kind 6.
enum class Entry : std::uint32_t { row = 1, frame, checkpoint, discard, mesh, point_of_version_0, point /* of a scan */ };

std::filesystem::path journal_path(const std::filesystem::path& result);

class Journal {
public:
    // Opens or creates the journal beside a result, and locks it for as long as this lives: throws
    // std::runtime_error if another writer has it. Earlier records stay until restart().
    explicit Journal(const std::filesystem::path& result);
    Journal(const Journal&) = delete;
    Journal& operator=(const Journal&) = delete;
    ~Journal();  // removes the file if nothing was written to it

    void restart(std::uint64_t id);  // drops all records: call it when the result file includes them
    void remove();

    // Each appends one record, with a single write(2). If that fails the journal is truncated to its previous size.
    void row(std::uint64_t sequence, std::span<const double> values);
    void record(Entry kind, std::uint64_t sequence, const Record& record);
    void discard(std::uint64_t sequence);
    void mesh(std::uint64_t sequence, const SurfaceCells& mesh);
    void bytes(Entry kind, std::uint64_t sequence, std::span<const std::byte> payload);

    std::size_t size() const { return size_; }  // bytes

private:
    void begin(Entry kind);
    void commit(std::uint64_t sequence);

    durable::File file_;
    std::size_t size_ = 0;
    std::uint32_t seed_ = 0;         // CRC of the id
    bool sound_ = false;             // what is appended now can be read back
    std::vector<std::byte> buffer_;  // one record, kept to save allocations
};

// The bytes of the journal beside a result; empty if there is none.
std::vector<std::byte> read_journal(const std::filesystem::path& result);

// Applies to `contents` the records that follow them, up to the first torn one; none if the journal belongs to another
// result. During a run, read the journal first and the contents afterwards: in this order there is never a gap. Returns
// how many bytes remain that are no record, torn or damaged. Throws std::runtime_error on a gap.
std::size_t replay(std::span<const std::byte> journal, Contents& contents);

// The same for other contents: `apply` takes the records after `sequence`, which is updated.
std::size_t replay(std::span<const std::byte> journal, std::uint64_t id, std::uint64_t& sequence,
                   const std::function<void(Entry, std::span<const std::byte>)>& apply);

// Warns on stderr that so many bytes at the end of the journal are lost; silent if there are none.
void warn_of_rest(std::size_t bytes, const std::filesystem::path& result);

}  // namespace tubule
