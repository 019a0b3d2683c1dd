// Build information: for `tubule --version` and the /about of results.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace tubule {

// (name, value): version, git_hash, build, compiler, the libraries by name as loaded now, blas, machine.
std::vector<std::pair<std::string, std::string>> build_info();

}  // namespace tubule
