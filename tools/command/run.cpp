// tubule run CASE... : runs cases, each into a result file.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "axisym/curve/curve_setup.hpp"
#include "axisym/graph/graph_derivatives.hpp"
#include "common/case/read.hpp"
#include "common/case/text.hpp"
#include "common/result/record.hpp"
#include "common/result/result.hpp"
#include "common/result/start_frame.hpp"
#include "common/run/run_clock.hpp"
#include "common/solve/interrupt.hpp"
#include "common/solve/message.hpp"
#include "common/solve/progress.hpp"
#include "tools/command/build_info.hpp"
#include "tools/command/commands.hpp"
#include "tools/command/options.hpp"
#include "tools/command/output.hpp"
#include "tools/command/units.hpp"
#include "tools/run/case_checks.hpp"
#include "tools/run/continuation.hpp"
#include "tools/run/engine.hpp"
#include "tools/run/forecast.hpp"
#include "tools/run/model_choice.hpp"
#include "tools/run/run_to_end.hpp"

namespace tubule {

std::filesystem::path result_path(const RunOptions& options, const std::filesystem::path& case_path) {
    if (!options.output.empty()) return options.output;
    return std::filesystem::path(case_path).filename().replace_extension(".hdf");
}

void check_output(const std::filesystem::path& file) {
    for (const char* other :
         {".toml", ".csv", ".json", ".txt", ".png", ".svg", ".pdf", ".gif", ".html", ".vtu", ".vtk",
          ".vtp",  ".pvd", ".xdmf", ".mat", ".npz", ".npy", ".dat", ".obj", ".stl",  ".ply", ".off"})
        if (file.extension() == other)
            throw CaseError(
                fmt::format("{}: a result is an HDF5 file: give it a name such as {}; tubule show makes tables "
                            "of it, tubule plot pictures; ParaView opens surfaces",
                            file.string(), std::filesystem::path(file).replace_extension(".hdf").filename().string()));
    std::error_code error;
    if (std::filesystem::is_directory(file, error))
        throw CaseError(fmt::format("{}: is a folder: name a file in it, such as {}", file.string(),
                                    (file / "result.hdf").string()));
    const std::filesystem::path folder = file.parent_path();
    if (!folder.empty() && std::filesystem::status(folder, error).type() == std::filesystem::file_type::not_found)
        throw CaseError(
            fmt::format("{}: cannot be written: there is no folder {}; make it, or choose another file with -o",
                        file.string(), folder.string()));
    if (std::filesystem::status(file, error).type() == std::filesystem::file_type::none)
        throw CaseError(fmt::format("{}: cannot be written: {}", file.string(), error.message()));
}

About about_start() {
    About about;
    for (const auto& [name, value] : build_info()) about.emplace_back(name, value);
    const auto now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
    std::tm utc{};
    gmtime_r(&now, &utc);
    char text[32];
    std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc);
    about.emplace_back("started", std::string(text));
    return about;
}

void add_choice(About& about, const ChosenCase& chosen) {
    if (chosen.reason.empty()) return;
    about.insert(about.end(), {{"model", name(chosen.c.model)}, {"model_reason", chosen.reason}});
}

About about_end(const Problem& c, const RunSummary& s, double wall_seconds) {
    About about{{"stop", std::string(name(s.stop.reason))},
                {"stop_time", s.stop.time},
                {"stop_message", s.stop.message},
                {"advice", s.stop.advice},
                {"asked_accuracy", c.accuracy.energy}};
    if (s.reference_energy > 0)  // else no energy was found
        about.insert(about.end(), {{"estimated_error", s.estimated_error}, {"E_ref", s.reference_energy}});
    about.emplace_back("wall_seconds", wall_seconds);
    about.insert(about.end(), s.details.begin(), s.details.end());
    about.emplace_back("warnings", fmt::format("{}", fmt::join(s.warnings, "\n")));
    return about;
}

