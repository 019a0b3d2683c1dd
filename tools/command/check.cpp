// tubule check CASE... : reads and validates cases, and prints them with overrides applied and defaults written out.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "common/case/read.hpp"
#include "tools/command/commands.hpp"

namespace tubule {

namespace {

struct CheckOptions {
    std::vector<std::string> cases, sets;
};

// All cases are looked at, so that one call tells all that is wrong. The output is itself a case (of one case).
int check(const CheckOptions& options) {
    int status = 0;
    for (const std::string& path : options.cases) {
        try {
            const Case c = read_case(path, options.sets);
            fmt::print("# OK {}\n{}\n", path, effective_toml(c));
        } catch (const CaseError& error) {
            std::fflush(stdout);
            fmt::print(stderr, "{}\n", error.what());
            status = 2;
        }
    }
    return status;
}

}  // namespace

void add_check(CLI::App& app, int& exit_status) {
    CLI::App* command = app.add_subcommand("check", "Validate cases and print the resolved cases");
    const auto options = std::make_shared<CheckOptions>();
    command->add_option("CASE", options->cases, "case files")->required();
    command->add_option("--set", options->sets, "override a key, such as --set energy.k42=0.06")
        ->allow_extra_args(false);
    command->callback([options, &exit_status] { exit_status = check(*options); });
}

}  // namespace tubule
