#include "tools/scan/scan_file.hpp"

#include <fmt/format.h>
#include <hdf5.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/case/read.hpp"
#include "common/result/checksums.hpp"
#include "common/result/file_writer.hpp"
#include "common/result/hdf5_objects.hpp"
#include "tools/scan/extension.hpp"
#include "tools/scan/theory.hpp"

namespace tubule {

using namespace h5;

namespace {

namespace fs = std::filesystem;

struct Stored {
    ScanResult result;
    std::vector<ThresholdMap> thresholds;  // told at the end
};

// ---- writing HDF5

void put_text(hid_t parent, const std::string& name, const std::string& text) {
    const char* data = text.c_str();
    put_dataset(parent, name, text_type(), scalar(), &data);
}

void put_texts(hid_t parent, const std::string& name, const std::vector<std::size_t>& shape,
               const std::vector<std::string>& texts) {
    std::vector<const char*> data;
    for (const std::string& text : texts) data.push_back(text.c_str());
    put_dataset(parent, name, text_type(), space(shape), data.data());
}

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
    put_texts(group, "texts", shape, texts);
    put_dataset(group, "values", H5T_NATIVE_DOUBLE, space(shape), numbers.data());
}

// Integers whose meaning stands beside them.
void put_named(hid_t parent, const std::string& name, const std::vector<std::size_t>& shape,
               const std::vector<std::int8_t>& values, const std::vector<std::string>& names) {
    put_attribute(put_dataset(parent, name, H5T_NATIVE_INT8, space(shape), values.data()), "names", names);
}

void put_points(hid_t file, const ScanResult& result) {
    const auto group = make_group(file, "points");
    const auto shape = result.shape();
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
        put_dataset(group, measure_names[m], H5T_NATIVE_DOUBLE, space(shape), column.data());
    }
    put_texts(group, "message", shape, messages);
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
    put_dataset(file, "boundary", H5T_NATIVE_INT64, space({ends.size() / 2, 2}), ends.data());
}

// Where on the edges of /boundary the outcome changes: between two values of what varies along each.
void put_crossings(hid_t file, const ScanResult& result) {
    const auto group = make_group(file, "between");
    std::vector<std::int64_t> numbers;
    std::vector<std::int8_t> outcomes;
    for (const auto& [number, outcome] : result.between) {
        numbers.push_back(static_cast<std::int64_t>(number));
        outcomes.push_back(static_cast<std::int8_t>(outcome));
    }
    put_dataset(group, "point", H5T_NATIVE_INT64, space({numbers.size()}), numbers.data());
    put_named(group, "outcome", {outcomes.size()}, outcomes, outcome_names());
    const ScanPlan whole = plan_of(result);
    const Plan& plan = whole.nodes();
    std::vector<double> ends;
    for (const Edge& edge : boundary_edges(result.shape(), result.outcomes(), result.scan.boundary->around)) {
        Between at = plan.between(edge, 0);
        const auto [from, to] = plan.crossing(edge);
        for (const std::size_t step : {from, to}) {
            at.step = step;
            ends.push_back(result.scan.value(at));
        }
    }
    put_dataset(file, "crossing", H5T_NATIVE_DOUBLE, space({ends.size() / 2, 2}), ends.data());
}

