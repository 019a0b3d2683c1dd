// tubule compare A B: two results of any tiers against each other, as a table, CSV, JSON and a picture; the exit status
// says whether they agree within tolerances.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/case/text.hpp"
#include "common/solve/message.hpp"
#include "tools/command/commands.hpp"
#include "tools/command/options.hpp"
#include "tools/command/output.hpp"
#include "tools/command/python.hpp"
#include "tools/compare/results.hpp"
#include "tools/compare/series.hpp"
#include "tools/run/continuation.hpp"
#include "tools/scan/description.hpp"

namespace tubule {

namespace {

using compare::FramePair;
using compare::SeriesDifference;
using compare::ShapeDifference;

constexpr int beyond_tolerance = 1, bad_input = 2;

// What is shown of one result, and what it must keep.
struct Side {
    std::string path;
    std::string stop;  // by name; "unfinished" if the run goes on or was killed
    double stop_time = 0;
    std::optional<double> stated_error;
    std::size_t rows = 0;
    double area_drift = 0, volume_drift = 0;
};

// How far apart they are in one respect: relative, and infinite if they differ in kind.
struct Quantity {
    std::string name;
    double value;
};

struct Check {
    Quantity quantity;
    double most;
    bool holds() const { return quantity.value <= most; }
};

struct Comparison {
    Side a, b;
    bool aligned = false;
    bool energies_of_frames = false;  // frames are compared by number, and all know their energy
    std::vector<SeriesDifference> series;
    std::vector<ShapeDifference> shapes;
    std::vector<Check> checks;
};

[[noreturn]] void refuse(const std::string& words) {
    throw std::invalid_argument(words);
}

// ---- what is asked

// Each quantity with the most that it may be.
std::vector<Quantity> tolerances_of(const CompareOptions& options) {
    std::vector<Quantity> out;
    for (const std::string& text : options.tolerances) {
        const std::size_t equals = text.find('=');
        const auto most = equals == std::string::npos ? std::nullopt : number_of(text.substr(equals + 1));
        if (!most || *most < 0)
            refuse(
                fmt::format("--tolerance {}: must be NAME=VALUE with a value of 0 or more, such as energy=1e-4", text));
        out.push_back({text.substr(0, equals), *most});
    }
    return out;
}

std::size_t frame_number(const std::string& text, const Result& result, const std::string& option) {
    long number = 0;
    const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc() || rest != text.data() + text.size())
        refuse(fmt::format("--frames {}: must be I:J, a frame of A and one of B, such as 3:0 or -1:-1", option));
    try {
        return frame_named(result, number);
    } catch (const std::runtime_error& error) {
        refuse(fmt::format("--frames {}: {}", option, error.what()));
    }
}

std::string frame_times(const Result& result) {
    std::vector<std::string> times;
    for (const Record& frame : result.frames) times.push_back(fmt::format("{:.6g}", frame.time));
    if (times.size() > 8) times.erase(times.begin() + 4, times.end() - 3), times.insert(times.begin() + 4, "...");
    return times.empty() ? "none" : fmt::format("t = {}", fmt::join(times, ", "));
}

std::vector<FramePair> pairs_of(const CompareOptions& options, const Result& a, const Result& b) {
    if (options.no_shapes) return {};
    std::vector<FramePair> out;
    for (const std::string& option : options.frames) {
        const std::vector<std::string> ends = split(option, ':');
        if (ends.size() != 2)
            refuse(fmt::format("--frames {}: must be I:J, a frame of A and one of B, such as 3:0 or -1:-1", option));
        out.emplace_back(frame_number(ends[0], a, option), frame_number(ends[1], b, option));
    }
    if (options.frames.empty()) out = compare::frames_in_common(a, b);
    if (out.empty())
        refuse(
            fmt::format("no frames in common: A has {}; B has {}. Name pairs with --frames I:J, or leave the shapes "
                        "out with --no-shapes",
                        frame_times(a), frame_times(b)));
    return out;
}

// ---- what is found

template <class Value>
double largest(const std::vector<ShapeDifference>& shapes, const Value& value) {
    double most = 0;
    for (const ShapeDifference& shape : shapes) most = std::max(most, value(shape));
    return most;
}

double outcomes_apart(const Side& a, const Side& b) {
    if (a.stop != b.stop) return std::numeric_limits<double>::infinity();
    const double later = std::max(a.stop_time, b.stop_time);
    return later > 0 ? std::abs(a.stop_time - b.stop_time) / later : 0;
}

// All that a tolerance may be set for.
std::vector<Quantity> quantities(const Comparison& c, bool with_shapes) {
    std::vector<Quantity> out;
    for (const SeriesDifference& d : c.series) out.push_back({d.name, d.largest / d.scale});
    if (c.energies_of_frames)
        out.push_back({"energy", largest(c.shapes, [](const ShapeDifference& s) { return *s.energy; })});
    if (with_shapes) {
        out.push_back(
            {"shape", largest(c.shapes, [](const auto& s) { return s.distance.hausdorff / s.distance.size; })});
        out.push_back({"shape_l2", largest(c.shapes, [](const auto& s) { return s.distance.l2 / s.distance.size; })});
    }
    out.push_back({"area_drift", std::max(c.a.area_drift, c.b.area_drift)});
    out.push_back({"volume_drift", std::max(c.a.volume_drift, c.b.volume_drift)});
    out.push_back({"outcome", outcomes_apart(c.a, c.b)});
    return out;
}

void require_known(const std::vector<Quantity>& tolerances, const std::vector<Quantity>& known) {
    std::vector<std::string> names;
    for (const Quantity& quantity : known) names.push_back(quantity.name);
    for (const auto& [name, most] : tolerances) {
        if (std::find(names.begin(), names.end(), name) != names.end()) continue;
        refuse(fmt::format("--tolerance {}: not compared here; it must be one of {}{}", name, fmt::join(names, ", "),
                           meant_by(name, names)));
    }
}

Side side_of(const std::string& name, const Result& result) {
    return {name,
            compare::stop_word(result),
            compare::stop_time(result),
            compare::stated_error(result),
            result.series.at("time").size(),
            compare::drift(result, "area"),
            compare::drift(result, "volume")};
}

Comparison compared(const CompareOptions& options, const Result& a, const Result& b) {
    if (options.no_shapes && (options.align || !options.frames.empty()))
        refuse(fmt::format("{} compares shapes: --no-shapes must be absent", options.align ? "--align" : "--frames"));
    const std::vector<Quantity> tolerances = tolerances_of(options);
    Comparison out;
    out.a = side_of(options.results[0], a), out.b = side_of(options.results[1], b);
    out.aligned = options.align;
    // Pairs of frames that are named say that the times mean nothing to each other.
    if (options.frames.empty()) out.series = compare::compare_series(a, b);
    const std::vector<FramePair> pairs = pairs_of(options, a, b);
    out.energies_of_frames = !options.frames.empty() && std::all_of(pairs.begin(), pairs.end(), [&](const auto& pair) {
        return compare::know_energies(a, b, pair);
    });
    require_known(tolerances, quantities(out, !options.no_shapes));
    for (const FramePair& pair : pairs) out.shapes.push_back(compare::compare_shapes(a, b, pair, options.align));
    const std::vector<Quantity> known = quantities(out, !options.no_shapes);
    for (const auto& [name, most] : tolerances)
        for (const Quantity& quantity : known)
            if (quantity.name == name) out.checks.push_back({quantity, most});
    return out;
}

// ---- output

double turn_of(const compare::RigidMotion& motion) {  // degrees
    const Eigen::Matrix3d& r = motion.rotation;
    const Eigen::Vector3d axis(r(2, 1) - r(1, 2), r(0, 2) - r(2, 0), r(1, 0) - r(0, 1));
    return std::atan2(axis.norm(), r.trace() - 1) * 180 / M_PI;
}

void add_side(Text& out, char letter, const Side& side) {
    add(out, "{}  {}: {} at t = {:.8g}, {} rows", letter, side.path, side.stop, side.stop_time, side.rows);
    if (side.stated_error) add(out, "; estimated error of the energy {:.2g} of E_ref", *side.stated_error);
    add(out, "\n");
}

void add_series(Text& out, const std::vector<SeriesDifference>& series) {
    if (series.empty()) return;
    const SeriesDifference& first = series.front();
    add(out, "\nt = {:.6g} to {:.6g}, {} times with rows of both; differences over `scale`\n", first.times.front(),
        first.times.back(), first.rows_in_both);
    add(out, "{:<20} {:>10} {:>12} {:>10} {:>10} {:>10} {:>10}\n", "series", "largest", "at t", "both rows",
        "at the end", "interpol.", "scale");
    for (const SeriesDifference& d : series)
        add(out, "{:<20} {:>10.3g} {:>12.6g} {:>10.3g} {:>10.3g} {:>10.2g} {:>10.4g}\n", d.name, d.largest / d.scale,
            d.when, d.largest_in_rows / d.scale, d.at_end / d.scale, d.largest_unsure / d.scale, d.scale);
}

void add_shapes(Text& out, const Comparison& c) {
    if (c.shapes.empty()) return;
    add(out, "\n{:>12} {:>4} {:>4} {:>11} {:>11} {:>10} {:>10} {:>10} {:>10}", "t of A", "A", "B", "Hausdorff", "L2",
        "of size", "of size", "size", "energy");
    if (c.aligned) add(out, " {:>32} {:>8}", "centre of B moved by", "turned");
    add(out, "\n");
    for (const ShapeDifference& s : c.shapes) {
        const auto& [hausdorff, l2, where, size] = s.distance;
        add(out, "{:>12.6g} {:>4} {:>4} {:>11.4g} {:>11.4g} {:>10.3g} {:>10.3g} {:>10.5g} {:>10}", s.time,
            s.frames.first, s.frames.second, hausdorff, l2, hausdorff / size, l2 / size, size,
            s.energy ? fmt::format("{:.3g}", *s.energy) : "-");
        if (c.aligned)
            add(out, " {:>32} {:>8.3g}", fmt::format("{:.3g}, {:.3g}, {:.3g}", s.moved[0], s.moved[1], s.moved[2]),
                turn_of(s.motion));
        add(out, "\n");
    }
}

Text words(const Comparison& c) {
    Text out;
    add_side(out, 'A', c.a), add_side(out, 'B', c.b);
    add_series(out, c.series);
    add_shapes(out, c);
    add(out, "\n{:<20} {:>10} {:>10}\n", "largest drift of", "A", "B");
    add(out, "{:<20} {:>10.2g} {:>10.2g}\n", "area", c.a.area_drift, c.b.area_drift);
    add(out, "{:<20} {:>10.2g} {:>10.2g}\n", "volume", c.a.volume_drift, c.b.volume_drift);
    if (c.a.stop != c.b.stop) add(out, "\nthe outcomes differ: {} and {}\n", c.a.stop, c.b.stop);
    if (!c.checks.empty()) add(out, "\n");
    for (const Check& check : c.checks)
        add(out, "{:<20} {:>10.3g} {:<2} {:<8.3g} {}\n", check.quantity.name, check.quantity.value,
            check.holds() ? "<=" : ">", check.most, check.holds() ? "within" : "BEYOND");
    return out;
}

// One line for each series, each frame, each check; `scale` is what `relative` is relative to.
Text csv(const Comparison& c) {
    Text out;
    add(out, "kind,quantity,time,difference,scale,relative,both_rows,at_end,interpolation\n");
    for (const SeriesDifference& d : c.series)
        add(out, "series,{},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g}\n", d.name, d.when, d.largest,
            d.scale, d.largest / d.scale, d.largest_in_rows, d.at_end, d.largest_unsure);
    for (const ShapeDifference& s : c.shapes)
        for (const auto& [name, value] :
             {std::pair{"shape", s.distance.hausdorff}, std::pair{"shape_l2", s.distance.l2}})
            add(out, "frame,{},{:.17g},{:.17g},{:.17g},{:.17g},,,\n", name, s.time, value, s.distance.size,
                value / s.distance.size);
    for (const auto& [name, value] : quantities(c, false))
        if (name.ends_with("_drift") || name == "outcome") add(out, "run,{},,,,{:.17g},,,\n", name, value);
    for (const Check& check : c.checks)
        add(out, "tolerance,{},,,{:.17g},{:.17g},,,\n", check.quantity.name, check.most, check.quantity.value);
    return out;
}

Json json_of(const Side& side) {
    return {{"file", side.path},
            {"stop", side.stop},
            {"stop_time", side.stop_time},
            {"stated_error", or_null(side.stated_error)},
            {"rows", side.rows},
            {"area_drift", side.area_drift},
            {"volume_drift", side.volume_drift}};
}

Json json_of(const SeriesDifference& d) {
    return {{"name", d.name},
            {"scale", d.scale},
            {"largest", d.largest},
            {"when", d.when},
            {"both_rows", d.largest_in_rows},
            {"rows_in_both", d.rows_in_both},
            {"at_end", d.at_end},
            {"interpolation", d.largest_unsure},
            {"times", d.times},
            {"a", d.a},
            {"b", d.b},
            {"unsure", d.unsure}};
}

Json json_of(const ShapeDifference& s) {
    const auto list = [](const auto& v) { return std::vector<double>(v.data(), v.data() + v.size()); };
    const Eigen::Matrix3d rows = s.motion.rotation.transpose();  // Eigen stores columns
    return {{"time", s.time},
            {"frame_a", s.frames.first},
            {"frame_b", s.frames.second},
            {"hausdorff", s.distance.hausdorff},
            {"l2", s.distance.l2},
            {"size", s.distance.size},
            {"where", list(s.distance.where)},
            {"moved", list(s.moved)},
            {"shift", list(s.motion.shift)},
            {"rotation", list(rows)},
            {"energy", or_null(s.energy)}};
}

Json json_of(const Check& check) {
    return {{"quantity", check.quantity.name},
            {"value", check.quantity.value},
            {"tolerance", check.most},
            {"within", check.holds()}};
}

std::string json_text(const Comparison& c) {
    const auto one = [](const auto& item) { return json_of(item); };
    return line_of({{"a", json_of(c.a)},
                    {"b", json_of(c.b)},
                    {"aligned", c.aligned},
                    {"series", json_list(c.series, one)},
                    {"frames", json_list(c.shapes, one)},
                    {"checks", json_list(c.checks, one)}});
}

int run_compare(const CompareOptions& options) {
    Comparison c;
    try {
        c = compared(options, read_result(options.results[0]), read_result(options.results[1]));
    } catch (const std::exception& error) {
        say(stderr, "tubule compare: {}\n", explanation(error));
        return bad_input;
    }
    print_answer(options.json ? json_text(c) : to_string(options.csv ? csv(c) : words(c)));
    if (!options.pictures.empty())
        if (const int status = draw_by_script("compare", "compare", options.pictures, json_text(c))) return status;
    const bool agree = std::all_of(c.checks.begin(), c.checks.end(), [](const Check& check) { return check.holds(); });
    return agree ? 0 : beyond_tolerance;
}

}  // namespace

