// tubule confirm SCAN: some points of a scan again in three dimensions, to see whether they say the same: motions from
// shapes with waves, equilibria from those of tier axisym.
#include "tools/confirm/confirm.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "common/case/input_file.hpp"
#include "common/case/read.hpp"
#include "common/result/result.hpp"
#include "common/solve/interrupt.hpp"
#include "common/solve/message.hpp"
#include "tools/command/commands.hpp"
#include "tools/command/options.hpp"
#include "tools/command/output.hpp"
#include "tools/compare/results.hpp"
#include "tools/scan/scan_file.hpp"

namespace tubule {

namespace {

namespace fs = std::filesystem;
using confirm::Verdict;

constexpr int disagreement = 1;

struct ConfirmOptions {
    std::string scan, folder;
    int points = 8;
    unsigned seed = 1;
    confirm::Choices choices;
    bool csv = false, json = false, quiet = false;
};

// A picked point in both tiers.
struct ConfirmedPoint {
    confirm::Pick pick;
    std::vector<std::string> sets;  // what varies, key=value
    Problem c;
    PointResult axisymmetric;
    std::string surface_case, file;  // text; result
    confirm::SurfaceEnd surface;     // of a motion
    std::string profile_file;        // of an equilibrium: that of tier axisym
    confirm::EquilibriumEnd equilibrium;