namespace {

// Hands a run's rows and frames to the result file.
class Recorder : public RunObserver {
public:
    // `from`: the state that the run resumes from, or none.
    Recorder(const Problem& c, ResultWriter& writer, bool quiet, const Record* from)
        : case_(c), writer_(writer), quiet_(quiet), progress_(from ? from->time : 0, c.time.end, {.quiet = quiet}) {}
    void row(std::span<const double> values) override { writer_.row(values); }
    std::size_t mesh(const SurfaceCells& cells) override { return writer_.mesh(cells); }
    void frame(const std::function<Record()>& make) override { writer_.frame(make()); }
    void checkpoint(const Record& state) override { writer_.checkpoint(state); }
    void discard() override { writer_.discard(); }
    void next_run(int number, int of) override { progress_.next_run(number, of); }
    void progress(double time, double energy, double step) override { progress_(time, energy, step); }
    bool interrupted() override { return tubule::interrupted(); }
    void note(const std::string& words) override {
        const char* wiped = ProgressStyle::is_terminal(stderr) ? "\r\x1b[K" : "";  // the bar, drawn again soon
        if (!quiet_) say(stderr, "{}{}: {}\n", wiped, case_.path, words);
    }

private:
    const Problem& case_;
    ResultWriter& writer_;
    bool quiet_;
    Progress progress_;
};

bool has_rows(const std::filesystem::path& file) {
    return std::filesystem::exists(file) && !read_result(file).series.at("time").empty();
}

// Expectations that a complete result does not meet, one line each.
std::vector<std::string> unmet(const Problem& c, const Result& result) {
    std::vector<std::string> lines;
    const Stop stop = stop_of(result).value(), expected = c.expect.stop.value_or(Stop::finished);
    if (stop != expected) lines.push_back(fmt::format("stop is {}, expected {}", name(stop), name(expected)));
    const std::vector<double>& times = result.series.at("time");
    for (const Expectation& e : c.expect.values) {
        const std::string where = e.time ? fmt::format("{} at t = {}", e.series, *e.time) : e.series + " at the end";
        const auto series = result.series.find(e.series);
        const auto row = e.time || times.empty() ? std::find(times.begin(), times.end(), e.time) : times.end() - 1;
        if (series == result.series.end() || row == times.end()) {
            lines.push_back(fmt::format("{} was not computed", where));
            continue;
        }
        const double found = series->second[row - times.begin()];
        const double allowed = std::max(e.abs.value_or(0), e.rel.value_or(0) * std::abs(e.value));
        if (!(std::abs(found - e.value) <= allowed))
            lines.push_back(
                fmt::format("{} is {:.12g}, expected {:.12g} within {:.3g}", where, found, e.value, allowed));
    }
    return lines;
}

// Exit status of a result that is to be as expected, which is said where it is not.
int compare(const Problem& c, const std::filesystem::path& file) {
    const std::vector<std::string> lines = unmet(c, read_result(file));
    for (const std::string& line : lines) say(stderr, "{}: not as expected: {}\n", c.path, line);
    return lines.empty() ? 0 : 1;
}

void report(const ChosenCase& chosen, const RunSummary& s, const std::string& file, double seconds) {
    const Problem& c = chosen.c;
    const auto scales = known_scales(c);
    const LabUnit J = lab_unit(scales, "energy");
    const std::string when = c.moves() ? " at t = " + with_unit(s.stop.time, lab_unit(scales, "time"), 6) : "";
    say(stdout, "{}: {}{}: {}\n", c.path, name(s.stop.reason), when, s.stop.message);
    const int status = exit_code(s.stop.reason);
    const std::string about =
        status == 3 || status == 4 ? fmt::format(" (docs/failures.md#{})", name(s.stop.reason)) : "";
    if (!s.stop.advice.empty() || !about.empty())
        say(stdout, "    {}{}\n", s.stop.advice.empty() ? "what to do" : s.stop.advice, about);
    for (const std::string& warning : s.warnings) say(stdout, "    warning: {}\n", warning);
    if (s.reference_energy > 0 && s.error_is_known())
        say(stdout, "    energy {}, estimated error {:.2g} of E_ref = {} (asked: {:.2g})\n", with_unit(s.energy, J, 9),
            s.estimated_error, with_unit(s.reference_energy, J, 4), c.accuracy.energy);
    else if (s.reference_energy > 0)
        say(stdout, "    energy {}, error unknown; E_ref = {}\n", with_unit(s.energy, J, 9),
            with_unit(s.reference_energy, J, 4));
    if (!chosen.reason.empty()) say(stdout, "    {}\n", words_of_choice(chosen));
    for (const auto& [key, value] : s.details)
        if (key == "choice" || key == "reason" || key == "triangles")
            say(stdout, "    {}: {}\n", key, std::get<std::string>(value));
    say(stdout, "    {}{}{:.3g} s; {}\n", s.effort, s.effort.empty() ? "" : ", ", seconds, file);
}

bool derivatives_can_be_checked(const Problem& c) {
    return c.runs_in_tier_axisym() && is_tube(c.shape);
}

// Prints the Taylor slopes of every term at the start; whether all are as they should be.
bool derivatives_pass(const Problem& c) {
    bool pass = true;
    std::vector<axisym::TermCheck> checks = axisym::check_terms(c);
    if (c.energy.alpha) checks.push_back({"alpha", axisym::check_area_differences(c)});
    for (const auto& [key, check] : checks) {
        say(stdout, "{}: {}\n{}\n", c.path, key, check.text());
        pass = pass && check.pass();
    }
    return pass;
}

struct Opened {
    ResultWriter writer;
    std::optional<Restart> restart;
    std::optional<Result> unfinished;  // the file that it belongs to, as it was found
};

Opened create(const ChosenCase& chosen, const Engine& engine, const std::filesystem::path& file) {
    const Problem& c = chosen.c;
    About about = about_start();
    add_choice(about, chosen);
    about.emplace_back("case_path", valid_utf8(std::filesystem::absolute(c.path).string()));
    return {ResultWriter::create(file, kept_case(c), about, engine.series_names()), std::nullopt, std::nullopt};
}

// Goes on with a result, or begins again if it was killed before its first frame; nothing if it is complete.
std::optional<Opened> resume(const ChosenCase& chosen, const Engine& engine, const std::filesystem::path& file) {
    const Problem& c = chosen.c;
    Result old = read_result(file);
    if (!goes_on(c, old, file)) return std::nullopt;
    if (c.is_equilibrium())
        throw CaseError(fmt::format("{}: equilibria are not resumed; run the case again without --resume", c.path));
    if (old.frames.empty() && !old.checkpoint) return create(chosen, engine, file);
    ResultWriter writer = ResultWriter::resume(
        file, [&](const Record& record) { engine.check_restart(record); }, kept_case(c));
    const Record& record = writer.restart_record();
    Restart restart{record};
    if (record.mesh) restart.cells = old.meshes.at(*record.mesh);
    return Opened{std::move(writer), std::move(restart), std::move(old)};
}

// A result that cannot be written or resumed is found before anything is computed: bad input.
std::optional<Opened> open_result(const ChosenCase& c, const Engine& engine, const std::filesystem::path& file,
                                  bool resuming) {
    return as_bad_input([&]() -> std::optional<Opened> {
        if (resuming && std::filesystem::exists(file)) return resume(c, engine, file);
        return create(c, engine, file);
    });
}

// A frame at a time that lies behind cannot be written any more.
void tell_missed_outputs(const Problem& c, const Result& result, double from) {
    if (const auto missed = missed_outputs(c, result, from); !missed.empty())
        say(stderr, "{}: time.output {} is not written: the run goes on from t = {:.6g}\n", c.path,
            fmt::join(missed, ", "), from);
}

int run_case(ChosenCase chosen, const std::filesystem::path& file, const RunOptions& options) {
    Problem& c = chosen.c;
    if (options.check_derivatives && !derivatives_pass(c)) {
        say(stderr, "{}: a derivative is wrong; the case was not run\n", c.path);
        return exit_code(Stop::solver_failed);
    }
    if (options.expect)
        for (const Expectation& e : c.expect.values)
            if (e.time) c.time.output.push_back(*e.time);

    if (!c.input) c.input = current_input(c);
    PauseWatch watch(c.time.limit, tubule::interrupted);  // the start counts, too
    watch.discount(-chosen.seconds);
    const Engine engine(c);
    const double before = watch.seconds();
    std::optional<Opened> result = open_result(chosen, engine, file, options.resume);
    if (!result) {
        if (!options.quiet) say(stdout, "{}: {} is complete, nothing to resume\n", c.path, file.string());
        return options.expect ? compare(c, file) : 0;
    }
    if (!options.quiet && options.resume && !result->unfinished)
        say(stderr, "{}: note: there is no {} to go on from: the run begins at t = 0\n", c.path, file.string());
    if (!options.quiet && result->restart) tell_missed_outputs(c, *result->unfinished, result->restart->record.time);
    watch.discount(watch.seconds() - before);  // or a large result could never be resumed under a short limit
    if (!options.quiet && !result->restart)
        for (const std::string& note : physics_notes(c)) say(stderr, "{}\n", note);
    if (const std::string warning = engine.warning(); !warning.empty() && !options.quiet)
        say(stderr, "{}: warning: {}\n", c.path, warning);
    if (!options.quiet && !result->restart && engine.start())
        if (const auto forecast = forecast_if_long(c, *engine.start()))
            say(stderr, "{}: expected: {}\n", c.path, words(*forecast));
    Ended ended;
    {
        Recorder recorder(c, result->writer, options.quiet || c.is_equilibrium(),
                          result->restart ? &result->restart->record : nullptr);
        ended = run_to_end(engine, recorder, result->restart ? &*result->restart : nullptr,
                           result->unfinished ? &*result->unfinished : nullptr);
    }
    const RunSummary& summary = ended.summary;
    const double seconds = watch.seconds();
    // An earlier result stays where this run has no row to put in its place.
    const bool stays = !result->writer.began() && (ended.failed || !result->restart) && has_rows(file);
    if (!stays) {
        result->writer.finish(about_end(c, summary, seconds));
        if (options.written) options.written(file);
    }
    const bool compared = options.expect && !stays && summary.stop.reason != Stop::interrupted;
    const int status = compared ? compare(c, file) : exit_code(summary.stop.reason);
    const std::string words = file.string() + (stays ? " is left as it was: this run has no row" : "");
    if (!options.silent && (!options.quiet || status != 0)) report(chosen, summary, words, seconds);
    return status;
}

// A run would destroy the result that it starts from before it has read it.
void refuse_to_replace_the_start(const Problem& c, const std::filesystem::path& file) {
    const auto* start = std::get_if<ResultFrame>(&c.shape);
    std::error_code none;
    if (start && std::filesystem::equivalent(std::filesystem::path(c.path).parent_path() / start->path, file, none))
        throw CaseError(
            fmt::format("{}: {} is where the run starts (shape.path) and must not be its result as well: "
                        "choose another one with -o",
                        c.path, file.string()));
}

bool can_be_resumed(const Problem& c, const Result& result) {
    const auto stop = stop_of(result);
    return !c.is_equilibrium() && (!stop || can_go_on(*stop)) && (!result.frames.empty() || result.checkpoint);
}

// A result of another case may be needed, and so may the hours of a run that can go on: only --overwrite replaces them.
void refuse_to_replace_another_case(const Problem& c, const std::filesystem::path& file) {
    if (!is_hdf5(file)) return;
    std::string other;
    try {
        other = other_case(c, read_case_text(file));
        if (!has_rows(file)) return;
        if (other.empty() && !can_be_resumed(c, read_result(file))) return;
    } catch (const std::runtime_error&) {
        return;  // no result, or a damaged one: the writer decides
    }
    if (other.empty())
        throw CaseError(
            fmt::format("{}: holds an unfinished run of {}\n--resume goes on with it, --overwrite begins again",
                        file.string(), c.path));
    throw CaseError(
        fmt::format("{}: holds the result of another case than {}: {}\n--overwrite replaces it, -o FILE keeps both",
                    file.string(), c.path, other));
}

}  // namespace

