// The subcommands of `tubule`, one file each. add_X registers subcommand X; its callback sets the exit status.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/case/case.hpp"
#include "common/result/result.hpp"

namespace CLI {
class App;
}

namespace tubule {

void add_run(CLI::App& app, int& exit_status);
void add_equilibrium(CLI::App& app, int& exit_status);
void add_stability(CLI::App& app, int& exit_status);
void add_check(CLI::App& app, int& exit_status);
void add_show(CLI::App& app, int& exit_status);
void add_plot(CLI::App& app, int& exit_status);
void add_compare(CLI::App& app, int& exit_status);
void add_chart(CLI::App& app, int& exit_status);
void add_scan(CLI::App& app, int& exit_status);
void add_confirm(CLI::App& app, int& exit_status);

// What a result says of its making when it begins: the build, the machine, when.
About about_start();

// What `run` does, for the subcommands that do so too: the exit status. Throws CaseError for bad input.
struct RunOptions {
    std::vector<std::string> cases, sets;
    std::string output;
    bool resume = false, quiet = false, expect = false, check_derivatives = false;
    bool silent = false;  // quiet, and no words on stdout even if the run ends early
};
int run_cases(const RunOptions& options);
std::filesystem::path result_path(const RunOptions& options, const Case& c);

}  // namespace tubule
