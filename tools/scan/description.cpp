#include "tools/scan/description.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

#include "common/case/input_file.hpp"
#include "common/case/read.hpp"
#include "common/case/reader.hpp"
#include "common/case/text.hpp"
#include "common/case/toml_input.hpp"
#include "common/result/start_frame.hpp"
#include "common/solve/pause.hpp"
#include "tools/scan/starts.hpp"

namespace tubule {
namespace {

constexpr std::size_t most_points = 1'000'000;  // all are kept in memory
constexpr std::size_t largest_table = 32 * megabyte;
constexpr int most_halvings = 30;

std::string trimmed(const std::string& text) {
    const auto first = text.find_first_not_of(" \t\r"), last = text.find_last_not_of(" \t\r");
    return first == std::string::npos ? "" : text.substr(first, last - first + 1);
}

// At commas outside of quotes and brackets.
std::vector<std::string> split_list(const std::string& text) {
    std::vector<std::string> parts(1);
    int depth = 0;
    char quote = 0;
    for (const char c : text) {
        if (quote)
            quote = c == quote ? 0 : quote;
        else if (c == '"' || c == '\'')
            quote = c;
        depth += !quote && (c == '[' || c == '{') ? 1 : !quote && (c == ']' || c == '}') ? -1 : 0;
        if (c == ',' && depth == 0 && !quote)
            parts.emplace_back();
        else
            parts.back() += c;
    }
    for (std::string& part : parts) part = trimmed(part);
    return parts;
}

// A range as values; nothing if the text is a list.
std::optional<Axis> parse_range(const std::string& text, const std::string& source) {
    if (text.find(':') == text.npos || text.find_first_of("\"'[{") != text.npos) return std::nullopt;
    NumberRange range;
    try {
        range = tubule::parse_range(text, most_points, true);
    } catch (const std::invalid_argument& error) {
        throw CaseError(fmt::format("{}: {}; a range is lo:hi:n, or lo:hi:n:log, n >= 2 values from lo to hi", source,
                                    error.what()));
    }
    Axis axis;
    axis.logarithmic = range.logarithmic;
    for (std::size_t i = 0; i < range.n; ++i) {
        const double part = static_cast<double>(i) / static_cast<double>(range.n - 1);
        const double value = range.logarithmic ? range.lo * std::pow(range.hi / range.lo, part)
                                               : range.lo + (range.hi - range.lo) * part;
        axis.values.push_back({fmt::format("{}", i + 1 == range.n ? range.hi : value)});
    }
    return axis;
}

// ---- scan files

struct ScanFile {
    std::string title, case_path;
    ScanChoices choices;
};

ScanFile read_scan_file(const toml::table& root, const std::string& path) {
    ScanFile file;
    ScanChoices& c = file.choices;
    Complaints complaints;
    Reader::read(root, "", path + ":1:1", complaints, [&](Reader& k) {
        k.text("title", file.title);
        k.text("case", file.case_path);
        k.texts("set", c.sets);
        k.texts("over", c.over);
        k.text("points", c.points);
        k.text("boundary", c.boundary);
        k.integer("seeds", c.seeds, {.from = 1});
        k.integer("refine", c.refine, {.from = 0, .to = most_halvings});
        k.choice("until", c.to_the_end, {{"decided", false}, {"end", true}});
    });
    if (complaints.any()) throw CaseErrors(std::move(complaints.found));
    const std::filesystem::path folder = std::filesystem::path(path).parent_path();
    file.case_path = (folder / file.case_path).string();
    if (!c.points.empty()) c.points = (folder / c.points).string();
    return file;
}

// ---- putting it together

// What messages call a choice: an option of the command, or a key of the scan file.
std::string named(bool by_option, const Scan& scan, const std::string& key) {
    return by_option ? "--" + key + ":" : fmt::format("{}: {}", scan.path, key);
}

BoundaryChoice boundary_of(const Scan& scan, const ScanChoices& file, const ScanChoices& given) {
    const std::string name = given.boundary.empty() ? file.boundary : given.boundary;
    BoundaryChoice choice;
    if (name != "outcome") {
        choice.around = outcome_from_name(name);
        if (!choice.around || choice.around == Outcome::not_run) {
            std::vector<std::string> names = outcome_names();
            names.front() = "outcome";
            throw CaseError(fmt::format("{} must be one of {}, not '{}'{}",
                                        named(!given.boundary.empty(), scan, "boundary"), fmt::join(names, ", "), name,
                                        meant_by(name, names)));
        }
    }
    choice.seeds = given.seeds.value_or(file.seeds.value_or(choice.seeds));
    if (choice.seeds < 1)
        throw CaseError(fmt::format("{} must be an integer >= 1, not {}", named(given.seeds.has_value(), scan, "seeds"),
                                    choice.seeds));
    choice.refine = given.refine.value_or(file.refine.value_or(choice.refine));
    if (choice.refine < 0 || choice.refine > most_halvings)
        throw CaseError(fmt::format("{} must be an integer from 0 to {}, not {}",
                                    named(given.refine.has_value(), scan, "refine"), most_halvings, choice.refine));
    return choice;
}

// There are no values between two words.
void refuse_words_between(const Scan& scan) {
    if (!scan.boundary || scan.boundary->refine == 0) return;
    for (const Axis& axis : scan.axes)
        for (const auto& setting : axis.values)
            if (!number_of(setting.front()))
                throw CaseError(fmt::format("{}: refine needs numbers: {} takes {}", scan.path, axis.keys.front(),
                                            setting.front()));
}

// Lines between kinds of shapes are where their energies are equal, and found as such.
void refuse_refined_starts(const Scan& scan) {
    if (scan.boundary && scan.boundary->refine > 0 && start_axis(scan))
        throw CaseError(
            fmt::format("{}: refine must be absent: from several starts, the places where energies are equal "
                        "are found anyway",
                        scan.path));
}

void refuse_doubled_keys(const Scan& scan) {
    std::set<std::string> keys;
    for (const Axis& axis : scan.axes)
        for (const std::string& key : axis.keys)
            if (!keys.insert(key).second)
                throw CaseError(
                    fmt::format("{0}: {1} varies twice: give all its values at once, such as --over {1}=0,0.1,0.2",
                                scan.path, key));
    for (const std::string& set : scan.sets)
        if (const std::string key = key_of(set); keys.contains(key))
            throw CaseError(fmt::format("{}: --set {}: the scan varies {}", scan.path, set, key));
}

// Words about the keys of an axis, which nobody has --set.
std::string as_over(std::string words, const Axis& axis) {
    bool found = false;
    for (const std::string& key : axis.keys)
        for (std::size_t at; (at = words.find("--set " + key + "=")) != words.npos; found = true)
            words.replace(at, 5, "--over");
    const bool is_number = axis.size() > 1 || number_of(axis.values.front().front());
    return words + (found && !is_number ? "; --over takes a list, 0,0.1,0.2, or a range, lo:hi:n" : "");
}

// Every value of every axis on its own, the other axes at their first.
void check_points(const Scan& scan) {
    std::size_t stride = scan.size();
    for (const Axis& axis : scan.axes) {
        stride /= axis.size();
        for (std::size_t i = 0; i < axis.size(); ++i) {
            check_pause();
            const Case c = [&] {
                try {
                    return scan.case_of(i * stride);
                } catch (const CaseError& error) {
                    throw CaseError(as_over(error.what(), axis));
                }
            }();
            if (c.equilibrium && c.equilibrium->branch.parameter)
                throw CaseError(
                    fmt::format("{}: a point of a scan is one shape: equilibrium.branch must be absent, and "
                                "--over KEY=values varies the same",
                                scan.path));
        }
    }
}

}  // namespace

GridShape Scan::shape() const {
    GridShape shape;
    for (const Axis& axis : axes) shape.push_back(axis.size());
    return shape;
}

BetweenNumbers Scan::between() const {
    return {size(), axes.size(), boundary ? boundary->refine : 0};
}

double Axis::value(std::size_t at, double part) const {
    const double from = number_of(values[at][0]).value(), to = number_of(values[at + 1][0]).value();
    return logarithmic ? from * std::pow(to / from, part) : from + (to - from) * part;
}

double Scan::value(const Between& b) const {
    const double part = static_cast<double>(b.step) / static_cast<double>(between().steps());
    return axes[b.axis].value(place(b.point)[b.axis], part);
}

std::vector<std::string> Scan::sets_of(std::size_t point) const {
    if (point >= size()) {
        const Between b = between().of(point);
        std::vector<std::string> all = sets_of(b.point);
        all[sets.size() + b.axis] = fmt::format("{}={}", axes[b.axis].keys[0], value(b));
        return all;
    }
    std::vector<std::string> all = sets;
    const auto at = place(point);
    for (std::size_t a = 0; a < axes.size(); ++a)
        for (std::size_t k = 0; k < axes[a].keys.size(); ++k)
            all.push_back(axes[a].keys[k] + "=" + axes[a].values[at[a]][k]);
    return all;
}

Case Scan::case_with(const std::vector<std::string>& all_sets) const {
    return parse_case(case_text, all_sets, case_path, inputs);
}

Case Scan::case_of(std::size_t point) const {
    Case c = case_with(sets_of(point));
    if (c.model.kind == ModelKind::automatic)
        throw complaint(c, "model.kind",
                        "must not be \"auto\" in a scan, whose points would have different models; `tubule check` says "
                        "which one does for a case");
    if (c.energy.H0_varies())
        throw complaint_about_H0(c, "must be a number in a scan, which decides by growth rates; run the cases");
    return c;
}

Axis parse_axis(const std::string& over) {
    const std::string source = "--over " + over;
    const std::size_t equals = over.find('=');
    const std::string key = trimmed(over.substr(0, equals));
    if (equals == std::string::npos || key.empty())
        throw CaseError(source + ": must have the form key=values, such as --over energy.k42=0:0.2:5");
    const std::string text = trimmed(over.substr(equals + 1));
    if (text.empty()) throw CaseError(source + ": no values; give some, such as 0,0.1,0.2 or 0:0.2:5");
    Axis axis;
    if (auto range = parse_range(text, source)) {
        axis = *range;
    } else {
        for (const std::string& value : split_list(text)) {
            if (value.empty()) throw CaseError(source + ": a value is missing between two commas");
            axis.values.push_back({value});
        }
    }
    axis.keys = {key};
    return axis;
}

Axis parse_table(const std::string& text, const std::string& path) {
    Axis axis;
    int number = 0;
    for (std::size_t begin = 0, end = 0; begin < text.size(); begin = end + 1) {
        end = std::min(text.find('\n', begin), text.size());
        const std::string line = text.substr(begin, end - begin);
        ++number;
        if (trimmed(line).empty() || trimmed(line).front() == '#') continue;
        const std::vector<std::string> cells = split_list(line);
        if (std::find(cells.begin(), cells.end(), "") != cells.end())
            throw CaseError(fmt::format("{}:{}: an empty cell", path, number));
        if (axis.keys.empty()) {
            axis.keys = cells;
        } else if (cells.size() != axis.keys.size()) {
            throw CaseError(fmt::format("{}:{}: {} values for {} keys", path, number, cells.size(), axis.keys.size()));
        } else {
            axis.values.push_back(cells);
            if (axis.size() > most_points)
                throw CaseError(fmt::format("{}:{}: more than {} points", path, number, most_points));
        }
    }
    if (axis.values.empty()) throw CaseError(fmt::format("{}: no points: a line of keys, then one line a point", path));
    return axis;
}

namespace {

// The command's values replace those of the file for the same key, and are another axis else.
std::vector<Axis> axes_of(const std::vector<std::string>& of_file, const std::vector<std::string>& of_command) {
    std::vector<Axis> axes;
    std::size_t values = 0;
    const auto parsed = [&](const std::string& over) {
        Axis axis = parse_axis(over);
        values += axis.size();
        if (values > 2 * most_points)
            throw CaseError(fmt::format("--over {}: more than {} values in all", over, 2 * most_points));
        return axis;
    };
    for (const std::string& over : of_file) axes.push_back(parsed(over));
    for (const std::string& over : of_command) {
        Axis axis = parsed(over);
        const auto end = axes.begin() + static_cast<std::ptrdiff_t>(of_file.size());
        const auto same = std::find_if(axes.begin(), end, [&](const Axis& a) { return a.keys == axis.keys; });
        if (same != end)
            *same = std::move(axis);
        else
            axes.push_back(std::move(axis));
    }
    return axes;
}

void refuse_no_points_and_too_many(const Scan& scan) {
    if (scan.axes.empty())
        throw CaseError(fmt::format("{}: nothing varies: give --over key=values, or a table by --points", scan.path));
    double size = 1;
    for (const Axis& axis : scan.axes) size *= static_cast<double>(axis.size());
    if (size > static_cast<double>(most_points))
        throw CaseError(fmt::format("{}: {:.3g} points are too many; at most {}", scan.path, size, most_points));
}

}  // namespace

void check_scan(const Scan& scan) {
    refuse_no_points_and_too_many(scan);
    refuse_doubled_keys(scan);
    refuse_refined_starts(scan);
    refuse_words_between(scan);
    check_points(scan);
}

// The file of a shape is one for all points, unless an axis names it.
void add_inputs(Scan& scan) {
    std::vector<std::size_t> points{0};
    std::size_t stride = scan.size();
    for (const Axis& axis : scan.axes) {
        stride /= axis.size();
        if (std::ranges::none_of(axis.keys, [](const std::string& key) {
                return key == "shape.kind" || key == "shape.path" || key == "shape.frame";
            }))
            continue;
        for (std::size_t n = points.size(), i = 0; i < n; ++i)
            for (std::size_t value = 1; value < axis.size(); ++value) points.push_back(points[i] + value * stride);
    }
    for (const std::size_t point : points) {
        const Case c = scan.case_with(scan.sets_of(point));
        if (const std::string changed = changed_input(c, scan.inputs); !changed.empty())
            throw CaseError(
                fmt::format("{}: {}: bring back the file that the scan began with, or scan anew", scan.path, changed));
        const auto known = [&](const auto& input) { return input->name == input_name(c.shape); };
        if (std::ranges::none_of(scan.inputs, known))
            if (auto input = current_input(c)) scan.inputs.push_back(std::move(input));
    }
}

namespace {

// What varies, and the line that is looked for: of the file, where the choices have nothing else.
Scan with_choices(Scan scan, const ScanChoices& file, const ScanChoices& choices) {
    scan.axes = axes_of(file.over, choices.over);
    const std::string points = choices.points.empty() ? file.points : choices.points;
    if (!points.empty()) scan.axes.insert(scan.axes.begin(), parse_table(read_input(points, largest_table), points));
    refuse_no_points_and_too_many(scan);  // before anything is done for each of them

    if (!choices.boundary.empty() || !file.boundary.empty()) {
        if (!points.empty())
            throw CaseError(named(!choices.boundary.empty(), scan, "boundary") +
                            " and points exclude each other: the rows of a table have no neighbours");
        scan.boundary = boundary_of(scan, file, choices);
    } else if (choices.seeds || choices.refine || file.seeds || file.refine) {
        const bool by_option = choices.seeds || choices.refine,
                   seeds = by_option ? choices.seeds.has_value() : file.seeds.has_value();
        throw CaseError(fmt::format("{} must be absent: it is only valid with {}",
                                    named(by_option, scan, seeds ? "seeds" : "refine"),
                                    by_option ? "--boundary" : "boundary"));
    }
    scan.to_the_end = choices.to_the_end || file.to_the_end;
    check_scan(scan);
    add_inputs(scan);
    return scan;
}

}  // namespace

Scan read_scan(const ScanChoices& choices) {
    Scan scan;
    scan.path = choices.file;
    const std::string text = read_input(choices.file, megabyte);
    const toml::table root = parse_toml(text, choices.file);
    ScanFile file;
    if (root.contains("case")) {
        file = read_scan_file(root, choices.file);
        scan.text = text;
        scan.case_path = file.case_path;
        scan.case_text = read_input(file.case_path, megabyte);
    } else if (root.contains("over") || root.contains("points")) {
        throw CaseError(choices.file + ": is a scan without a case: it needs case = \"FILE\"");
    } else {
        scan.case_path = choices.file;
        scan.case_text = text;
    }
    scan.title = file.title;
    scan.sets = file.choices.sets;
    scan.sets.insert(scan.sets.end(), choices.sets.begin(), choices.sets.end());
    return with_choices(std::move(scan), file.choices, choices);
}

Scan scan_of(const Case& c, const ScanChoices& choices) {
    Scan scan;
    scan.path = scan.case_path = c.path, scan.case_text = c.text, scan.sets = c.sets;
    return with_choices(std::move(scan), {}, choices);
}

}  // namespace tubule
