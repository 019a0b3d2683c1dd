// Build information: for `tubule --version` and the /about of results.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace tubule {

// (name, value): version, git_hash, build, compiler, the libraries by name as loaded now, blas, machine.
std::vector<std::pair<std::string, std::string>> build_info();

// What is not built, each part with the Debian packages that it needs: "shape.remesh: install libcgal-dev".
std::vector<std::string> lacking();

}  // namespace tubule