std::string comparison_json(const CompareOptions& options, const Result& a, const Result& b) {
    return json_text(compared(options, a, b));
}

void add_compare(CLI::App& app, int& exit_status) {
    CLI::App* command = app.add_subcommand("compare", "Compare two results: series, shapes, outcomes");
    const auto o = std::make_shared<CompareOptions>();
    command->add_option("RESULT", o->results, "two result files, A and B, of any tiers")->required()->expected(2);
    command
        ->add_option("--tolerance", o->tolerances,
                     "NAME=VALUE, the largest relative difference of a series, shape, shape_l2, area_drift, "
                     "volume_drift or outcome; exit status 1 if one is larger")
        ->allow_extra_args(false);
    command->add_flag("--no-shapes", o->no_shapes, "do not compare the frames' surfaces");
    command->add_flag("--align", o->align, "first move B rigidly to where it fits best");
    command
        ->add_option("--frames", o->frames,
                     "I:J, compare frame I of A with frame J of B (-1: the last) whatever their times, and no series")
        ->allow_extra_args(false);
    CLI::Option* csv_flag = command->add_flag("--csv", o->csv, "the table as CSV, in full precision");
    command->add_flag("--json", o->json, "all of it as JSON, with the series over time")->excludes(csv_flag);
    command->add_option("--plot", o->pictures, "picture to write, .png, .svg or .pdf; may be repeated")
        ->allow_extra_args(false);
    end_help(*command, {"tubule compare figure.hdf figure.hdf --tolerance energy=1e-4"},
             {{0}, {1, "a difference is beyond its tolerance"}, {2}, {4, "the picture could not be drawn"}},
             {"compare"});
    command->callback([o, &exit_status] { exit_status = run_compare(*o); });
}

}  // namespace tubule