void check_replaced(const Problem& c, const std::filesystem::path& file, bool overwrite) {
    check_output(file);
    refuse_to_replace_the_start(c, file);
    if (!overwrite) refuse_to_replace_another_case(c, file);
}

namespace {

struct Job {
    ChosenCase chosen;
    std::filesystem::path file;
    std::optional<Paused> paused;  // while its model was chosen
};

// What is bad input is found before trial runs; a result that goes on keeps its model.
ChosenCase with_model_of_run(const Problem& c, const std::filesystem::path& file, const RunOptions& options) {
    if (c.model.kind != ModelKind::automatic) return {c, ""};
    check_output(file);
    if (options.refuse_ill_posed)
        if (const auto ill_posed = ill_posed_start(c)) throw *ill_posed;
    ChosenCase chosen;
    if (const auto before = options.resume && is_hdf5(file) ? chosen_before(file) : std::nullopt)
        chosen = with_model(c, {*before, "that of the result"});
    else
        chosen = with_chosen_model(c);
    if (!options.quiet) say(stderr, "{}: {}\n", c.path, words_of_choice(chosen));
    return chosen;
}

// To go on with a result: its case and itself.
Job job_of_result(const std::string& path, const std::vector<std::string>& sets, const RunOptions& options) {
    if (!options.resume)
        throw CaseError(fmt::format("{}: is a result: --resume goes on with it; to run it anew, give its case", path));
    if (!options.output.empty())
        throw CaseError(fmt::format("-o must be absent: {} itself goes on; copy it to keep it as it is", path));
    return as_bad_input([&] { return Job{{case_of_result(read_result(path), path, sets), ""}, path, {}}; });
}

Job job_of(const std::string& path, const RunOptions& options) {
    std::vector<std::string> sets = options.sets;
    if (options.until) sets.push_back(fmt::format("time.end={}", *options.until));
    if (is_hdf5(path)) return job_of_result(path, sets, options);
    const auto file = result_path(options, path);
    const Problem c = read_case(path, sets, options.resume ? inputs_to_resume(file) : CaseInputs{});
    if (options.expect && c.expect.values.empty() && !c.expect.stop)
        throw CaseError(fmt::format("{}: has no table [expect], with which --expect would compare", path));
    try {
        ChosenCase chosen = with_model_of_run(c, file, options);
        check_replaced(chosen.c, file, options.resume || options.overwrite);
        return {std::move(chosen), file, {}};
    } catch (const Paused& pause) {
        return {{c, ""}, file, pause};
    }
}

}  // namespace

