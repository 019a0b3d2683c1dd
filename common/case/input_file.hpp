// Files that somebody names: bounded before they are read, so that no pipe, device or huge file stalls the program or
// takes all memory.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace tubule {

// The contents of a regular file of at most `most` bytes. Throws CaseError, "PATH: why".
std::string read_input(const std::filesystem::path& path, std::size_t most);

// Why a file that is not there may be missing, or what was meant, to follow "PATH: No such file"; else empty.
std::string why_missing(const std::filesystem::path& path);

constexpr std::size_t megabyte = 1 << 20;

}  // namespace tubule
