// tubule equilibrium CASE... : stationary shapes and branches of them, into result files and as tables.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "common/case/read.hpp"
#include "common/result/result.hpp"
#include "common/series/catalogue.hpp"
#include "tools/command/commands.hpp"
#include "tools/command/options.hpp"
#include "tools/command/output.hpp"
#include "tools/command/units.hpp"

namespace tubule {

namespace {

// One line a shape, in the units of the case if it has any. Growth rates: the largest of all m, and its m.
Text table_of(const Result& result, const std::optional<Scales>& scales) {
    Text out;
    const auto has = [&](const char* name) { return result.series.contains(name); };
    const auto unit = [&](const std::string& name) {
        const auto found = result.series.find(name);
        double largest = 0;
        if (found != result.series.end())
            for (const double number : found->second) largest = std::fmax(largest, std::abs(number));
        return lab_unit(scales, find_series(name)->unit, largest);
    };
    const auto value = [&](const std::string& name, std::size_t row) {
        return result.series.at(name)[row] * unit(name).scale;
    };
    const bool branch = has("parameter"), branches = has("branch"), modes = has("growth_0"), rates = has("rate_1"),
               beads = has("bead_distance");
    if (branch) add(out, "{:>14}  ", "parameter");
    add(out, "{:>16} {:>14} {:>14} {:>9} {:>10} {:>4}", "energy", "tension", "pressure", "height", "r_max", "neg");
    if (beads) add(out, " {:>12}", "force");
    if (modes || rates) add(out, "  {:>10} of m", "growth");
    add(out, "\n");
    if (scales) {
        add(out, "{}{:>16} {:>14} {:>14} {:>9} {:>10}", branch ? std::string(16, ' ') : "", unit("energy").name,
            unit("tension").name, unit("pressure").name, unit("height").name, unit("r_max").name);
        if (beads) add(out, "      {:>12}", unit("force").name);
        if (modes || rates) add(out, "{}{:>10}", beads ? "  " : "       ", unit("rate_1").name);
        add(out, "\n");
    }
    const std::size_t rows = result.series.at("time").size();
    for (std::size_t i = 0; i < rows; ++i) {
        if (branches && i > 0 && value("branch", i) != value("branch", i - 1))
            add(out, "branch {:.0f}, which bifurcates from the first:\n", value("branch", i));
        const int negative = static_cast<int>(value("negative_directions", i));
        const bool known = negative >= 0;  // not of a state that is no equilibrium
        if (branch) add(out, "{:>14.9g}  ", value("parameter", i));
        add(out, "{:>16.11g} {:>14.9g} {:>14.9g} {:>9.5f} {:>10.6f} {:>4}", value("energy", i), value("tension", i),
            value("pressure", i), value("height", i), value("r_max", i), known ? fmt::to_string(negative) : "?");
        if (beads) add(out, " {:>12.6f}", std::round(1e6 * value("force", i)) / 1e6 + 0.0);
        if (modes && known) {
            int fastest = 0;
            for (int m = 0; has(fmt::format("growth_{}", m).c_str()); ++m)
                if (value(fmt::format("growth_{}", m), i) > value(fmt::format("growth_{}", fastest), i)) fastest = m;
            add(out, "  {:>10.4g} {:>4}", value(fmt::format("growth_{}", fastest), i), fastest);
        }
        if (rates && known) {
            const int m = static_cast<int>(value("wave_number_1", i));
            add(out, "  {:>10.4g} {:>4}", value("rate_1", i), m >= 0 ? fmt::to_string(m) : "-");
        }
        const int special = branch ? static_cast<int>(value("special", i)) : 0;
        add(out, "{}\n", special == 1 ? "  fold" : special == 2 ? "  bifurcation" : "");
    }
    return out;
}

int find(const RunOptions& options) {
    std::vector<Case> cases;
    for (const std::string& path : options.cases) {
        cases.push_back(read_case(path, options.sets));
        if (!cases.back().equilibrium)
            throw CaseError(
                fmt::format("{}: is a time-dependent case: an equilibrium needs a table [equilibrium]", path));
    }
    std::vector<std::filesystem::path> files;
    RunOptions run = options;
    run.written = [&](const std::filesystem::path& file) { files.push_back(file); };
    const int status = run_cases(run);
    if (options.quiet) return status;
    for (const auto& file : files) {
        const Result result = read_result(file);
        if (result.series.contains("time") && !result.series.at("time").empty())
            print_answer(to_string(table_of(result, shown_scales(result.case_text, file.string()))));
    }
    return status;
}

}  // namespace

void add_equilibrium(CLI::App& app, int& exit_status) {
    CLI::App* command =
        app.add_subcommand("equilibrium", "Find stationary shapes, follow branches of them, print them");
    const auto o = std::make_shared<RunOptions>();
    finds_installed_cases(*command->add_option("CASE", o->cases, "case files with a table [equilibrium]")->required());
    command->add_option("--set", o->sets, "override a key, such as --set equilibrium.modes=5")->allow_extra_args(false);
    command->add_option("-o,--output", o->output, "result file (default: name of the case, .hdf, in this directory)");
    command->add_flag("--overwrite", o->overwrite, "replace the result of another case");
    command->add_flag("--quiet", o->quiet, "no table; words only if something went wrong");
    command->add_flag("--expect", o->expect, "check [expect] of the case: exit status 0 if all of it came out, else 1");
    end_help(*command, {"tubule equilibrium cases/equilibrium_capsule.toml -o capsule.hdf"},
             {{0},
              {1, "--expect: something did not come out as expected"},
              {2},
              {3},
              {4},
              {5, "the time limit of the case was reached"},
              {130, "interrupted"}},
             {"equilibria", "case_files"});
    command->callback([o, &exit_status] { exit_status = find(*o); });
}

}  // namespace tubule