int run_cases(const RunOptions& options) {
    if (!options.output.empty() && options.cases.size() > 1)
        throw CaseError(
            "-o names one result file, but there are several cases: leave it out, and each result has the name of its "
            "case");
    catch_interrupts();
    std::vector<Job> jobs;  // all are read before any is run: bad input leaves nothing half done
    std::set<std::filesystem::path> files;
    for (const std::string& path : options.cases) {
        jobs.push_back(job_of(path, options));
        if (options.refuse_ill_posed && !options.resume)
            if (const auto ill_posed = ill_posed_start(jobs.back().chosen.c)) throw *ill_posed;
        if (options.check_derivatives && !derivatives_can_be_checked(jobs.back().chosen.c))
            throw CaseError(path + ": --check-derivatives must be absent: it checks tubes of tier \"axisym\" only");
        if (!files.insert(jobs.back().file).second)
            throw CaseError(fmt::format("{}: two of the cases would write {}", path, jobs.back().file.string()));
    }
    int status = 0;
    for (const auto& [chosen, file, paused] : jobs) {
        const Problem& c = chosen.c;
        int one = 0;
        try {
            if (paused) throw Paused(*paused);
            one = run_case(chosen, file, options);
        } catch (const CaseError&) {
            throw;
        } catch (const Paused& pause) {  // before there was a result to write to
            say(stderr, "{}: {}{}\n", c.path, paused_at_start(pause).stop.message,
                paused && pause.reason == Stop::time_limit
                    ? ", in trial runs that choose the model: name it in model.kind"
                    : "");
            one = exit_code(pause.reason);
        } catch (const std::exception& error) {
            say(stderr, "{}: {}\n", c.path, explanation(error));
            one = exit_code(Stop::solver_failed);
        }
        if (status == 0) status = one;
        if (one == exit_code(Stop::interrupted)) break;
    }
    return status;
}

