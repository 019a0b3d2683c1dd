// tubule scan FILE : what becomes of a case over lists, ranges and grids of its keys.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "common/case/read.hpp"
#include "common/solve/interrupt.hpp"
#include "common/solve/message.hpp"
#include "common/solve/pause.hpp"
#include "common/solve/stop.hpp"
#include "tools/command/commands.hpp"
#include "tools/command/options.hpp"
#include "tools/command/output.hpp"
#include "tools/scan/dispatcher.hpp"
#include "tools/scan/extension.hpp"

namespace tubule {

namespace {

struct ScanOptions {
    ScanChoices choices;
    std::string output;
    std::vector<std::string> merge;  // results
    std::optional<int> jobs;
    bool resume = false, extend = false, overwrite = false, quiet = false;
};

// That of a case gets another name than its run.
std::filesystem::path scan_path(const ScanOptions& options, const Scan& scan) {
    if (!options.output.empty()) return options.output;
    if (is_scan(options.choices.file)) return options.choices.file;
    const std::filesystem::path stem = std::filesystem::path(scan.path).stem();
    return stem.string() + (scan.text.empty() ? "_scan.hdf" : ".hdf");
}

// A result that cannot be written or resumed is found before anything is computed: bad input.
ScanWriter open_result(const Scan& scan, const std::filesystem::path& file, bool resuming) {
    return as_bad_input([&] {
        if (resuming && std::filesystem::exists(file)) return ScanWriter::resume(file, scan);
        return ScanWriter::create(file, scan, about_start());
    });
}

// A scan by its result has its case and all choices in it: only values can be added.
void refuse_other_choices(const ScanOptions& options) {
    const ScanChoices& c = options.choices;
    const auto absent = [&](bool given, const char* option) {
        if (given)
            throw CaseError(
                fmt::format("{}: is the result of a scan: {} must be absent, as it has its own", c.file, option));
    };
    absent(!c.sets.empty(), "--set");
    absent(!c.points.empty(), "--points");
    absent(!c.boundary.empty(), "--boundary");
    absent(c.seeds.has_value(), "--seeds");
    absent(c.refine.has_value(), "--refine");
    absent(c.to_the_end, "--to-the-end");
    if (options.resume && (options.extend || !options.merge.empty() || !options.output.empty()))
        throw CaseError(
            fmt::format("{}: --resume goes on with it as it is: --extend, --merge and -o must be absent", c.file));
    if (!options.resume && !options.extend && options.merge.empty())
        throw CaseError(
            fmt::format("{}: is the result of a scan: --resume goes on with it, --extend --over key=values "
                        "and --merge RESULT add to it; to scan anew, give the case",
                        c.file));
    if (options.extend == c.over.empty() && !options.resume)
        throw CaseError(fmt::format("{}: {}", c.file,
                                    options.extend ? "--extend needs --over key=values" : "--over needs --extend"));
    if (options.resume && !c.over.empty()) throw CaseError(c.file + ": --over needs --extend");
}

ScanWriter grown_result(const ScanOptions& options) {
    refuse_other_choices(options);
    return as_bad_input([&] {
        ScanResult result = read_scan_result(options.choices.file);
        if (options.resume) return ScanWriter::resume(options.choices.file, result.scan);
        if (options.extend) result = extended(result, options.choices.over);
        for (const std::string& other : options.merge) result = merged(result, read_scan_result(other));
        return ScanWriter::create(scan_path(options, result.scan), result.scan, about_start(), result.points);
    });
}

ScanWriter new_result(const ScanOptions& options) {
    if (options.extend || !options.merge.empty())
        throw CaseError(fmt::format("{}: --extend and --merge need the result of a scan", options.choices.file));
    const Scan scan = read_scan(options.choices);
    const auto file = scan_path(options, scan);
    check_output(file);
    if (!options.resume && !options.overwrite) refuse_to_replace_another_scan(scan, file);
    return open_result(scan, file, options.resume);
}

// What the lattice of a scan along boundaries may miss; empty if it has every point of the grid.
std::string between_seeds(const Scan& scan) {
    if (!scan.boundary) return "";
    std::size_t longest = 0;
    for (const Axis& axis : scan.axes) longest = std::max(longest, axis.values.size() - 1);
    const auto seeds = static_cast<std::size_t>(scan.boundary->seeds);
    if (seeds >= longest) return "";
    return fmt::format("regions smaller than {} values of an axis may be missed: --seeds {} sees all\n",
                       (longest + seeds - 1) / seeds, longest);
}

// Advice for scans of graphs; else empty.
std::string faster_integrator(const Scan& scan) {
    const Problem c = scan.case_of(0);
    if (c.unknowns != Unknowns::graph || c.time.integrator != Integrator::ida) return "";
    return fmt::format("{}: note: time.integrator = \"rosenbrock\" is about 1.7 times faster for these tubes\n",
                       scan.path);
}

void report(const ScanResult& result, const std::filesystem::path& file, bool interrupted, const ScanEffort& effort,
            double seconds) {
    std::array<std::size_t, n_outcomes> counts{};
    for (const PointResult& p : result.points) ++counts[static_cast<std::size_t>(p.outcome)];
    std::vector<std::string> words;
    for (int i = 1; i < n_outcomes; ++i)
        if (const std::size_t n = counts[static_cast<std::size_t>(i)]; n > 0)
            words.push_back(fmt::format("{} {}", n, name(static_cast<Outcome>(i))));
    say(stdout, "{}: {}{} of {} points: {}\n", result.scan.path, interrupted ? "interrupted; " : "",
        result.points.size() - counts[0], result.points.size(), fmt::join(words, ", "));
    say(stdout, "    {} run now, {:.3g} s of CPU time, {:.3g} s; {}\n", effort.points, effort.cpu_seconds, seconds,
        file.string());
    if (interrupted) say(stdout, "    go on with --resume\n");
    if (const std::string words = between_seeds(result.scan); !words.empty()) say(stdout, "    {}", words);
}

int scan_by(const ScanOptions& options, Ranks* ranks) {
    const auto started = std::chrono::steady_clock::now();
    if (!options.output.empty()) check_output(options.output);
    if (ranks && options.jobs)
        throw CaseError("--jobs must be absent under mpirun: each rank runs one point at a time");
    const int jobs = scan_threads(options.jobs);
    ScanWriter writer = [&] {
        const PauseWatch watch(std::nullopt, interrupted);
        return is_scan(options.choices.file) ? grown_result(options) : new_result(options);
    }();
    const Scan scan = writer.result().scan;
    const auto file = scan_path(options, scan);
    if (writer.complete()) {
        if (ranks) ranks->dismiss();
        if (!options.quiet) say(stdout, "{}: {} is complete, nothing to resume\n", scan.path, file.string());
        return 0;
    }
    if (!options.quiet) say(stderr, "{}", faster_integrator(scan));
    bool was_interrupted = false;
    int workers = 0;
    ScanEffort effort;
    {
        Dispatcher dispatcher(writer, options.quiet);
        workers = ranks ? run_scan(*ranks, dispatcher, scan) : run_scan(dispatcher, scan, jobs);
        was_interrupted = dispatcher.was_interrupted();
        effort = dispatcher.effort();
    }
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
    const Stop stop = was_interrupted ? Stop::interrupted : Stop::finished;
    if (!was_interrupted || writer.began())  // else an earlier result stays as it was
        writer.finish({{"stop", std::string(name(stop))},
                       {"wall_seconds", seconds},
                       {"cpu_seconds", effort.cpu_seconds},
                       {"points_run", static_cast<std::int64_t>(effort.points)},
                       {"workers", std::int64_t{workers}}});
    if (!options.quiet) report(writer.result(), file, was_interrupted, effort, seconds);
    if (was_interrupted && ranks) abort_interrupted(*ranks);
    return exit_code(stop);
}

int scan(const ScanOptions& options) {
    catch_interrupts();
    return run_ranked([&](Ranks* ranks) { return scan_by(options, ranks); }, serve_scan);
}

}  // namespace

void add_scan(CLI::App& app, int& exit_status) {
    CLI::App* command =
        app.add_subcommand("scan", "Find what becomes of a case over lists, ranges and grids of its keys");
    const auto o = std::make_shared<ScanOptions>();
    finds_installed_cases(
        *command
             ->add_option("FILE", o->choices.file,
                          "a scan file, a case file with --over or --points, or the result of a scan with --resume, "
                          "--extend or --merge")
             ->required());
    command
        ->add_option("--over", o->choices.over,
                     "a key and its values: energy.k42=0,0.1,0.2 or lo:hi:n or lo:hi:n:log; several make a grid")
        ->allow_extra_args(false);
    command->add_option("--points", o->choices.points, "a CSV table: a line of keys, then one line a point");
    command->add_option("--set", o->choices.sets, "override a key for all points")->allow_extra_args(false);
    command->add_option("--boundary", o->choices.boundary,
                        "only the line between outcomes is wanted: 'outcome', or the name of the one it surrounds");
    command->add_option("--seeds", o->choices.seeds, "intervals of the lattice on which lines are looked for (8)");
    command->add_option("--refine", o->choices.refine,
                        "halvings of each edge of the grid that a line crosses (0): where the line is, more precisely");
    command->add_flag("--to-the-end", o->choices.to_the_end,
                      "run each point to time.end even where its outcome is known before");
    command->add_option("-o,--output", o->output, "result file (default: name of the scan, .hdf, in this directory)");
    command->add_flag("--resume", o->resume, "continue a scan that was interrupted or killed");
    command->add_flag("--overwrite", o->overwrite, "replace the result of another scan");
    command->add_flag("--extend", o->extend,
                      "add the values of --over to the result FILE of a scan; points that are known are not run again");
    command->add_option("--merge", o->merge, "add the points of another scan of the same case to the result FILE")
        ->allow_extra_args(false);
    command->add_option("--jobs", o->jobs, "threads, at most one a point (default: one a processor)");
    command->add_flag("--quiet", o->quiet, "no output except errors");
    end_help(*command,
             {"tubule scan cases/decay.toml --over energy.k42=0:0.2:3 -o k42.hdf",
              "tubule scan cases/decay.toml --over energy.k42=0:0.2:3 -o k42.hdf --resume",
              "tubule scan k42.hdf --extend --over energy.k42=0.05,0.15 --over shape.radius=1,1.2"},
             {{0}, {2}, {4, "a point could not be saved; --resume continues"}, {130}}, {"scans"});
    command->callback([o, &exit_status] { exit_status = scan(*o); });
}

int run_ranked(const std::function<int(Ranks*)>& root, const std::function<void(Ranks&)>& serve) {
    std::optional<Ranks> ranks = Ranks::join();
    if (!ranks) return root(nullptr);
    if (ranks->rank() > 0) {
        serve(*ranks);
        return 0;
    }
    try {
        return root(&*ranks);
    } catch (const CaseError&) {
        ranks->dismiss();  // thrown before any work was handed out
        throw;
    } catch (const Paused&) {  // likewise
        ranks->dismiss();
        throw;
    } catch (const std::exception& error) {
        say(stderr, "tubule: {}\n", explanation(error));
        std::fflush(nullptr);
        ranks->abort(exit_code(Stop::solver_failed));
    }
}

void abort_interrupted(Ranks& ranks) {
    std::fflush(nullptr);
    ranks.abort(exit_code(Stop::interrupted));
}

}  // namespace tubule
