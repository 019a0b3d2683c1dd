// tubule chart CHART or CASE: error against CPU time of many runs, and maps of stable steps, by the script chart.py.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/solve/message.hpp"
#include "tools/command/commands.hpp"
#include "tools/command/help.hpp"
#include "tools/command/installed.hpp"
#include "tools/command/python.hpp"
#include "tools/command/text.hpp"

namespace tubule {

namespace {

struct ChartOptions {
    std::string file, reference, quantity, map, times;
    std::vector<std::string> vary, also, sets, outputs;
    std::optional<int> jobs;
    std::optional<double> limit;
    bool study = false, again = false, draw = false, quiet = false;
};

std::vector<std::string> script_arguments(const ChartOptions& o) {
    std::vector<std::string> arguments = plot_command("chart", "chart");
    const auto pass = [&](const char* option, const std::string& value) {
        if (!value.empty()) arguments.push_back(fmt::format("--{}={}", option, value));
    };
    const auto pass_all = [&](const char* option, const std::vector<std::string>& values) {
        for (const std::string& value : values) pass(option, value);
    };
    pass("tubule", std::filesystem::read_symlink("/proc/self/exe").string());
    pass_all("vary", o.vary);
    pass_all("also", o.also);
    pass_all("set", o.sets);
    pass_all("output", o.outputs);
    pass("map", o.map);
    pass("reference", o.reference);
    pass("quantity", o.quantity);
    pass("times", o.times);
    if (o.jobs) pass("jobs", fmt::format("{}", *o.jobs));
    if (o.limit) pass("limit", fmt::format("{}", *o.limit));
    if (o.study) arguments.push_back("--study");
    if (o.again) arguments.push_back("--again");
    if (o.draw) arguments.push_back("--draw");
    if (o.quiet) arguments.push_back("--quiet");
    arguments.push_back("--");
    arguments.push_back(o.file);
    return arguments;
}

int chart(const ChartOptions& options) {
    try {
        return become("chart", script_arguments(options));
    } catch (const std::runtime_error& error) {
        say(stderr, "{}\n", explanation(error));
        return 4;
    }
}

}  // namespace

void add_chart(CLI::App& app, int& exit_status) {
    CLI::App* command = app.add_subcommand("chart", "Run a case with many settings, and draw error against CPU time");
    const auto o = std::make_shared<ChartOptions>();
    finds_installed_cases(
        *command->add_option("FILE", o->file, "a chart (docs/charts.md), or a case together with --vary")->required());
    command
        ->add_option("--vary", o->vary,
                     "key=value,value,...: a key with its values. The last --vary makes the points of a line, those "
                     "before it make lines")
        ->allow_extra_args(false);
    command->add_option("--also", o->also, "key=value,key=value,...: further lines, with these keys set")
        ->allow_extra_args(false);
    command
        ->add_option("--map", o->map,
                     "key=from:to:n: largest stable value of the key (a step), n values a decade, over the last --vary")
        ->allow_extra_args(false);
    command->add_option("--set", o->sets, "override a key in all runs")->allow_extra_args(false);
    command->add_option("--reference", o->reference,
                        "a result to measure errors against (default: the run with the "
                        "smallest stated error)");
    command->add_option("--quantity", o->quantity, "series whose error is drawn (default: energy)");
    command->add_option("--times", o->times, "times of the errors, such as 0.05,0.1 (default: outputs and end)");
    command
        ->add_option("-o,--output", o->outputs,
                     "picture, .svg, .png or .pdf; may be repeated (default: FILE.svg, in "
                     "this directory). The data are written beside the first, .csv")
        ->allow_extra_args(false);
    command->add_option("--jobs", o->jobs, "runs at a time (default 1, for times that can be compared)");
    command->add_option("--limit", o->limit, "seconds after which a run is given up (default 600)")
        ->check(refuse_infinite);
    command->add_flag("--study", o->study, "also what the chart marks as a study: long runs");
    command->add_flag("--again", o->again, "repeat runs that the data hold already");
    command->add_flag("--draw", o->draw, "run nothing: draw what the data hold");
    command->add_flag("--quiet", o->quiet, "no lines of progress");
    end_help(*command, {"tubule chart cases/decay.toml --vary accuracy.energy=1e-2,1e-4,1e-6 -o decay.svg"},
             {{0}, {2}, {4, "a run, the data or the picture failed"}, {130, "interrupted; the same command continues"}},
             {"charts"});
    command->callback([o, &exit_status] { exit_status = chart(*o); });
}

}  // namespace tubule
