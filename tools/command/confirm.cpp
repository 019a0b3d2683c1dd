// tubule confirm SCAN: some points of a scan again in three dimensions, to see
// whether they say the same.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/case/read.hpp"
#include "common/result/result.hpp"
#include "tools/command/commands.hpp"
#include "tools/command/json.hpp"
#include "tools/confirm/picks.hpp"
#include "tools/confirm/surface_point.hpp"
#include "tools/scan/scan_file.hpp"

namespace tubule {

namespace {

using confirm::Verdict;
using Text = fmt::memory_buffer;

template <class... Args>
void add(Text& out, fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(out), format, std::forward<Args>(args)...);
}

constexpr int disagreement = 1;

struct ConfirmOptions {
    std::string scan, folder;
    int points = 8;
    unsigned seed = 1;
    confirm::Choices choices;
    bool csv = false, json = false, quiet = false;
};

// A picked point in both tiers.
struct Row {
    confirm::Pick pick;
    std::vector<std::string> sets;  // what varies, key=value
    PointResult axisymmetric;
    confirm::Answer answer;
    std::vector<confirm::Explanation> explanations;  // where they disagree
    std::string file;
};

// The part of a point's settings that varies.
std::vector<std::string> varied(const Scan& scan, std::size_t point) {
    const auto all = scan.sets_of(point);
    return {all.begin() + static_cast<std::ptrdiff_t>(scan.sets.size()), all.end()};
}

void write_text(const std::filesystem::path& path, const std::string& text) {
    std::ofstream file(path, std::ios::binary);
    file << text;
    file.close();
    if (!file) throw CaseError(path.string() + ": cannot be written");
}

struct Planned {
    Row row;
    Case c;
    std::vector<confirm::AddedWave> waves;
    std::string text;  // of the case in three dimensions
};

// All is checked before anything is run.
std::vector<Planned> plan(const ConfirmOptions& options, const ScanResult& result) {
    const auto& around = result.scan.boundary ? result.scan.boundary->around : std::nullopt;
    std::vector<Planned> all;
    for (const confirm::Pick& pick : confirm::pick_points(result.shape(), result.outcomes(), around,
                                                          static_cast<std::size_t>(options.points), options.seed)) {
        Planned p{{pick, varied(result.scan, pick.point), result.points[pick.point], {}, {}, {}},
                  result.scan.case_of(pick.point),
                  {},
                  {}};
        if (p.c.tier != Tier::axisym)
            throw CaseError(options.scan +
                            ": is a scan of tier \"surface3d\" "
                            "already: there is nothing to confirm");
        p.waves = confirm::added_waves(p.c, p.row.axisymmetric);
        p.text = confirm::surface_case(p.c, p.waves, options.choices);
        all.push_back(std::move(p));
    }
    if (all.empty()) throw CaseError(options.scan + ": has no points to confirm: none was run without failing");
    return all;
}

// Runs the point, or goes on with it, or finds it done by an earlier call that asked the same. The exit status.
int run_in_3d(Planned& p, const std::filesystem::path& folder) {
    const std::filesystem::path toml = folder / fmt::format("point_{:06}.toml", p.row.pick.point),
                                hdf = std::filesystem::path(toml).replace_extension(".hdf");
    bool same = false;
    try {
        same = std::filesystem::exists(hdf) && read_result(hdf).case_text.text == p.text;
    } catch (const std::runtime_error&) {  // killed before it was a result
    }
    write_text(toml, p.text);
    p.row.file = hdf.string();
    RunOptions run;
    run.cases = {toml.string()};
    run.output = hdf.string();
    run.resume = same;
    run.quiet = run.silent = true;
    return run_cases(run);
}

bool agrees(const Row& row) {
    return row.answer.verdict == Verdict::agrees;
}

std::string outcome_words(const Row& row) {
    if (row.answer.verdict == Verdict::symmetry_broken) return "asymmetric";
    return std::string(name(row.answer.outcome));
}

// ---- in words

void add_explanation(Text& out, const Row& row) {
    for (const confirm::Explanation& one : row.explanations) {
        add(out,
            "    straight tube of radius {:.6g}, tension {:.6g}; of the waves that "
            "fit, fastest:\n",
            one.radius, one.tension);
        for (const theory::FittingWave& wave : one.waves)
            add(out, "        m = {}, n = {:2}: rate {:.6g}{}\n", wave.m, wave.n, wave.rate,
                wave.rate <= 0 ? ", decays"
                : wave.m == 0  ? ", grows"
                               : ", grows, and tier 1 cannot see it");
    }
}

std::string words(const std::vector<Row>& rows) {
    Text out;
    add(out, "{:>7}  {:8}  {:17}  {:17}  {:>10}  {:>9}  {:>7}  {:>9}  {:>8}  {}\n", "point", "why", "tier 1",
        "surface3d", "t", "dE/E_ref", "wave", "size", "growth", "verdict");
    for (const Row& row : rows)
        add(out,
            "{:>7}  {:8}  {:17}  {:17}  {:>10.4g}  {:>9.2g}  {:>7}  {:>9.2g}  "
            "{:>8.3g}  {}\n",
            row.pick.point, name(row.pick.why), name(row.axisymmetric.outcome), outcome_words(row), row.answer.time,
            row.answer.energy_difference, fmt::format("{},{}", row.answer.largest.n, row.answer.largest.m),
            row.answer.amplitude, row.answer.amplitude / row.answer.noise, name(row.answer.verdict));
    for (const Row& row : rows) {
        if (agrees(row)) continue;
        add(out, "\npoint {}: {}, {}; {}\n", row.pick.point, fmt::join(row.sets, ", "), name(row.answer.verdict),
            row.file);
        add_explanation(out, row);
    }
    const auto agreeing = std::count_if(rows.begin(), rows.end(), agrees);
    add(out, "\n{} of {} points agree\n", agreeing, rows.size());
    return to_string(out);
}

// ---- in numbers

using Numbers = std::vector<std::pair<std::string, double>>;
Numbers numbers(const Row& row) {
    const confirm::Answer& a = row.answer;
    return {{"axisym_time", row.axisymmetric[Measure::time]},
            {"axisym_energy", row.axisymmetric[Measure::energy]},
            {"E_ref", row.axisymmetric[Measure::E_ref]},
            {"time", a.time},
            {"energy_difference", a.energy_difference},
            {"energy_error", a.energy_error},
            {"n", static_cast<double>(a.largest.n)},
            {"m", static_cast<double>(a.largest.m)},
            {"noise", a.noise},
            {"amplitude", a.amplitude},
            {"growth", a.amplitude / a.noise}};
}
std::vector<std::pair<std::string, std::string>> labels(const Row& row) {
    return {{"why", std::string(name(row.pick.why))},
            {"axisym_outcome", std::string(name(row.axisymmetric.outcome))},
            {"outcome", outcome_words(row)},
            {"stop", std::string(name(row.answer.stop))},
            {"verdict", std::string(name(row.answer.verdict))},
            {"file", row.file}};
}

std::string csv(const std::vector<Row>& rows) {
    Text out;
    add(out, "point,set");
    for (const auto& [key, value] : labels(rows.front())) add(out, ",{}", key);
    for (const auto& [key, value] : numbers(rows.front())) add(out, ",{}", key);
    add(out, "\n");
    for (const Row& row : rows) {
        add(out, "{},\"{}\"", row.pick.point, fmt::join(row.sets, " "));
        for (const auto& [key, value] : labels(row)) add(out, ",{}", value);
        for (const auto& [key, value] : numbers(row)) add(out, ",{}", value);
        add(out, "\n");
    }
    return to_string(out);
}

std::string json_text(const ConfirmOptions& options, const std::vector<Row>& rows) {
    Text out;
    add(out,
        "{{\"scan\": {}, \"seed\": {}, \"elements\": {}, \"noise\": "
        "{},\n\"points\": [",
        json(options.scan), options.seed, options.choices.elements, json(options.choices.noise));
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const Row& row = rows[i];
        const std::string words = json(labels(row)), values = json(numbers(row));
        add(out,
            "{}\n{{\"point\": {}, \"set\": {}, \"outcomes\": {}, \"numbers\": {}, "
            "\"rates\": [",
            i > 0 ? "," : "", row.pick.point, json(row.sets), words, values);
        bool first = true;
        for (const confirm::Explanation& one : row.explanations)
            for (const theory::FittingWave& wave : one.waves) {
                add(out,
                    "{}{{\"radius\": {}, \"tension\": {}, \"m\": {}, \"n\": {}, \"q\": "
                    "{}, \"rate\": {}}}",
                    first ? "" : ", ", json(one.radius), json(one.tension), wave.m, wave.n, json(wave.q),
                    json(wave.rate));
                first = false;
            }
        add(out, "]}}");
    }
    add(out, "\n]}}\n");
    return to_string(out);
}