// Where energies of two kinds of shapes are equal: between two points (those of the first start), the value of what
// varies there. `lowest`: no third kind is lower at the ends.
void put_crossings_of_energy(hid_t file, const ScanResult& result) {
    const Nodes nodes(result.scan);
    std::vector<std::int64_t> numbers, ends, axes;
    std::vector<std::int8_t> kinds, lowest;
    std::vector<double> values, energies;
    for (const auto& [number, p] : result.crossings) {
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
    const std::size_t n = numbers.size();
    put_dataset(group, "number", H5T_NATIVE_INT64, space({n}), numbers.data());
    put_dataset(group, "points", H5T_NATIVE_INT64, space({n, 2}), ends.data());
    put_dataset(group, "axis", H5T_NATIVE_INT64, space({n}), axes.data());
    put_named(group, "kinds", {n, 2}, kinds, outcome_names());
    put_dataset(group, "lowest", H5T_NATIVE_INT8, space({n}), lowest.data());
    put_dataset(group, "value", H5T_NATIVE_DOUBLE, space({n}), values.data());
    put_dataset(group, "energy", H5T_NATIVE_DOUBLE, space({n}), energies.data());
}

std::map<std::size_t, PointResult> get_crossings_of_energy(hid_t file) {
    const auto group = open_group(file, "equal_energies");
    const auto numbers = get_integers(group, "number");
    const auto values = get_array(group, "value").data, energies = get_array(group, "energy").data;
    std::map<std::size_t, PointResult> out;
    for (std::size_t i = 0; i < std::min({numbers.size(), values.size(), energies.size()}); ++i) {
        PointResult p = unknown_point(static_cast<std::size_t>(numbers[i]));
        p.value = values[i], p[Measure::energy] = energies[i];
        p.outcome = std::isnan(p.value) ? Outcome::failed : Outcome::undecided;
        out[p.point] = p;
    }
    return out;
}

void put_threshold(hid_t parent, const ThresholdMap& map) {
    const auto group = make_group(parent, map.name);
    put_attribute(group, "label", map.label);
    put_dataset(group, "first", H5T_NATIVE_DOUBLE, space({map.first.size()}), map.first.data());
    put_dataset(group, "second", H5T_NATIVE_DOUBLE, space({map.second.size()}), map.second.data());
    put_dataset(group, "values", H5T_NATIVE_DOUBLE, space({map.first.size(), map.second.size()}), map.values.data());
}

std::vector<std::byte> image_of(const Stored& stored) {
    const Quiet quiet;
    const ScanResult& result = stored.result;
    const auto file = make_image(std::max<std::size_t>(result.points.size() * 256, 1 << 16));
    const Scan& scan = result.scan;
    const auto what = make_group(file, "scan");
    put_text(what, "text", scan.text);
    put_attribute(what, "path", scan.path);
    put_attribute(what, "title", scan.title);
    put_attribute(what, "until", std::string(scan.to_the_end ? "end" : "decided"));
    if (scan.boundary) {
        const auto around = scan.boundary->around;
        put_attribute(what, "boundary", around ? std::string(name(*around)) : std::string("outcome"));
        put_attribute(what, "seeds", std::int64_t{scan.boundary->seeds});
        put_attribute(what, "refine", std::int64_t{scan.boundary->refine});
    }
    put_text(file, "case", scan.case_text);
    put_inputs(file, scan.inputs);
    {
        const Handle text(H5Dopen2(file, "case", H5P_DEFAULT), H5Dclose, "open", "case");
        put_attribute(text, "path", scan.case_path);
        put_attribute(text, "set", scan.sets);
    }
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
    for (const ThresholdMap& map : stored.thresholds) put_threshold(lines, map);
    auto bytes = bytes_of(file);
    seal(bytes);
    return bytes;
}

// ---- reading HDF5

std::vector<std::string> get_text_array(hid_t parent, const std::string& name) {
    const Handle dataset(H5Dopen2(parent, name.c_str(), H5P_DEFAULT), H5Dclose, "open dataset", name);
    const Handle extent(H5Dget_space(dataset), H5Sclose, "read", name);
    const Handle type = text_type();
    std::vector<char*> data(static_cast<std::size_t>(H5Sget_simple_extent_npoints(extent)));
    require(H5Dread(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data.data()) >= 0, "read", name);
    std::vector<std::string> texts;
    for (const char* text : data) texts.emplace_back(text ? text : "");
    H5Dvlen_reclaim(type, extent, H5P_DEFAULT, data.data());
    return texts;
}

std::string get_text(hid_t object, const std::string& name) {
    return get_texts(open_attribute(object, name), name).at(0);
}

std::uint64_t get_count(hid_t object, const std::string& name) {
    return get_attribute<std::uint64_t>(open_attribute(object, name), H5T_NATIVE_UINT64, name);
}

Axis get_axis(hid_t parent, const std::string& name) {
    const auto group = open_group(parent, name);
    Axis axis;
    axis.keys = get_texts(open_attribute(group, "keys"), "keys");
    axis.logarithmic = get_count(group, "logarithmic") != 0;
    const auto texts = get_text_array(group, "texts");
    for (std::size_t i = 0; i + axis.keys.size() <= texts.size(); i += axis.keys.size())
        axis.values.emplace_back(texts.begin() + static_cast<std::ptrdiff_t>(i),
                                 texts.begin() + static_cast<std::ptrdiff_t>(i + axis.keys.size()));
    return axis;
}

Scan get_scan(hid_t file) {
    Scan scan;
    const auto what = open_group(file, "scan");
    scan.text = get_text_array(what, "text").at(0);
    scan.path = get_text(what, "path");
    scan.title = get_text(what, "title");
    scan.to_the_end = get_text(what, "until") == "end";
    if (H5Aexists(what, "boundary") > 0) {
        scan.boundary.emplace();
        scan.boundary->around = outcome_from_name(get_text(what, "boundary"));
        scan.boundary->seeds = static_cast<int>(get_count(what, "seeds"));
        scan.boundary->refine = static_cast<int>(get_count(what, "refine"));
    }
    scan.case_text = get_text_array(file, "case").at(0);
    const Handle text(H5Dopen2(file, "case", H5P_DEFAULT), H5Dclose, "open", "case");
    scan.case_path = get_text(text, "path");
    scan.sets = get_texts(open_attribute(text, "set"), "set");
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

std::map<std::size_t, Outcome> get_between(hid_t file) {
    const auto group = open_group(file, "between");
    const auto numbers = get_integers(group, "point"), outcomes = get_integers(group, "outcome");
    std::map<std::size_t, Outcome> between;
    for (std::size_t i = 0; i < std::min(numbers.size(), outcomes.size()); ++i)
        between[static_cast<std::size_t>(numbers[i])] = static_cast<Outcome>(outcomes[i]);
    return between;
}

Stored read_file(const fs::path& path) {
    const Quiet quiet;
    const auto file = open_file(path);
    if (!has(file, "scan") || !has(file, "points")) throw std::runtime_error("not a scan of tubule: it has no /scan");
    Stored stored;
    stored.result.scan = get_scan(file);
    const auto about = open_group(file, "about");
    for (const std::string& key : attribute_names(about))
        stored.result.about.emplace_back(key, get_value(open_attribute(about, key), key));
    stored.result.points = get_points(file, stored.result.scan.size());
    if (has(file, "equal_energies")) stored.result.crossings = get_crossings_of_energy(file);
    if (has(file, "between")) stored.result.between = get_between(file);
    return stored;
}

void keep(ScanResult& result, const PointResult& p) {
    if (p.point < result.points.size())
        result.points[p.point] = p;
    else if (result.scan.boundary && result.scan.boundary->refine > 0)
        result.between[p.point] = p.outcome;
    else
        result.crossings[p.point] = p;
}

Stored load(const fs::path& path) {
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

std::vector<std::size_t> ScanResult::shape() const {
    std::vector<std::size_t> shape;
    for (const Axis& axis : scan.axes) shape.push_back(axis.size());
    return shape;
}

std::vector<Outcome> ScanResult::outcomes() const {
    std::vector<Outcome> all;
    for (const PointResult& p : points) all.push_back(p.outcome);
    return all;
}

ScanPlan plan_of(const ScanResult& result) {
    ScanPlan plan(result.scan);
    for (const PointResult& p : result.points)
        if (p.outcome != Outcome::not_run) plan.done(p);
    for (const auto& [number, outcome] : result.between) {
        PointResult p = unknown_point(number);
        p.outcome = outcome;
        plan.done(p);
    }
    for (const auto& [number, crossing] : result.crossings) plan.done(crossing);
    return plan;
}

struct ScanWriter::Impl {
    explicit Impl(const fs::path& path) : file(path) {}
    // A scan that ended by an exception; if the disk is the reason, nothing more can be done.
    ~Impl() {
        try {
            if (unwritten) write();
        } catch (const std::exception&) {
        }
    }

    FileWriter file;
    Stored stored;
    bool complete = false;
    bool began = false;      // the file is this writer's
    bool unwritten = false;  // it lacks a point

    void write() {
        file.write([this] { return image_of(stored); });
        began = true;
        unwritten = false;
    }
};

ScanWriter::ScanWriter(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
ScanWriter::ScanWriter(ScanWriter&&) noexcept = default;
ScanWriter::~ScanWriter() = default;

ScanWriter ScanWriter::create(const fs::path& file, const Scan& scan, const About& about) {
    const auto path = fs::weakly_canonical(file);
    if (fs::exists(path) && !is_scan(path))
        throw std::runtime_error(
            fmt::format("{}: is not a scan\nit was not replaced, since it may be needed: remove it first, or choose "
                        "another file with -o",
                        path.string()));
    auto impl = std::make_unique<Impl>(path);
    ScanResult& result = impl->stored.result;
    result.scan = scan;
    result.about = about;
    result.points = unknown_points(scan.size());
    return ScanWriter(std::move(impl));
}

ScanWriter ScanWriter::extend(const fs::path& file, const ScanResult& known, const About& about) {
    ScanWriter writer = create(file, known.scan, about);
    writer.impl_->stored.result.points = known.points;
    return writer;
}

ScanWriter ScanWriter::resume(const fs::path& file, const Scan& scan) {
    const auto path = fs::weakly_canonical(file);
    refuse_old_journal(path);
    auto impl = std::make_unique<Impl>(path);
    impl->stored = load(path);
    add_inputs(impl->stored.result.scan);
    if (!same_scan(impl->stored.result.scan, scan))
        throw CaseError(
            fmt::format("{}: cannot be resumed with {}: it belongs to another scan, case, --set or --over; "
                        "--extend --over adds values to a result, -o names another one, --overwrite replaces it",
                        file.string(), scan.path));
    for (const auto& [key, value] : impl->stored.result.about)
        if (key == "stop") impl->complete = std::get<std::string>(value) == "finished";
    if (!impl->complete)
        std::erase_if(impl->stored.result.about, [](const auto& entry) { return entry.first == "stop"; });
    return ScanWriter(std::move(impl));
}

const ScanResult& ScanWriter::result() const {
    return impl_->stored.result;
}

bool ScanWriter::complete() const {
    return impl_->complete;
}

bool ScanWriter::began() const {
    return impl_->began;
}

void ScanWriter::point(const PointResult& p) {
    keep(impl_->stored.result, p);
    impl_->unwritten = true;
    if (!impl_->began || impl_->file.due()) impl_->write();
}

void ScanWriter::finish(const About& more) {
    About& about = impl_->stored.result.about;
    for (const auto& [key, value] : more) {
        const auto same = std::find_if(about.begin(), about.end(), [&](const auto& old) { return old.first == key; });
        if (same != about.end())
            same->second = value;
        else
            about.emplace_back(key, value);
    }
    drop_unwanted(impl_->stored.result);
    impl_->stored.thresholds = threshold_maps(impl_->stored.result.scan);
    impl_->write();
    impl_->file.release();
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
    warn_of_old_journal(file);
    return load(file).result;
}

}  // namespace tubule
