// Options of subcommands: the end of their help, and case files that are installed.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace tubule {

struct ExitStatus {
    int code;
    std::string meaning = {};  // by default that of the whole program
};

// Ends the help with examples, exit statuses, where to read more. `pages` are files of docs/, without the ending. Of
// the program itself: without examples.
void end_help(CLI::App& command, const std::vector<std::string>& examples, const std::vector<ExitStatus>& statuses,
              const std::vector<std::string>& pages);

// A path below the prefix of an installed program; where it is not there, the one below the folder of the sources,
// which may not exist either.
std::filesystem::path installed(const std::filesystem::path& path, const std::filesystem::path& source);

// Lets an option that names case files find those that are installed: cases/NAME.toml, unless there is such a file
// here.
void finds_installed_cases(CLI::Option& option);
std::string with_installed_case(const std::string& file);

}  // namespace tubule