    Verdict verdict() const { return c.is_equilibrium() ? equilibrium.verdict : surface.verdict; }
};

bool agrees(const ConfirmedPoint& p) {
    return p.verdict() == Verdict::agrees;
}

std::string outcome_words(const ConfirmedPoint& p) {
    if (p.surface.verdict == Verdict::symmetry_broken) return "asymmetric";
    return std::string(name(p.surface.outcome));
}

// ---- in words

void add_spectrum(std::string& out, const ConfirmedPoint& p) {
    const auto waves = confirm::fastest_waves(p.c);
    if (!waves.empty()) add(out, "    the straight tube, fastest of the waves that fit:\n");
    for (const theory::FittingWave& wave : waves)
        add(out, "        m = {}, n = {:2}: rate {:.6g}{}\n", wave.m, wave.n, wave.rate,
            !(wave.rate > 0) ? ", decays"
            : wave.m == 0    ? ", grows"
                             : ", grows, and tier 1 cannot see it");
}

void add_fit(std::string& out, const confirm::SurfaceEnd& a) {
    if (std::isnan(a.fit.rate)) return;
    add(out, "    wave {},{}: rate {:.4g} +- {:.2g} for t = {:.4g} to {:.4g}", a.n, a.m, a.fit.rate, a.fit.error,
        a.fit.from, a.fit.to);
    if (!std::isnan(a.linear_rate)) add(out, "; {:.4g} by linear theory of the case", a.linear_rate);
    add(out, "\n");
}

std::string shown(double value) {
    return std::isnan(value) ? "-" : fmt::format("{:.3g}", value);
}

std::string waves(const std::set<int>& m) {
    return m.empty() ? "none" : fmt::format("{}", fmt::join(m, " "));
}

std::string words_of_equilibria(const std::vector<ConfirmedPoint>& points) {
    std::string out;
    add(out, "{:>7}  {:8}  {:12}  {:>12}  {:>9}  {:>10}  {:>10}  {:>10}  {:>3}  {:>9}  {:>9}  {}\n", "point", "why",
        "shape", "energy", "dE/E_ref", "est. error", "grow: m", "in 3D", "m", "rate", "in 3D", "verdict");
    for (const ConfirmedPoint& p : points) {
        const confirm::EquilibriumEnd& e = p.equilibrium;
        add(out, "{:>7}  {:8}  {:12}  {:>12.7g}  {:>9}  {:>10}  {:>10}  {:>10}  {:>3}  {:>9}  {:>9}  {}\n",
            p.pick.point, name(p.pick.why), name(p.axisymmetric.outcome), e.axisym_energy, shown(e.energy_difference),
            shown(e.energy_error), waves(e.axisym_growing), waves(e.growing), e.m, shown(e.axisym_rate), shown(e.rate),
            name(e.verdict));
    }
    for (const ConfirmedPoint& p : points)
        if (!agrees(p))
            add(out, "\npoint {}: {}; {}, axisym {}, surface3d {}; {}\n", p.pick.point, fmt::join(p.sets, ", "),
                name(p.verdict()), p.equilibrium.axisym_stop, p.equilibrium.stop, p.file);
    return out;
}

std::string words_of_motions(const std::vector<ConfirmedPoint>& points) {
    std::string out;
    add(out, "{:>7}  {:8}  {:12}  {:12}  {:>8}  {:>8}  {:>5}  {:>8}  {:>8}  {:>16}  {:>8}  {}\n", "point", "why",
        "tier 1", "surface3d", "t", "dE/E_ref", "wave", "size", "growth", "rate", "linear", "verdict");
    for (const ConfirmedPoint& p : points) {
        const confirm::SurfaceEnd& a = p.surface;
        add(out, "{:>7}  {:8}  {:12}  {:12}  {:>8}  {:>8}  {:>5}  {:>8}  {:>8}  {:>16}  {:>8}  {}\n", p.pick.point,
            name(p.pick.why), name(p.axisymmetric.outcome), outcome_words(p), shown(a.time), shown(a.energy_difference),
            fmt::format("{},{}", a.n, a.m), shown(a.amplitude), shown(a.amplitude / a.noise),
            std::isnan(a.fit.rate) ? "-" : fmt::format("{:.3g} +- {:.1g}", a.fit.rate, a.fit.error),
            shown(a.linear_rate), name(a.verdict));
    }
    for (const ConfirmedPoint& p : points) {
        if (agrees(p)) continue;
        add(out, "\npoint {}: {}; {}, {}; {}\n", p.pick.point, fmt::join(p.sets, ", "), name(p.surface.verdict),
            p.surface.stop, p.file);
        add_fit(out, p.surface);
        add_spectrum(out, p);
    }
    return out;
}

std::string words(const std::vector<ConfirmedPoint>& points) {
    std::string out = points.front().c.is_equilibrium() ? words_of_equilibria(points) : words_of_motions(points);
    add(out, "\n{} of {} points agree\n", std::count_if(points.begin(), points.end(), agrees), points.size());
    return out;
}

// ---- as a table

using Columns = std::vector<std::pair<std::string, Value>>;

Columns columns_of_equilibrium(const ConfirmedPoint& p) {
    const confirm::EquilibriumEnd& e = p.equilibrium;
    return {{"why", std::string(name(p.pick.why))},
            {"axisym_outcome", std::string(name(p.axisymmetric.outcome))},
            {"axisym_stop", e.axisym_stop},
            {"stop", e.stop},
            {"axisym_energy", e.axisym_energy},
            {"energy", e.energy},
            {"energy_difference", e.energy_difference},
            {"energy_error", e.energy_error},
            {"axisym_growing", waves(e.axisym_growing)},
            {"growing", waves(e.growing)},
            {"m", std::int64_t{e.m}},
            {"axisym_rate", e.axisym_rate},
            {"rate", e.rate},
            {"verdict", std::string(name(e.verdict))},
            {"file", p.file}};
}

Columns columns(const ConfirmedPoint& p) {
    if (p.c.is_equilibrium()) return columns_of_equilibrium(p);
    const confirm::SurfaceEnd& a = p.surface;
    Columns all{{"why", std::string(name(p.pick.why))},
                {"axisym_outcome", std::string(name(p.axisymmetric.outcome))},
                {"axisym_time", p.axisymmetric[Measure::time]},
                {"outcome", outcome_words(p)},
                {"stop", a.stop},
                {"time", a.time},
                {"energy_difference", a.energy_difference},
                {"energy_error", a.energy_error},
                {"n", std::int64_t{a.n}},
                {"m", std::int64_t{a.m}},
                {"noise", a.noise},
                {"amplitude", a.amplitude},
                {"rate", a.fit.rate},
                {"rate_error", a.fit.error},
                {"linear_rate", a.linear_rate},
                {"verdict", std::string(name(a.verdict))},
                {"file", p.file}};
    for (const theory::FittingWave& wave : confirm::fastest_waves(p.c)) {
        all.push_back({fmt::format("fastest_n_m{}", wave.m), std::int64_t{wave.n}});
        all.push_back({fmt::format("fastest_rate_m{}", wave.m), wave.rate});
    }
    return all;
}

std::string csv(const std::vector<ConfirmedPoint>& points) {
    std::string out = "point,set";
    for (const auto& [key, value] : columns(points.front())) add(out, ",{}", key);
    for (const ConfirmedPoint& p : points) {
        add(out, "\n{},{}", p.pick.point, quoted(fmt::format("{}", fmt::join(p.sets, " "))));
        for (const auto& [key, value] : columns(p)) std::visit([&](const auto& v) { add(out, ",{}", v); }, value);
    }
    return out + "\n";
}

std::string json_text(const ConfirmOptions& options, const std::vector<ConfirmedPoint>& points) {
    Json list = Json::array();
    for (const ConfirmedPoint& p : points)
        list.push_back({{"point", p.pick.point}, {"set", p.sets}, {"values", json_object(columns(p))}});
    Json all{{"scan", options.scan}, {"seed", options.seed}};
    const bool motions = !points.front().c.is_equilibrium();
    if (options.choices.elements || motions) all["elements"] = options.choices.elements.value_or(200);
    if (motions) all["noise"] = options.choices.noise;
    all["points"] = list;
    return line_of(all);
}

// ---- the whole

void check(const ConfirmOptions& options) {
    const auto refuse = [](const std::string& why) { throw CaseError(why); };
    if (options.points < 1) refuse(fmt::format("--points must be 1 or more, not {}", options.points));
    if (const auto n = options.choices.elements; n && (*n < 20 || *n > 1000000))
        refuse(fmt::format("--elements must be an integer from 20 to 1000000, not {}", *n));
    if (!(options.choices.noise > 0 && options.choices.noise < 0.1))
        refuse(fmt::format("--noise must be above 0 and below 0.1, not {}", options.choices.noise));
    if (options.choices.end && !(*options.choices.end > 0))
        refuse(fmt::format("--end must be above 0, not {}", *options.choices.end));
    std::error_code error;
    if (!fs::exists(options.scan, error))
        throw CaseError(
            fmt::format("{}: {}", options.scan, error ? error.message() : "no such file" + why_missing(options.scan)));
    if (!is_scan(options.scan))
        throw CaseError(options.scan + ": is not a result of tubule scan, which is made with tubule scan FILE");
}

// All cases are checked before anything is run.
std::vector<ConfirmedPoint> plan(const ConfirmOptions& options, const ScanResult& result) {
    const auto around = result.scan.boundary ? result.scan.boundary->around : std::nullopt;
    const auto common = static_cast<std::ptrdiff_t>(result.scan.sets.size());  // settings of all points
    std::vector<ConfirmedPoint> all;
    for (const confirm::Pick& pick : confirm::pick_points(result.scan.shape(), result.outcomes(), around,
                                                          static_cast<std::size_t>(options.points), options.seed)) {
        const auto sets = result.scan.sets_of(pick.point);
        ConfirmedPoint p;
        p.pick = pick;
        p.sets = {sets.begin() + common, sets.end()};
        p.c = result.scan.case_of(pick.point);
        p.c.title = fmt::format("{}, perturbed", fmt::join(p.sets, ", "));
        p.axisymmetric = result.points[pick.point];
        if (!p.c.runs_in_tier_axisym())
            throw CaseError(options.scan + ": is a scan of tier \"surface3d\" already: there is nothing to confirm");
        if (p.c.is_equilibrium() && options.choices.end)
            throw CaseError("--end is for scans of motions: " + options.scan + " is one of equilibria");
        if (!p.c.is_equilibrium()) p.surface_case = confirm::surface_case(p.c, p.axisymmetric, options.choices);
        all.push_back(std::move(p));
    }
    if (all.empty()) throw CaseError(options.scan + ": has no points to confirm: none was run without failing");
    return all;
}

fs::path make_folder(const ConfirmOptions& options) {
    const fs::path scan = options.scan, folder = options.folder.empty()
                                                     ? scan.parent_path() / (scan.stem().string() + "_confirm")
                                                     : fs::path(options.folder);
    std::error_code error;
    fs::create_directories(folder, error);
    if (error) throw CaseError(fmt::format("{}: cannot be made: {}", folder.string(), error.message()));
    return folder;
}

// Equilibria are not resumed: those that were interrupted are searched again.
bool holds(const fs::path& result, const std::string& case_text) {
    try {
        if (!fs::exists(result)) return false;
        const Result found = read_result(result);
        const std::string stop = compare::stop_word(found);
        const bool over = stop_from_name(stop) && stop != name(Stop::interrupted) && stop != name(Stop::time_limit);
        return found.case_text.text == case_text && (over || !found.series.contains("negative_directions"));
    } catch (const std::runtime_error&) {  // killed before it was a result
        return false;
    }
}

// A case to run and how it ended: the exit status, and the result if there is one.
struct CaseToRun {
    std::string case_text, toml;
};
struct CaseEnd {
    int status = 0;
    std::string file;
};

// Runs it, or goes on with it, or finds it done by an earlier call that asked the same.
CaseEnd run_once(const CaseToRun& task) {
    const fs::path hdf = fs::path(task.toml).replace_extension(".hdf");
    RunOptions run{.cases = {task.toml}, .sets = {}, .output = hdf.string()};
    run.overwrite = true;
    run.resume = holds(hdf, task.case_text);
    run.quiet = run.silent = true;
    std::ofstream(task.toml, std::ios::binary) << task.case_text;
    CaseEnd end;
    end.file = run.resume ? hdf.string() : "";
    run.written = [&](const fs::path& file) { end.file = file.string(); };
    try {
        end.status = run_cases(run);
    } catch (const std::exception& error) {  // the case could not be written
        say(stderr, "tubule: {}\n", explanation(error));
        end.status = 2;
    }
    return end;
}

// Equilibria of tier axisym, alone and with their growth rates (milliseconds each), and the cases that lift them.
void prepare_equilibria(std::vector<ConfirmedPoint>& points, const fs::path& folder, const ConfirmOptions& options) {
    for (ConfirmedPoint& p : points) {
        if (!p.c.is_equilibrium()) continue;
        const fs::path toml = folder / fmt::format("point_{:06}_axisym.toml", p.pick.point);
        p.profile_file = run_once({confirm::profile_case(p.c), toml.string()}).file;
        if (p.profile_file.empty()) continue;
        p.surface_case = confirm::lifted_case(p.c, read_result(p.profile_file),
                                              fs::path(p.profile_file).filename().string(), options.choices.elements);
    }
}

// ---- on several ranks

// A task: the number of a point and its run. A result: the number, and how the run ended.
Packet run_task(const Packet& task) {
    const CaseEnd end = run_once({task[1], task[2]});
    return {task[0], end.status, end.file};
}

// The runs of all points, in order, whoever asks for one.
class SurfaceRuns : public Tasks {
public:
    SurfaceRuns(std::vector<ConfirmedPoint>& points, const fs::path& folder, bool quiet)
        : points_(points), folder_(folder), quiet_(quiet) {}

