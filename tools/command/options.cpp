#include "tools/command/options.hpp"

#include <CLI/CLI.hpp>
#include <map>
#include <system_error>

#include "build_config.hpp"
#include "tools/command/output.hpp"

namespace tubule {
namespace {

const std::map<int, std::string> meanings{
    {0, "finished as requested"},
    {1, "something differs from what was expected"},
    {2, "invalid input, and nothing was written; or the output could not be written"},
    {3, "the physics ended the run (pinch-off, overhang, ill-posed ...); the result up to then is saved"},
    {4, "the numerics failed; the last good state is saved"},
    {5, "the time limit of the case was reached; --resume continues"},
    {130, "interrupted; --resume continues"}};

}  // namespace

void end_help(CLI::App& command, const std::vector<std::string>& examples, const std::vector<ExitStatus>& statuses,
              const std::vector<std::string>& pages) {
    std::string text;
    if (!examples.empty()) text += examples.size() == 1 ? "Example:\n" : "Examples:\n";
    for (const std::string& example : examples) add(text, "  {}\n", example);
    text += "Exit status:\n";
    for (const auto& [code, meaning] : statuses)
        add(text, "  {:<4} {}\n", code, meaning.empty() ? meanings.at(code) : meaning);
    text += "More:";
    for (const std::string& page : pages) add(text, " docs/{}.md", page);
    command.footer(text);
}

std::filesystem::path installed(const std::filesystem::path& path, const std::filesystem::path& source) {
    std::error_code ignored;
    const auto program = std::filesystem::read_symlink("/proc/self/exe", ignored);
    const auto found = program.parent_path().parent_path() / path;
    return std::filesystem::exists(found, ignored) ? found : std::filesystem::path(TUBULE_SOURCE_DIR) / source;
}

std::string with_installed_case(const std::string& file) {
    std::error_code ignored;
    if (!file.starts_with("cases/") || std::filesystem::exists(file, ignored)) return file;
    const auto found = installed("share/tubule/" + file, file);
    return std::filesystem::exists(found, ignored) ? found.string() : file;
}

void finds_installed_cases(CLI::Option& option) {
    option.transform(with_installed_case);
}

}  // namespace tubule
