#include "tools/command/installed.hpp"

#include <CLI/CLI.hpp>
#include <system_error>

#include "build_config.hpp"

namespace tubule {

std::filesystem::path installed(const std::filesystem::path& path, const std::filesystem::path& source) {
    std::error_code ignored;
    const auto program = std::filesystem::read_symlink("/proc/self/exe", ignored);
    const auto found = program.parent_path().parent_path() / path;
    return std::filesystem::exists(found, ignored) ? found : std::filesystem::path(TUBULE_SOURCE_DIR) / source;
}

void finds_installed_cases(CLI::Option& option) {
    option.transform([](const std::string& file) {
        std::error_code ignored;
        if (!file.starts_with("cases/") || std::filesystem::exists(file, ignored)) return file;
        const auto found = installed("share/tubule/" + file, file);
        return std::filesystem::exists(found, ignored) ? found.string() : file;
    });
}

}  // namespace tubule
