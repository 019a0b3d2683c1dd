// tubule check CASE... : reads and validates cases, and prints them with overrides applied and defaults written out.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <vector>

#include "common/case/read.hpp"
#include "common/case/text.hpp"
#include "common/solve/message.hpp"
#include "tools/command/commands.hpp"
#include "tools/command/help.hpp"
#include "tools/command/streams.hpp"
#include "tools/command/text.hpp"
#include "tools/run/forecast.hpp"

namespace tubule {

namespace {

struct CheckOptions {
    std::vector<std::string> cases, sets;
    bool quick = false;
};

// On one line, in UTF-8: the output must be a case whatever its file is called.
std::string shown_path(const std::string& path) {
    std::string shown = valid_utf8(path);
    for (char& c : shown)
        if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
    return shown;
}

// For people: the answer itself is the case, the same at each call.
void tell_expected(const Case& c) {
    std::string told;
    try {
        told = words(forecast(c));
    } catch (const std::exception& error) {
        told = "unknown: " + explanation(error);
    }
    say(stderr, "{}: expected: {}\n", shown_path(c.path), told);
}

// All cases are looked at, so that one call tells all that is wrong. The output is itself a case (of one case).
int check(const CheckOptions& options) {
    int status = 0;
    for (const std::string& path : options.cases) {
        try {
            const Case c = read_case(path, options.sets);
            print_answer(fmt::format("# OK {}\n{}\n", shown_path(path), effective_toml(c)));
            if (!options.quick) tell_expected(c);
        } catch (const CaseError& error) {
            say(stderr, "{}\n", error.what());
            status = 2;
        }
    }
    return status;
}

}  // namespace

void add_check(CLI::App& app, int& exit_status) {
    CLI::App* command =
        app.add_subcommand("check", "Validate cases, print the resolved cases and what they are expected to take");
    const auto options = std::make_shared<CheckOptions>();
    command->add_option("CASE", options->cases, "case files")->required();
    command->add_option("--set", options->sets, "override a key, such as --set energy.k42=0.06")
        ->allow_extra_args(false);
    command->add_flag("--quick", options->quick, "run nothing to tell steps, time and memory");
    end_help(*command, {"tubule check cases/peanut.toml", "tubule check cases/peanut.toml --set accuracy.energy=1e-6"},
             {{0, "all cases are valid"}, {2}}, {"case_files"});
    command->callback([options, &exit_status] { exit_status = check(*options); });
}

}  // namespace tubule