    NextTask take(Packet& task, bool) override {
        const std::lock_guard lock(mutex_);
        while (next_ < points_.size() && points_[next_].surface_case.empty()) ++next_;  // no shape to lift
        if (next_ == points_.size() || status_ != 0 || interrupted()) return NextTask::over;
        const ConfirmedPoint& p = points_[next_];
        if (!quiet_)
            say(stderr, "{} of {}: point {}, {}\n", next_ + 1, points_.size(), p.pick.point, fmt::join(p.sets, ", "));
        const fs::path toml = folder_ / fmt::format("point_{:06}.toml", p.pick.point);
        task = {next_, p.surface_case, toml.string()};
        ++next_;
        return NextTask::ready;
    }
    void give(const Packet& result) override {
        const std::lock_guard lock(mutex_);
        const int status = result[1];
        if (status == exit_code(Stop::interrupted) || status == 2) status_ = status;
        points_[result[0]].file = result[2];
    }
    void fail(std::exception_ptr error) override {
        const std::lock_guard lock(mutex_);
        error_ = std::move(error);
        status_ = exit_code(Stop::solver_failed);
    }

    // When all is over: 0, or that of what ended it early. Throws what failed.
    int status() const {
        if (error_) std::rethrow_exception(error_);
        return interrupted() ? exit_code(Stop::interrupted) : status_;
    }

private:
    std::mutex mutex_;
    std::vector<ConfirmedPoint>& points_;
    fs::path folder_;
    bool quiet_;
    std::size_t next_ = 0;
    int status_ = 0;
    std::exception_ptr error_;
};

int run_all(SurfaceRuns& runs, Ranks* ranks) {
    if (ranks)
        ranks->run(runs, "confirm", run_task);
    else
        work_off(runs, run_task);
    const int status = runs.status();
    if (ranks && status == exit_code(Stop::interrupted)) abort_interrupted(*ranks);
    return status;
}

int confirm_scan(const ConfirmOptions& options, Ranks* ranks) {
    check(options);
    std::vector<ConfirmedPoint> points = plan(options, read_scan_result(options.scan));
    const fs::path folder = make_folder(options);
    prepare_equilibria(points, folder, options);
    SurfaceRuns runs(points, folder, options.quiet);
    if (const int status = run_all(runs, ranks); status != 0) return status;
    for (ConfirmedPoint& p : points) {
        if (p.file.empty()) {
            say(stderr, "point {}: the run failed at its start, and an earlier result was left as it was\n",
                p.pick.point);
            continue;
        }
        try {
            if (p.c.is_equilibrium())
                p.equilibrium = confirm::equilibrium_end(read_result(p.profile_file), read_result(p.file));
            else
                p.surface = confirm::surface_end(p.axisymmetric, read_result(p.file));
        } catch (const std::runtime_error& error) {  // given up without a result
            say(stderr, "{}: {}\n", p.file, error.what());
        }
    }
    const std::string out = options.csv ? csv(points) : options.json ? json_text(options, points) : words(points);
    print_answer(out);
    return std::all_of(points.begin(), points.end(), agrees) ? 0 : disagreement;
}

int confirm_ranked(const ConfirmOptions& options) {
    catch_interrupts();
    return run_ranked([&](Ranks* ranks) { return confirm_scan(options, ranks); },
                      [](Ranks& ranks) { ranks.serve([](const Packet&) { return run_task; }); });
}

}  // namespace

void add_confirm(CLI::App& app, int& exit_status) {
    CLI::App* command =
        app.add_subcommand("confirm",
                           "Run some points of a scan in three dimensions: motions from shapes that are "
                           "not quite symmetric, equilibria from those of tier axisym");
    const auto o = std::make_shared<ConfirmOptions>();
    command->add_option("SCAN", o->scan, "result of tubule scan")->required();
    command->add_option("--points", o->points, "how many (8): both sides of lines, corners of the grid, random ones");
    command->add_option("--seed", o->seed, "of the random choice (1)");
    command->add_option("--elements", o->choices.elements,
                        "about how many triangles (motions: 200; equilibria: as many as an error of 1e-4 needs)");
    command->add_option("--noise", o->choices.noise, "motions: amplitude of the added waves, part of the radius (1e-3)")
        ->check(refuse_infinite);
    command->add_option("--end", o->choices.end, "motions: run until then instead of time.end of the case")
        ->check(refuse_infinite);
    command->add_option("-o,--output", o->folder, "folder of the results (default: beside the scan, NAME_confirm)");
    CLI::Option* csv = command->add_flag("--csv", o->csv, "the table, in full precision");
    command->add_flag("--json", o->json, "the same, as JSON")->excludes(csv);
    command->add_flag("--quiet", o->quiet, "no progress output");
    end_help(*command, {"tubule confirm k42.hdf --points 2"},
             {{0, "all points agree"},
              {1, "a point comes out differently, or has lost its symmetry"},
              {2},
              {4},
              {130, "interrupted; the same command continues"}},
             {"scans"});
    command->callback([o, &exit_status] { exit_status = confirm_ranked(*o); });
}

}  // namespace tubule
