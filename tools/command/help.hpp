// The end of the help of a subcommand: examples, exit statuses, where to read more.
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace tubule {

struct ExitStatus {
    int code;
    std::string meaning = {};  // by default that of the whole program
};

// `pages` are files of docs/, without the ending. Of the program itself: without examples.
void end_help(CLI::App& command, const std::vector<std::string>& examples, const std::vector<ExitStatus>& statuses,
              const std::vector<std::string>& pages);

}  // namespace tubule
