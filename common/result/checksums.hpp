// The trailer of a file: behind its HDF5 part, where HDF5 does not look, stands twice
//
//   "TUBULEC1", 8 bytes each: size of the HDF5 part, size of what stands between the two; 4 bytes each: CRC-32 of
//   either
//
// Nothing stands between them today; versions before 0.2 had an index there.
//
// HDF5 trusts every bit of a file, and one that is wrong can crash it: nothing of a file is shown to HDF5 before its
// checksum has been found right.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace tubule {

// Continues `crc` (0 to begin with) over `bytes`: the CRC-32 of zlib.
std::uint32_t crc32(std::uint32_t crc, std::span<const std::byte> bytes);

// Adds the trailer to the HDF5 part; the CRC of that.
std::uint32_t seal(std::vector<std::byte>& hdf5);

struct Wholeness {
    // foreign: no HDF5; unsealed: what another program has written.
    enum class Kind { whole, unsealed, damaged, foreign };
    Kind kind;
    std::string damage;     // in words
    std::uint32_t crc = 0;  // of the HDF5 part, if it is whole
};

// Reads all of the file.
Wholeness examine(const std::filesystem::path& file);
Wholeness examine(int descriptor);

// Whether it has checksums; warns on stderr, once a process, of an HDF5 file without. Throws std::runtime_error with
// the damage in words.
bool require_whole(int descriptor, const std::filesystem::path& file);

}  // namespace tubule
