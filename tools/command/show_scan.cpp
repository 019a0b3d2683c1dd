#include "tools/command/show_scan.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <string_view>
#include <vector>

#include "common/result/about.hpp"
#include "tools/command/output.hpp"
#include "tools/scan/plan.hpp"
#include "tools/scan/scan_file.hpp"

namespace tubule {

namespace {

// One letter an outcome, for maps in a terminal.
constexpr std::string_view letters = " UWSCPOIXF?losp";
static_assert(letters.size() == n_outcomes);

std::string ends_of(const Axis& axis) {
    return fmt::format("{} to {}, {} values{}", fmt::join(axis.values.front(), ", "),
                       fmt::join(axis.values.back(), ", "), axis.size(), axis.logarithmic ? ", logarithmic" : "");
}

// The first axis to the right, the second upwards; of several starts the shape of least energy. Nothing for other
// numbers of axes.
void add_map(std::string& out, const ScanResult& result) {
    const Nodes nodes(result.scan);
    const auto starts = start_axis(result.scan);
    std::vector<const Axis*> axes;
    for (std::size_t a = 0; a < result.scan.axes.size(); ++a)
        if (a != starts) axes.push_back(&result.scan.axes[a]);
    if (axes.size() != 2 || axes[0]->size() > 160) return;
    add(out, "\nright: {}; up: {}{}\n", axes[0]->keys.front(), axes[1]->keys.front(),
        starts ? "; the shapes of least energy, v where a vesiculated limit is lower" : "");
    for (std::size_t j = axes[1]->size(); j-- > 0;) {
        add(out, "    ");
        for (std::size_t i = 0; i < axes[0]->size(); ++i) {
            const std::size_t node = i * axes[1]->size() + j, start = best_start(nodes, node, result.points);
            const PointResult& best = result.points[nodes.point_of(node, start)];
            const bool vesiculated = starts && best[Measure::limit_energy] < best[Measure::free_energy];
            out += vesiculated ? 'v' : letters[static_cast<std::size_t>(best.outcome)];
        }
        add(out, "\n");
    }
}

// Where energies of two kinds are equal.
Json equal_energies(const ScanResult& result) {
    const Nodes nodes(result.scan);
    Json out = Json::array();
    for (const auto& [number, p] : result.more) {
        const EnergyCrossing c = crossing_of(result.scan, number);
        out.push_back({{"points", {nodes.point_of(c.node, 0), nodes.point_of(c.node + nodes.stride(c.axis), 0)}},
                       {"key", result.scan.axes[c.axis].keys.front()},
                       {"value", p.value},
                       {"kinds", {name(c.kinds[0]), name(c.kinds[1])}},
                       {"energy", p[Measure::energy]}});
    }
    return out;
}

// ---- CSV and JSON

std::string stop_of(const PointResult& p) {
    return p.outcome == Outcome::not_run ? "" : stop_words()[static_cast<std::size_t>(p.stop)];
}

// The keys of a point and their values, in the order of the axes.
std::vector<std::pair<std::string, std::string>> keys_of(const Scan& scan, std::size_t point) {
    std::vector<std::pair<std::string, std::string>> keys;
    const auto at = scan.place(point);
    for (std::size_t a = 0; a < scan.axes.size(); ++a)
        for (std::size_t k = 0; k < scan.axes[a].keys.size(); ++k)
            keys.emplace_back(scan.axes[a].keys[k], scan.axes[a].values[at[a]][k]);
    return keys;
}

}  // namespace

std::string scan_summary(const std::filesystem::path& file) {
    const ScanResult result = read_scan_result(file);
    const Scan& scan = result.scan;
    std::string out;
    const auto line = [&](std::string_view name, const std::string& value) { add(out, "{:<18} {}\n", name, value); };
    line("file", file.string());
    if (!scan.title.empty()) line("title", scan.title);
    line("case", scan.case_path);
    if (!scan.sets.empty()) line("set", fmt::format("{}", fmt::join(scan.sets, "  ")));
    for (const Axis& axis : scan.axes) line(fmt::format("{}", fmt::join(axis.keys, ", ")), ends_of(axis));
    if (scan.boundary) line("boundary", scan.boundary->around ? std::string(name(*scan.boundary->around)) : "outcome");
    if (scan.boundary && scan.boundary->refine > 0) line("refine", fmt::format("{}", scan.boundary->refine));
    for (const auto& [key, value] : result.about) line(key, text_of(value));
    if (!find_value<std::string>(result.about, "stop"))
        line("stop", "none yet: the scan is still going, or was killed");
    std::array<std::size_t, n_outcomes> counts{};
    for (const PointResult& p : result.points) ++counts[static_cast<std::size_t>(p.outcome)];
    add(out, "\n{:>10}     outcome\n", "points");
    for (std::size_t i = 0; i < counts.size(); ++i)
        if (counts[i] > 0) add(out, "{:>10}  {}  {}\n", counts[i], letters[i], name(static_cast<Outcome>(i)));
    add_map(out, result);
    return out;
}

std::string scan_csv(const std::filesystem::path& file) {
    const ScanResult result = read_scan_result(file);
    std::string out = "point";
    for (const auto& [key, value] : keys_of(result.scan, 0)) add(out, ",{}", key);
    add(out, ",outcome,stop,{},message\n", fmt::join(measure_names, ","));
    for (const PointResult& p : result.points) {
        if (p.outcome == Outcome::not_run) continue;
        add(out, "{}", p.point);
        for (const auto& [key, value] : keys_of(result.scan, p.point))
            add(out, ",{}", value.find_first_of(",\"") == std::string::npos ? value : quoted(value));
        add(out, ",{},{}", name(p.outcome), stop_of(p));
        for (const double value : p.measures) add(out, ",{}", value);
        add(out, ",{}\n", quoted(p.message));
    }
    return out;
}

std::string scan_json(const std::filesystem::path& file) {
    const ScanResult result = read_scan_result(file);
    const Scan& scan = result.scan;
    Json points = Json::array();
    for (const PointResult& p : result.points) {
        if (p.outcome == Outcome::not_run) continue;
        Json one{{"point", p.point},
                 {"set", json_object(keys_of(scan, p.point))},
                 {"outcome", name(p.outcome)},
                 {"stop", stop_of(p)}};
        for (std::size_t m = 0; m < n_measures; ++m) one[measure_names[m]] = p.measures[m];
        one["message"] = p.message;
        points.push_back(std::move(one));
    }
    Json out{{"case", {{"path", scan.case_path}, {"text", scan.case_text}, {"set", scan.sets}}},
             {"scan", {{"path", scan.path}, {"title", scan.title}, {"text", scan.text}}},
             {"about", json_object(result.about)},
             {"points", points}};
    if (start_axis(scan)) out["equal_energies"] = equal_energies(result);
    return line_of(out);
}

}  // namespace tubule
