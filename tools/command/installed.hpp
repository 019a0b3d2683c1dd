// What is installed beside the program, or lies in the tree it was built from.
#pragma once

#include <filesystem>
#include <string>

namespace CLI {
class Option;
}

namespace tubule {

// A path below the prefix of an installed program; where it is not there, the one below the folder of the sources, which
// may not exist either.
std::filesystem::path installed(const std::filesystem::path& path, const std::filesystem::path& source);

// Lets an option that names case files find those that are installed: cases/NAME.toml, unless there is such a file
// here.
void finds_installed_cases(CLI::Option& option);

}  // namespace tubule
