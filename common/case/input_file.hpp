// Files that somebody names: bounded before they are read, so that no pipe, device or huge file stalls the program or
// takes all memory.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace tubule {

// The contents of a regular file of at most `most` bytes. Throws CaseError, "PATH: why".
std::string read_input(const std::filesystem::path& path, std::size_t most);

constexpr std::size_t megabyte = 1 << 20;

}  // namespace tubule
