#include "tools/scan/extension.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "common/case/read.hpp"
#include "common/solve/pause.hpp"
#include "tools/run/continuation.hpp"
#include "tools/scan/scan_plan.hpp"

namespace tubule {
namespace {

const Axis* axis_of(const Scan& scan, const std::vector<std::string>& keys) {
    const auto same = std::ranges::find_if(scan.axes, [&](const Axis& axis) { return axis.keys == keys; });
    return same == scan.axes.end() ? nullptr : &*same;
}

// Words are compared as such, numbers by their value.
std::vector<std::string> comparable(std::vector<std::string> setting) {
    for (std::string& text : setting)
        if (const auto x = number_of(text)) text = fmt::format("{}", *x + 0.0);  // -0 is 0
    return setting;
}

// The first place of each setting of an axis.
std::map<std::vector<std::string>, std::size_t> places_on(const Axis& axis) {
    std::map<std::vector<std::string>, std::size_t> out;
    for (std::size_t i = 0; i < axis.size(); ++i) {
        check_pause();
        out.emplace(comparable(axis.values[i]), i);
    }
    return out;
}

bool increases(const Axis& axis) {
    double last = -std::numeric_limits<double>::infinity();
    for (const auto& setting : axis.values) {
        const auto value = number_of(setting.front());
        if (setting.size() != 1 || !value || *value <= last) return false;
        last = *value;
    }
    return true;
}

Axis joined(const Axis& a, const Axis& b) {
    Axis out = a;
    auto places = places_on(a);
    for (const auto& setting : b.values) {
        check_pause();
        if (places.emplace(comparable(setting), out.size()).second) out.values.push_back(setting);
    }
    const auto value = [](const auto& setting) { return number_of(setting.front()).value(); };
    if (increases(a) && increases(b)) std::ranges::sort(out.values, {}, value);
    out.logarithmic = a.logarithmic && b.logarithmic;
    return out;
}

// The value that all points have of a key that the scan does not vary.
std::string value_in(const Scan& scan, const std::string& key) {
    for (auto set = scan.sets.rbegin(); set != scan.sets.rend(); ++set)
        if (key_of(*set) == key) return set->substr(key.size() + 1);
    const auto values = values_of(scan.case_of(0));
    const auto found = values.find(key);
    if (found == values.end())
        throw CaseError(fmt::format("{}: its points have no value of {}, so it cannot become an axis", scan.path, key));
    return found->second;
}

// With one more axis, of one value.
void vary(Scan& scan, const std::string& key) {
    Axis axis{.keys = {key}, .values = {{value_in(scan, key)}}};
    std::erase_if(scan.sets, [&](const std::string& set) { return key_of(set) == key; });
    scan.axes.push_back(std::move(axis));
}

// Which axis of the other scan an axis of the wider one is, and where its values are.
struct Source {
    std::optional<std::size_t> axis;
    std::vector<std::size_t> places;  // of one value where that scan does not vary it
};

Source source_of(const Axis& axis, const Scan& scan) {
    Source out;
    const Axis* own = axis_of(scan, axis.keys);
    const Axis fixed{.keys = axis.keys, .values = {{own ? "" : value_in(scan, axis.keys.front())}}};
    if (own) out.axis = static_cast<std::size_t>(own - scan.axes.data());
    const auto places = places_on(axis);
    for (const auto& setting : (own ? *own : fixed).values) out.places.push_back(places.at(comparable(setting)));
    return out;
}

// The points of a scan, as far as they are known, with their numbers in one over the same keys and more values.
void take_points(ScanResult& wider, const ScanResult& result) {
    std::vector<Source> sources;
    for (const Axis& axis : wider.scan.axes) sources.push_back(source_of(axis, result.scan));
    for (const PointResult& p : result.points) {
        if (p.outcome == Outcome::not_run) continue;
        const auto at = result.scan.place(p.point);
        std::size_t number = 0;
        for (std::size_t a = 0; a < sources.size(); ++a)
            number = number * wider.scan.axes[a].size() + sources[a].places[sources[a].axis ? at[*sources[a].axis] : 0];
        wider.points[number] = p;
        wider.points[number].point = number;
    }
}

// Checks the wider scan, which then has the points that these results know.
void take_all(ScanResult& wider, const std::vector<const ScanResult*>& results) {
    check_scan(wider.scan);
    add_inputs(wider.scan);
    wider.points = unknown_points(wider.scan.size());
    for (const ScanResult* result : results) take_points(wider, *result);
}

// Keys of which one of the scans says something by --set that the other does not.
std::set<std::string> told_apart(const Scan& a, const Scan& b) {
    std::set<std::string> keys;
    for (const auto& [one, other] : {std::pair(&a, &b), std::pair(&b, &a)})
        for (const std::string& set : one->sets)
            if (std::ranges::find(other->sets, set) == other->sets.end()) keys.insert(key_of(set));
    return keys;
}

std::string different_lines(const std::string& a, const std::string& b) {
    const std::vector<std::string> one = split(a, '\n'), other = split(b, '\n');
    std::size_t i = 0;
    while (i < std::min(one.size(), other.size()) && one[i] == other[i]) ++i;
    const auto line = [i](const std::vector<std::string>& lines) { return i < lines.size() ? lines[i] : ""; };
    return fmt::format(
        "they are scans of different cases: line {} is '{}' in one, '{}' in the other; scan the same case "
        "twice, with what differs by --set",
        i + 1, line(one), line(other));
}

void refuse_different(const Scan& a, const Scan& b) {
    const auto refuse = [&](const std::string& what) {
        throw CaseError(fmt::format("{} and {} cannot be merged: {}", a.path, b.path, what));
    };
    if (a.case_text != b.case_text) refuse(different_lines(a.case_text, b.case_text));
    if (const std::string other = other_input(a, b); !other.empty()) refuse(other + " was another file");
    if (a.to_the_end != b.to_the_end) refuse("only one of them runs its points to the end (--to-the-end)");
    if (a.boundary != b.boundary) refuse("they differ in --boundary, --seeds or --refine");
}

// A key that no case has is named as such, not as one without a value.
void refuse_no_key(Scan scan, const Axis& axis) {
    std::erase_if(scan.sets, [&](const std::string& set) { return key_of(set) == axis.keys.front(); });
    scan.sets.push_back(axis.keys.front() + "=" + axis.values.front().front());
    scan.case_of(0);
}

// Axes that the scan lacks, of one value each.
void add_axes_of(Scan& scan, const Scan& other) {
    for (const Axis& axis : other.axes) {
        if (axis_of(scan, axis.keys)) continue;
        if (axis.keys.size() > 1)
            throw CaseError(
                fmt::format("{}: a table of other keys cannot be merged: {}", other.path, fmt::join(axis.keys, ", ")));
        vary(scan, axis.keys.front());
    }
}

}  // namespace

ScanResult extended(const ScanResult& result, const std::vector<std::string>& over) {
    ScanResult out{result.scan, {}, {}, {}};
    for (const std::string& text : over) {
        const Axis more = parse_axis(text);
        if (!axis_of(out.scan, more.keys)) {
            refuse_no_key(out.scan, more);
            vary(out.scan, more.keys.front());
        }
        const auto same = std::ranges::find_if(out.scan.axes, [&](const Axis& axis) { return axis.keys == more.keys; });
        *same = joined(*same, more);
    }
    take_all(out, {&result});
    return out;
}

ScanResult merged(const ScanResult& a, const ScanResult& b) {
    refuse_different(a.scan, b.scan);
    ScanResult out{a.scan, {}, {}, {}};
    out.scan.inputs.insert(out.scan.inputs.end(), b.scan.inputs.begin(), b.scan.inputs.end());
    Scan other = b.scan;
    for (const std::string& key : told_apart(a.scan, b.scan))
        for (Scan* scan : {&out.scan, &other})
            if (!axis_of(*scan, {key})) vary(*scan, key);
    add_axes_of(out.scan, other);
    add_axes_of(other, out.scan);
    for (Axis& axis : out.scan.axes) axis = joined(axis, *axis_of(other, axis.keys));
    take_all(out, {&a, &b});
    return out;
}

void drop_unwanted(ScanResult& result) {
    if (!result.scan.boundary) return;
    ScanPlan plan(result.scan);
    std::set<std::size_t> wanted;
    while (const auto work = plan.next()) {
        const PointResult* known = result.known(work->number);
        if (!known) return;  // unfinished: all that is known may be of use
        wanted.insert(work->number);
        plan.done(*known);
    }
    for (PointResult& p : result.points)
        if (!wanted.contains(p.point)) p = unknown_point(p.point);
    std::erase_if(result.more, [&](const auto& entry) { return !wanted.contains(entry.first); });
}

}  // namespace tubule