void add_run(CLI::App& app, int& exit_status) {
    CLI::App* command = app.add_subcommand("run", "Run cases, each into a result file");
    const auto o = std::make_shared<RunOptions>();
    o->refuse_ill_posed = true;
    finds_installed_cases(
        *command->add_option("CASE", o->cases, "case files; with --resume also results, which know their case")
             ->required());
    command->add_option("--set", o->sets, "override a key, such as --set energy.k42=0.06")->allow_extra_args(false);
    command->add_option("-o,--output", o->output, "result file (default: name of the case, .hdf, in this directory)");
    command->add_flag(
        "--resume", o->resume,
        "continue a result that was interrupted, killed or out of time, or extend it to a later time.end");
    command->add_option("--until", o->until, "the time at which the run ends, as --set time.end=T")
        ->check(CLI::Validator(refuse_infinite, ""));
    command->add_flag("--overwrite", o->overwrite,
                      "replace the result of another case, or one that --resume would go on with");
    command->add_flag("--quiet", o->quiet, "no progress; output only if something went wrong");
    command->add_flag("--expect", o->expect, "check [expect] of the case: exit status 0 if all of it came out, else 1");
    command->add_flag("--check-derivatives", o->check_derivatives,
                      "first check the derivatives of the energy at the initial shape");
    end_help(
        *command,
        {"tubule run cases/figure_k42_006.toml -o figure.hdf",
         "tubule run cases/figure_k42_006.toml --set energy.k42=0.1 --set time.end=0.5 -o other.hdf",
         "tubule run cases/figure_k42_006.toml -o figure.hdf --resume", "tubule run figure.hdf --resume --until 2"},
        {{0}, {1, "--expect: something did not come out as expected"}, {2}, {3}, {4}, {5}, {130}},
        {"case_files", "results"});
    command->callback([o, &exit_status] { exit_status = run_cases(*o); });
}

}  // namespace tubule