// ---- the whole

void check(const ConfirmOptions& options) {
    const auto refuse = [](const std::string& why) { throw CaseError(why); };
    if (options.points < 1) refuse(fmt::format("--points must be 1 or more, not {}", options.points));
    if (options.choices.elements < 1)
        refuse(fmt::format("--elements must be 1 or more, not {}", options.choices.elements));
    if (!(options.choices.noise > 0 && options.choices.noise < confirm::large_wave))
        refuse(
            fmt::format("--noise must be above 0 and below {}, where a wave "
                        "counts as large, not {}",
                        confirm::large_wave, options.choices.noise));
    if (options.choices.end && !(*options.choices.end > 0))
        refuse(fmt::format("--end must be above 0, not {}", *options.choices.end));
}

int confirm_scan(const ConfirmOptions& options) {
    check(options);
    if (!is_scan(options.scan)) throw CaseError(options.scan + ": is no result of tubule scan");
    const ScanResult result = read_scan_result(options.scan);
    std::vector<Planned> planned = plan(options, result);
    std::filesystem::path folder = options.folder;
    if (folder.empty()) {
        const std::filesystem::path scan = options.scan;
        folder = scan.parent_path() / (scan.stem().string() + "_confirm");
    }
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error) throw CaseError(fmt::format("{}: cannot be made: {}", folder.string(), error.message()));
    std::vector<Row> rows;
    for (Planned& p : planned) {
        if (!options.quiet)
            fmt::print(stderr, "{} of {}: point {}, {}\n", rows.size() + 1, planned.size(), p.row.pick.point,
                       fmt::join(p.row.sets, ", "));
        const int status = run_in_3d(p, folder);
        if (status == exit_code(Stop::interrupted) || status == 2) return status;
        try {
            p.row.answer = confirm::answer(p.c, p.row.axisymmetric, p.waves, read_result(p.row.file));
        } catch (const std::runtime_error&) {  // the run was given up without a result, and has said why
            p.row.answer.outcome = Outcome::failed;
        }
        if (!agrees(p.row)) p.row.explanations = confirm::explain(p.c, p.row.axisymmetric);
        rows.push_back(std::move(p.row));
    }
    const std::string out = options.csv ? csv(rows) : options.json ? json_text(options, rows) : words(rows);
    std::fputs(out.c_str(), stdout);
    return std::all_of(rows.begin(), rows.end(), agrees) ? 0 : disagreement;
}

}  // namespace

