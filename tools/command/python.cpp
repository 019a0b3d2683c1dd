#include "tools/command/python.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <stdexcept>
#include <system_error>

namespace tubule {

namespace {

constexpr const char* python = "/usr/bin/python3";  // PATH's python3 may lack Debian's modules

// <prefix>/share/tubule/plot of an installed program, else the folder this program was built beside.
std::filesystem::path script_path(const std::string& script) {
    std::error_code ignored;
    const auto program = std::filesystem::read_symlink("/proc/self/exe", ignored);
    const auto installed = program.parent_path().parent_path() / "share/tubule/plot" / script;
    return std::filesystem::exists(installed, ignored) ? installed : std::filesystem::path(TUBULE_PLOT_DIR) / script;
}

}  // namespace

std::vector<std::string> plot_command(const std::string& subcommand, const std::string& script) {
    if (access(python, X_OK) != 0)
        throw std::runtime_error(fmt::format(
            "tubule {} needs {}; install the packages python3 python3-matplotlib python3-h5py", subcommand, python));
    const std::string path = script_path(script);
    if (!std::filesystem::exists(path))
        throw std::runtime_error(
            fmt::format("tubule {}: its script {} is missing; install or build tubule again", subcommand, path));
    return {python, "-B", path};
}

}  // namespace tubule
