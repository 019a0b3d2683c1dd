// tubule run CASE... : runs cases, each into a result file.
#include "axisym/run.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "axisym/derivatives.hpp"
#include "common/case/read.hpp"
#include "common/result/result.hpp"
#include "common/solve/interrupt.hpp"
#include "common/solve/progress.hpp"
#include "tools/command/build_info.hpp"
#include "tools/command/commands.hpp"

namespace tubule {

namespace {

struct RunOptions {
    std::vector<std::string> cases, sets;
    std::string output;
    bool resume = false, quiet = false, expect = false, check_derivatives = false;
};

// Hands a run's rows and frames to the result file and keeps what [expect] will ask for.
class Recorder : public axisym::RunObserver {
public:
    Recorder(const Case& c, ResultWriter& writer, bool quiet, double begin)
        : writer_(writer), progress_(begin, c.time.end, {.quiet = quiet}) {
        for (const Expectation& e : c.expect.values)
            if (e.time) kept_times_.push_back(*e.time);
    }
    void row(std::span<const double> values) override {
        writer_.row(values);
        last_.assign(values.begin(), values.end());
        if (std::find(kept_times_.begin(), kept_times_.end(), values[0]) != kept_times_.end()) kept_.push_back(last_);
    }
    void frame(const std::function<Record()>& make) override { writer_.frame(make()); }
    void checkpoint(const Record& state) override { writer_.checkpoint(state); }
    void discard() override {
        writer_.discard();
        kept_.clear();
    }
    void progress(double time, double energy, double step) override { progress_(time, energy, step); }
    bool interrupted() override { return tubule::interrupted(); }

