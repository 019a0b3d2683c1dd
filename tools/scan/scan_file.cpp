#include "tools/scan/scan_file.hpp"

#include <fmt/format.h>
#include <hdf5.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/case/read.hpp"
#include "common/result/about.hpp"
#include "common/result/checksums.hpp"
#include "common/result/hdf5_objects.hpp"
#include "tools/scan/extension.hpp"

namespace tubule {

using namespace h5;

namespace {

namespace fs = std::filesystem;

// ---- writing HDF5

void put_axis(hid_t parent, const std::string& name, const Axis& axis) {
    const auto group = make_group(parent, name);
    put_attribute(group, "keys", axis.keys);
    put_attribute(group, "logarithmic", std::int64_t{axis.logarithmic});
    std::vector<std::string> texts;
    std::vector<double> numbers;
    for (const auto& setting : axis.values)
        for (const std::string& value : setting) {
            texts.push_back(value);
            numbers.push_back(number_of(value).value_or(std::numeric_limits<double>::quiet_NaN()));
        }
    const std::vector<std::size_t> shape{axis.size(), axis.keys.size()};
    put_dataset(group, "texts", texts, shape);
    put_dataset(group, "values", numbers, shape);
}

// Integers whose meaning stands beside them.
void put_named(hid_t parent, const std::string& name, const std::vector<std::size_t>& shape,
               const std::vector<std::int8_t>& values, const std::vector<std::string>& names) {
    put_attribute(put_dataset(parent, name, values, shape), "names", names);
}

void put_points(hid_t file, const ScanResult& result) {
    const auto group = make_group(file, "points");
    const auto shape = result.scan.shape();
    std::vector<std::int8_t> outcomes, stops;
    std::vector<std::string> messages;
    for (const PointResult& p : result.points) {
        outcomes.push_back(static_cast<std::int8_t>(p.outcome));
        stops.push_back(static_cast<std::int8_t>(p.outcome == Outcome::not_run ? -1 : p.stop));
        messages.push_back(p.message);
    }
    put_named(group, "outcome", shape, outcomes, outcome_names());
    put_named(group, "stop", shape, stops, stop_words());
    std::vector<double> column(result.points.size());
    for (std::size_t m = 0; m < n_measures; ++m) {
        for (std::size_t i = 0; i < column.size(); ++i) column[i] = result.points[i].measures[m];
        put_dataset(group, measure_names[m], column, shape);
    }
    put_dataset(group, "message", messages, shape);
}

// Outcomes of the nodes of the grid: those of the least energy, if there are several starts.
std::vector<Outcome> outcomes_of_nodes(const ScanResult& result, const Nodes& nodes) {
    std::vector<Outcome> all;
    for (std::size_t node = 0; node < result.points.size() / nodes.starts(); ++node)
        all.push_back(result.points[nodes.point_of(node, best_start(nodes, node, result.points))].outcome);
    return all;
}

void put_boundary(hid_t file, const ScanResult& result) {
    const auto around = result.scan.boundary ? result.scan.boundary->around : std::nullopt;
    const Nodes nodes(result.scan);
    std::vector<std::int64_t> ends;
    for (const auto& [a, b] : boundary_edges(nodes.shape(), outcomes_of_nodes(result, nodes), around))
        for (const std::size_t node : {a, b}) ends.push_back(static_cast<std::int64_t>(nodes.point_of(node, 0)));
    put_dataset(file, "boundary", ends, {ends.size() / 2, 2});
}

// Where on the edges of /boundary the outcome changes: between two values of what varies along each.
void put_crossings(hid_t file, const ScanResult& result) {
    const auto group = make_group(file, "between");
    std::vector<std::int64_t> numbers;
    std::vector<std::int8_t> outcomes;
    for (const auto& [number, p] : result.more) {
        numbers.push_back(static_cast<std::int64_t>(number));
        outcomes.push_back(static_cast<std::int8_t>(p.outcome));
    }
    put_dataset(group, "point", numbers);
    put_named(group, "outcome", {outcomes.size()}, outcomes, outcome_names());
    const ScanPlan whole = plan_of(result);
    const Plan& plan = whole.nodes();
    std::vector<double> ends;
    for (const Edge& edge : boundary_edges(result.scan.shape(), result.outcomes(), result.scan.boundary->around)) {
        Between at = plan.between(edge, 0);
        const auto [from, to] = plan.crossing(edge);
        for (const std::size_t step : {from, to}) {
            at.step = step;
            ends.push_back(result.scan.value(at));
        }
    }
    put_dataset(file, "crossing", ends, {ends.size() / 2, 2});
}

// Where energies of two kinds of shapes are equal: between two points (those of the first start), the value of what
// varies there. `lowest`: no third kind is lower at the ends.
void put_crossings_of_energy(hid_t file, const ScanResult& result) {
    const Nodes nodes(result.scan);
    std::vector<std::int64_t> numbers, ends, axes;
    std::vector<std::int8_t> kinds, lowest;
    std::vector<double> values, energies;
    for (const auto& [number, p] : result.more) {
        const EnergyCrossing c = crossing_of(result.scan, number);
        numbers.push_back(static_cast<std::int64_t>(number));
        axes.push_back(static_cast<std::int64_t>(c.axis));
        bool is_lowest = true;
        for (const std::size_t node : {c.node, c.node + nodes.stride(c.axis)}) {
            ends.push_back(static_cast<std::int64_t>(nodes.point_of(node, 0)));
            const Outcome best = result.points[nodes.point_of(node, best_start(nodes, node, result.points))].outcome;
            is_lowest = is_lowest && (best == c.kinds[0] || best == c.kinds[1]);
        }
        for (const Outcome kind : c.kinds) kinds.push_back(static_cast<std::int8_t>(kind));
        lowest.push_back(is_lowest);
        values.push_back(p.value);
        energies.push_back(p[Measure::energy]);
    }
    const auto group = make_group(file, "equal_energies");
    put_dataset(group, "number", numbers);
    put_dataset(group, "points", ends, {numbers.size(), 2});
    put_dataset(group, "axis", axes);
    put_named(group, "kinds", {numbers.size(), 2}, kinds, outcome_names());
    put_dataset(group, "lowest", lowest);
    put_dataset(group, "value", values);
    put_dataset(group, "energy", energies);
}

void put_threshold(hid_t parent, const ThresholdMap& map) {
    const auto group = make_group(parent, map.name);
    put_attribute(group, "label", map.label);
    put_dataset(group, "first", map.first);
    put_dataset(group, "second", map.second);
    put_dataset(group, "values", map.values, {map.first.size(), map.second.size()});
}

std::vector<std::byte> image_of(const ScanResult& result, const std::vector<ThresholdMap>& thresholds) {
    const Quiet quiet;
    const auto file = make_image(std::max<std::size_t>(result.points.size() * 256, 1 << 16));
    const Scan& scan = result.scan;
    const auto what = make_group(file, "scan");
    put_dataset(what, "text", scan.text);
    put_attribute(what, "path", scan.path);
    put_attribute(what, "title", scan.title);
    put_attribute(what, "until", std::string(scan.to_the_end ? "end" : "decided"));
    if (scan.boundary) {
        const auto around = scan.boundary->around;
        put_attribute(what, "boundary", around ? std::string(name(*around)) : std::string("outcome"));
        put_attribute(what, "seeds", std::int64_t{scan.boundary->seeds});
        put_attribute(what, "refine", std::int64_t{scan.boundary->refine});
    }
    {
        const auto text = put_dataset(file, "case", scan.case_text);
        put_attribute(text, "path", scan.case_path);
        put_attribute(text, "set", scan.sets);
    }
    put_inputs(file, scan.inputs);
    const auto about = make_group(file, "about");
    for (const auto& [key, value] : result.about)
        std::visit([&, &key = key](const auto& v) { put_attribute(about, key, v); }, value);
    const auto axes = make_group(file, "axes");
    for (std::size_t a = 0; a < scan.axes.size(); ++a) put_axis(axes, std::to_string(a), scan.axes[a]);
    put_points(file, result);
    put_boundary(file, result);
    if (scan.boundary && scan.boundary->refine > 0) put_crossings(file, result);
    if (const auto starts = start_axis(scan)) {
        put_attribute(what, "start_axis", static_cast<std::int64_t>(*starts));
        put_crossings_of_energy(file, result);
    }
    const auto lines = make_group(file, "thresholds");
    for (const ThresholdMap& map : thresholds) put_threshold(lines, map);
    auto bytes = bytes_of(file);
    seal(bytes);
    return bytes;
}

// ---- reading HDF5

Axis get_axis(hid_t parent, const std::string& name) {
    const auto group = open_group(parent, name);
    Axis axis;
    axis.keys = get_texts(group, "keys");
    axis.logarithmic = get_number<std::int64_t>(group, "logarithmic") != 0;
    const auto texts = get_text_array(group, "texts");
    for (std::size_t i = 0; i + axis.keys.size() <= texts.size(); i += axis.keys.size())
        axis.values.emplace_back(texts.begin() + static_cast<std::ptrdiff_t>(i),
                                 texts.begin() + static_cast<std::ptrdiff_t>(i + axis.keys.size()));
    return axis;
}

Scan get_scan(hid_t file) {
    Scan scan;
    const auto what = open_group(file, "scan");
    scan.text = get_text_dataset(what, "text");
    scan.path = get_text(what, "path");
    scan.title = get_text(what, "title");
    scan.to_the_end = get_text(what, "until") == "end";
    if (H5Aexists(what, "boundary") > 0) {
        scan.boundary.emplace();
        scan.boundary->around = outcome_from_name(get_text(what, "boundary"));
        scan.boundary->seeds = static_cast<int>(get_number<std::int64_t>(what, "seeds"));
        scan.boundary->refine = static_cast<int>(get_number<std::int64_t>(what, "refine"));
    }
    scan.case_text = get_text_dataset(file, "case");
    const Handle text(H5Dopen2(file, "case", H5P_DEFAULT), H5Dclose, "open", "case");
    scan.case_path = get_text(text, "path");
    scan.sets = get_texts(text, "set");
    scan.inputs = get_inputs(file);
    const auto axes = open_group(file, "axes");
    for (const std::string& axis : member_names(axes)) scan.axes.push_back(get_axis(axes, axis));
    return scan;
}

std::vector<PointResult> get_points(hid_t file, std::size_t count) {
    const auto group = open_group(file, "points");
    const auto outcomes = get_integers(group, "outcome"), stops = get_integers(group, "stop");
    const auto messages = get_text_array(group, "message");
    std::vector<PointResult> points = unknown_points(count);
    if (outcomes.size() != count || stops.size() != count || messages.size() != count)
        throw std::runtime_error("/points does not have the shape of /axes");
    for (std::size_t i = 0; i < count; ++i) {
        if (outcomes[i] < 0 || outcomes[i] >= n_outcomes)
            throw std::runtime_error("/points/outcome holds an unknown outcome");
        points[i].outcome = static_cast<Outcome>(outcomes[i]);
        points[i].stop = static_cast<int>(stops[i]);
        points[i].message = messages[i];
    }
    for (std::size_t m = 0; m < n_measures; ++m) {
        if (!has(group, measure_names[m])) continue;  // of an earlier version
        const auto column = get_array(group, measure_names[m]).data;
        if (column.size() != count) throw std::runtime_error("/points does not have the shape of /axes");
        for (std::size_t i = 0; i < count; ++i) points[i].measures[m] = column[i];
    }
    return points;
}

// Points between those of the grid keep only the outcome, crossings only value and energy.
std::map<std::size_t, PointResult> get_more(hid_t file) {
    std::map<std::size_t, PointResult> out;
    const bool crossings = has(file, "equal_energies");
    if (!crossings && !has(file, "between")) return out;
    const auto group = open_group(file, crossings ? "equal_energies" : "between");
    const auto numbers = get_integers(group, crossings ? "number" : "point");
    const auto first = get_array(group, crossings ? "value" : "outcome").data,
               energies = crossings ? get_array(group, "energy").data : first;
    for (std::size_t i = 0; i < std::min({numbers.size(), first.size(), energies.size()}); ++i) {
        PointResult p = unknown_point(static_cast<std::size_t>(numbers[i]));
        if (crossings) {
            p.value = first[i], p[Measure::energy] = energies[i];
            p.outcome = std::isnan(p.value) ? Outcome::failed : Outcome::undecided;
        } else {
            p.outcome = static_cast<Outcome>(first[i]);
        }
        out[p.point] = p;
    }
    return out;
}

ScanResult read_file(const fs::path& path) {
    const Quiet quiet;
    const auto file = open_file(path);
    if (!has(file, "scan") || !has(file, "points")) throw std::runtime_error("not a scan of tubule: it has no /scan");
    ScanResult result;
    result.scan = get_scan(file);
    const auto about = open_group(file, "about");
    for (const std::string& key : attribute_names(about)) result.about.emplace_back(key, get_value(about, key));
    result.points = get_points(file, result.scan.size());
    result.more = get_more(file);
    return result;
}

ScanResult load(const fs::path& path) {
    try {
        return read_file(path);
    } catch (const std::exception& error) {
        throw std::runtime_error(fmt::format("{}: {}", path.string(), error.what()));
    }
}

}  // namespace

std::string other_input(const Scan& a, const Scan& b) {
    for (const auto& x : a.inputs)
        for (const auto& y : b.inputs)
            if (x->name == y->name && !same_input(*x, *y)) return x->name;
    return "";
}

bool same_scan(const Scan& a, const Scan& b) {
    const auto same_axis = [](const Axis& x, const Axis& y) { return x.keys == y.keys && x.values == y.values; };
    return other_input(a, b).empty() && a.case_text == b.case_text && a.sets == b.sets &&
           a.to_the_end == b.to_the_end && a.boundary == b.boundary &&
           std::equal(a.axes.begin(), a.axes.end(), b.axes.begin(), b.axes.end(), same_axis);
}

void refuse_to_replace_another_scan(const Scan& scan, const fs::path& file) {
    if (!is_scan(file)) return;
    try {
        if (same_scan(read_scan_result(file).scan, scan)) return;
    } catch (const std::runtime_error&) {
        return;  // damaged: nothing of it can be used as it is
    }
    throw CaseError(fmt::format(
        "{}: holds another scan than that of {}\n--overwrite replaces it, -o FILE keeps both, --extend adds "
        "values to it",
        file.string(), scan.path));
}

std::vector<Outcome> ScanResult::outcomes() const {
    std::vector<Outcome> all;
    for (const PointResult& p : points) all.push_back(p.outcome);
    return all;
}

const PointResult* ScanResult::known(std::size_t number) const {
    if (number < points.size()) return points[number].outcome == Outcome::not_run ? nullptr : &points[number];
    const auto found = more.find(number);
    return found == more.end() ? nullptr : &found->second;
}

ScanPlan plan_of(const ScanResult& result) {
    ScanPlan plan(result.scan);
    for (const PointResult& p : result.points)
        if (p.outcome != Outcome::not_run) plan.done(p);
    for (const auto& [number, p] : result.more) plan.done(p);
    return plan;
}

ScanWriter::ScanWriter(const fs::path& path, ScanResult result) : file_(path), result_(std::move(result)) {}

// Closes the file of a scan that ended by an exception; if the disk is the reason, nothing more can be done.
ScanWriter::~ScanWriter() {
    try {
        if (unwritten_) write();
    } catch (const std::exception&) {
    }
}

void ScanWriter::write(const std::vector<ThresholdMap>& thresholds) {
    file_.write([&] { return image_of(result_, thresholds); });
    began_ = true;
    unwritten_ = false;
}

ScanWriter ScanWriter::create(const fs::path& file, const Scan& scan, const About& about,
                              std::vector<PointResult> known) {
    const auto path = fs::weakly_canonical(file);
    if (fs::exists(path) && !is_scan(path))
        throw std::runtime_error(
            fmt::format("{}: is not a scan\nit was not replaced, since it may be needed: remove it first, or choose "
                        "another file with -o",
                        path.string()));
    return {path, {scan, about, known.empty() ? unknown_points(scan.size()) : std::move(known), {}}};
}

ScanWriter ScanWriter::resume(const fs::path& file, const Scan& scan) {
    const auto path = fs::weakly_canonical(file);
    ScanResult result = load(path);
    add_inputs(result.scan);
    if (!same_scan(result.scan, scan))
        throw CaseError(
            fmt::format("{}: cannot be resumed with {}: it belongs to another scan, case, --set or --over; "
                        "--extend --over adds values to a result, -o names another one, --overwrite replaces it",
                        file.string(), scan.path));
    std::erase_if(result.about,
                  [](const auto& entry) { return entry.first == "stop" && entry.second != Value("finished"); });
    return {path, std::move(result)};
}

bool ScanWriter::complete() const {
    const auto* stop = find_value<std::string>(result_.about, "stop");
    return stop && *stop == "finished";
}

void ScanWriter::point(const PointResult& p) {
    (p.point < result_.points.size() ? result_.points[p.point] : result_.more[p.point]) = p;
    unwritten_ = true;
    if (!began_ || file_.due()) write();
}

void ScanWriter::finish(const About& more) {
    update(result_.about, more);
    drop_unwanted(result_);
    write(threshold_maps(result_.scan));
    file_.release();
}

bool is_scan(const fs::path& file) {
    const Quiet quiet;
    try {
        std::error_code none;
        return fs::is_regular_file(file, none) && has(open_file(file), "scan");
    } catch (const std::runtime_error&) {
        return false;
    }
}

ScanResult read_scan_result(const fs::path& file) {
    return load(file);
}

}  // namespace tubule