void add_confirm(CLI::App& app, int& exit_status) {
    CLI::App* command = app.add_subcommand("confirm",
                                           "Run some points of a scan in three dimensions, from starts "
                                           "that are not quite "
                                           "symmetric: exit status 1 if any comes out differently");
    const auto o = std::make_shared<ConfirmOptions>();
    command->add_option("SCAN", o->scan, "result of tubule scan")->required();
    command->add_option("--points", o->points, "how many (8): both sides of lines, corners of the grid, random ones");
    command->add_option("--seed", o->seed, "of the random choice (1)");
    command->add_option("--elements", o->choices.elements, "about how many triangles (400)");
    command->add_option("--noise", o->choices.noise, "amplitude of the added waves, part of the radius (1e-3)");
    command->add_option("--end", o->choices.end, "run until then instead of time.end of the case");
    command->add_option("-o,--output", o->folder, "folder of the results (default: beside the scan, NAME_confirm)");
    CLI::Option* csv = command->add_flag("--csv", o->csv, "the table, in full precision");
    command->add_flag("--json", o->json, "the table and the rates that explain it")->excludes(csv);
    command->add_flag("--quiet", o->quiet, "no words about the progress");
    command->callback([o, &exit_status] { exit_status = confirm_scan(*o); });
}

}  // namespace tubule