    // The row at a time, or the last one.
    const std::vector<double>* row_at(std::optional<double> time) const {
        if (!time) return last_.empty() ? nullptr : &last_;
        for (const auto& row : kept_)
            if (row[0] == *time) return &row;
        return nullptr;
    }

private:
    ResultWriter& writer_;
    Progress progress_;
    std::vector<double> kept_times_, last_;
    std::vector<std::vector<double>> kept_;
};

std::filesystem::path result_path(const RunOptions& options, const Case& c) {
    if (!options.output.empty()) return options.output;
    return std::filesystem::path(c.path).filename().replace_extension(".hdf");
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

About about_end(const Case& c, const axisym::RunSummary& s, double wall_seconds) {
    const auto& n = s.counters;
    About about{{"stop", std::string(name(s.stop.reason))},
                {"stop_time", s.stop.time},
                {"stop_message", s.stop.message},
                {"advice", s.stop.advice},
                {"asked_accuracy", c.accuracy.energy},
                {"estimated_error", s.estimated_error},
                {"E_ref", s.reference_energy},
                {"wall_seconds", wall_seconds},
                {"attempts", std::int64_t{s.attempts}},
                {"meshes", std::int64_t{s.meshes}},
                {"elements", std::int64_t{s.elements}},
                {"time_tolerance", s.time_tolerance},
                {"steps", std::int64_t{n.steps}},
                {"residuals", std::int64_t{n.residuals}},
                {"jacobians", std::int64_t{n.jacobians}},
                {"newton_iterations", std::int64_t{n.newton_iterations}},
                {"error_test_failures", std::int64_t{n.error_failures}},
                {"newton_failures", std::int64_t{n.newton_failures}}};
    std::string warnings;
    for (const std::string& w : s.warnings) warnings += (warnings.empty() ? "" : "\n") + w;
    about.emplace_back("warnings", warnings);
    return about;
}

// Expectations that were not met, one line each.
std::vector<std::string> unmet(const Case& c, const axisym::RunSummary& summary, const Recorder& recorder) {
    std::vector<std::string> lines;
    const Stop expected = c.expect.stop.value_or(Stop::finished);
    if (summary.stop.reason != expected)
        lines.push_back(fmt::format("stop is {}, expected {}", name(summary.stop.reason), name(expected)));
    const auto names = axisym::series_names(c);
    for (const Expectation& e : c.expect.values) {
        const auto column = std::find(names.begin(), names.end(), e.series) - names.begin();
        const std::string where = e.time ? fmt::format("{} at t = {}", e.series, *e.time) : e.series + " at the end";
        const std::vector<double>* row = recorder.row_at(e.time);
        if (!row || column == static_cast<std::ptrdiff_t>(names.size())) {
            lines.push_back(fmt::format("{} was not computed", where));
            continue;
        }
        const double found = (*row)[column];
        const double allowed = std::max(e.abs.value_or(0), e.rel.value_or(0) * std::abs(e.value));
        if (!(std::abs(found - e.value) <= allowed))
            lines.push_back(
                fmt::format("{} is {:.12g}, expected {:.12g} within {:.3g}", where, found, e.value, allowed));
    }
    return lines;
}

void report(const Case& c, const axisym::RunSummary& s, const std::filesystem::path& file, double seconds) {
    fmt::print("{}: {} at t = {:.6g}: {}\n", c.path, name(s.stop.reason), s.stop.time, s.stop.message);
    if (!s.stop.advice.empty()) fmt::print("    {}\n", s.stop.advice);
    for (const std::string& warning : s.warnings) fmt::print("    warning: {}\n", warning);
    fmt::print("    energy {:.9g}, error at most {:.2g} of E_ref = {:.4g} (estimated; {:.2g} asked)\n", s.energy,
               s.estimated_error, s.reference_energy, c.accuracy.energy);
    fmt::print("    {} steps, {} elements, {:.3g} s; {}\n", s.counters.steps, s.elements, seconds, file.string());
}

// Prints the Taylor slopes of every term at the start; whether all are as they should be.
bool derivatives_pass(const Case& c) {
    bool pass = true;
    for (const auto& [key, check] : axisym::check_terms(c)) {
        fmt::print("{}: {}\n{}\n", c.path, key, check.text());
        pass = pass && check.pass();
    }
    return pass;
}

// What a result already holds decides whether there is anything to resume.
std::optional<ResultWriter> resumed(const Case& c, const std::filesystem::path& file) {
    const Result old = read_result(file);
    if (old.case_text.text != c.text || old.case_text.sets != c.sets)
        throw CaseError(fmt::format("{}: cannot be resumed with {}: it belongs to another case or other --set",
                                    file.string(), c.path));
    for (const auto& [name, value] : old.about)
        if (name == "stop") {
            const auto stop = stop_from_name(std::get<std::string>(value));
            if (stop && *stop != Stop::time_limit && *stop != Stop::interrupted) return std::nullopt;
        }
    return ResultWriter::resume(file);
}

int run_case(Case c, const RunOptions& options) {
    const std::filesystem::path file = result_path(options, c);
    if (options.check_derivatives && !derivatives_pass(c)) {
        fmt::print(stderr, "{}: a derivative is wrong; nothing was run\n", c.path);
        return exit_code(Stop::solver_failed);
    }
    if (options.expect)
        for (const Expectation& e : c.expect.values)
            if (e.time) c.time.output.push_back(*e.time);

    const auto started = std::chrono::steady_clock::now();
    std::optional<ResultWriter> writer;
    if (options.resume && std::filesystem::exists(file)) {
        writer = resumed(c, file);
        if (!writer) {
            fmt::print("{}: {} is complete, nothing to resume\n", c.path, file.string());
            return 0;
        }
    }
    std::optional<Record> restart;
    if (writer)
        restart = writer->restart_record();
    else
        writer = ResultWriter::create(file, {c.text, c.sets}, about_start(), axisym::series_names(c));
    axisym::RunSummary summary;
    std::vector<std::string> missed;
    {
        Recorder recorder(c, *writer, options.quiet, restart ? restart->time : 0);
        summary = axisym::run(c, recorder, restart ? &*restart : nullptr);
        if (options.expect) missed = unmet(c, summary, recorder);
    }
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
    writer->finish(about_end(c, summary, seconds));
    if (!options.quiet || exit_code(summary.stop.reason) != 0) report(c, summary, file, seconds);
    if (!options.expect) return exit_code(summary.stop.reason);
    for (const std::string& line : missed) fmt::print(stderr, "{}: not as expected: {}\n", c.path, line);
    return missed.empty() ? 0 : 1;
}

int run_cases(const RunOptions& options) {
    if (!options.output.empty() && options.cases.size() > 1)
        throw CaseError("-o names one result file, but there are several cases");
    std::vector<Case> cases;  // all are read before any is run: bad input leaves nothing half done
    for (const std::string& path : options.cases) cases.push_back(read_case(path, options.sets));
    catch_interrupts();
    int status = 0;
    for (const Case& c : cases) {
        const int one = run_case(c, options);
        if (status == 0) status = one;
        if (one == exit_code(Stop::interrupted)) break;
    }
    return status;
}

}  // namespace

void add_run(CLI::App& app, int& exit_status) {
    CLI::App* command = app.add_subcommand("run", "Run cases, each into a result file");
    const auto o = std::make_shared<RunOptions>();
    command->add_option("CASE", o->cases, "case files")->required();
    command->add_option("--set", o->sets, "override a key, such as --set energy.k42=0.06")->allow_extra_args(false);
    command->add_option("-o,--output", o->output, "result file (default: name of the case, .hdf, in this directory)");
    command->add_flag("--resume", o->resume, "go on with a result that was interrupted, killed or out of time");
    command->add_flag("--quiet", o->quiet, "no progress; words only if something went wrong");
    command->add_flag("--expect", o->expect, "check [expect] of the case: exit status 0 if all of it came out, else 1");
    command->add_flag("--check-derivatives", o->check_derivatives,
                      "first check the derivatives of the energy at the start");
    command->callback([o, &exit_status] { exit_status = run_cases(*o); });
}

}  // namespace tubule
