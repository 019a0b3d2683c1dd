// The subcommands of `tubule`, one file each. add_X registers subcommand X; its callback sets the exit status.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/case/problem.hpp"
#include "common/result/result.hpp"
#include "common/run/run_observer.hpp"
#include "tools/run/model_choice.hpp"
#include "tools/scan/ranks.hpp"

namespace CLI {
class App;
}

namespace tubule {

// In the order in which --help lists them.
#define TUBULE_COMMANDS(command)                                                                                     \
    command(run) command(equilibrium) command(stability) command(scan) command(confirm) command(check) command(show) \
        command(units) command(plot) command(view) command(export) command(compare) command(chart)

#define TUBULE_COMMAND(name) void add_##name(CLI::App& app, int& exit_status);
TUBULE_COMMANDS(TUBULE_COMMAND)
#undef TUBULE_COMMAND

// What a result records when its run begins: the build, the machine, the time; and when it has ended.
About about_start();
void add_choice(About& about, const ChosenCase& chosen);  // of its model, if that was chosen
About about_end(const Problem& c, const RunSummary& summary, double wall_seconds);

// What `run` does, for the subcommands that do so too: the exit status. Throws CaseError for bad input.
struct RunOptions {
    std::vector<std::string> cases, sets;
    std::string output;
    std::optional<double> until = {};  // as time.end
    bool resume = false, overwrite = false, quiet = false, expect = false, check_derivatives = false;
    bool refuse_ill_posed = false;  // instead of recording that stop
    bool silent = false;            // quiet, and no words on stdout even if the run ends early
    // Called with each result that was written, which is none where a run fails at its start and an earlier result
    // stays.
    std::function<void(const std::filesystem::path&)> written = {};
};
int run_cases(const RunOptions& options);
std::filesystem::path result_path(const RunOptions& options, const std::filesystem::path& case_path);

// Refuses, before anything is computed, a name that no result can have, or a folder that is not there. Throws
// CaseError.
void check_output(const std::filesystem::path& file);
// And a file that must not be replaced: the result that the case starts from, or, unless `overwrite`, one of another
// case.
void check_replaced(const Problem& c, const std::filesystem::path& file, bool overwrite);

// ---- across the processes of an mpirun

// Runs `root` on rank 0, with the ranks or, if this process runs by itself, without; `serve` on the others. The exit
// status. What `root` throws before it hands out work ends the others; CaseErrors go on to the caller.
int run_ranked(const std::function<int(Ranks*)>& root, const std::function<void(Ranks&)>& serve);

// For `root`, after an interrupt: ends the other ranks, whatever they are doing.
[[noreturn]] void abort_interrupted(Ranks& ranks);

// ---- comparisons

// As the command line has them.
struct CompareOptions {
    std::vector<std::string> results, tolerances, frames, pictures;  // of `results`, the names
    bool align = false, no_shapes = false, csv = false, json = false;
};

// Compares results in memory; the answer is JSON, docs/schemas/compare.json. Throws std::invalid_argument for what
// cannot be compared.
std::string comparison_json(const CompareOptions& options, const Result& a, const Result& b);

}  // namespace tubule
