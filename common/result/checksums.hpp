// Checksums of a file: behind its HDF5 part, where HDF5 does not look, stand
//
//   seal    "TUBULEC1", 8 bytes each: size of the HDF5 part, size of the index; 4 bytes each: CRC-32 of either
//   index   what a reader needs to find the numbers without HDF5 (result_index.hpp)
//   seal    the same again
//
// HDF5 trusts every bit of a file, and one that is wrong can crash it: nothing of a file is shown to HDF5 before its
// checksums have been found right.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/result/bytes.hpp"

namespace tubule {

// Continues `crc` (0 to begin with) over `bytes`: the CRC-32 of zlib.
std::uint32_t crc32(std::uint32_t crc, std::span<const std::byte> bytes);

// Where the numbers of a dataset are in the file, and a CRC for each `chunk` bytes of them.
struct Extent {
    static constexpr std::size_t chunk = 4096;

    std::uint64_t offset = 0, size = 0;  // bytes
    std::vector<std::uint32_t> crcs;
};
Extent extent_of(std::uint64_t offset, std::span<const std::byte> data);

// The HDF5 part with index and seals added.
void seal(Bytes& hdf5, std::span<const std::byte> index);

struct Wholeness {
    enum class Kind { whole, unsealed, damaged };
    Kind kind;
    std::string damage;                      // in words
    std::optional<std::uint64_t> hdf5_size;  // if there is such a part, and it is not known to be damaged
    Bytes index;                             // empty unless it is as it was written
};

// Reads all of the file. `unsealed` is what an earlier version or another program has written.
Wholeness examine(const std::filesystem::path& file);
Wholeness examine(int descriptor);

// Whether it has checksums; warns on stderr, once a process, of a file without. Throws std::runtime_error with the damage
// in words.
bool require_whole(int descriptor, const std::filesystem::path& file);

}  // namespace tubule
