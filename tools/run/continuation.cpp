#include "tools/run/continuation.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <map>
#include <set>

#include "common/case/read.hpp"
#include "common/case/text.hpp"
#include "common/case/toml_input.hpp"
#include "common/result/about.hpp"
#include "common/result/start_frame.hpp"
#include "common/run/run_observer.hpp"

namespace tubule {
namespace {

constexpr std::size_t most_named = 5;  // differences in a message
const std::string absent = "absent";

std::string value_text(const toml::node& node) {
    if (const auto* value = node.as_string()) return toml_string(value->get());
    if (const auto* value = node.as_integer()) return fmt::format("{}", value->get());
    if (const auto* value = node.as_floating_point()) return fmt::format("{}", value->get());
    if (const auto* value = node.as_boolean()) return fmt::format("{}", value->get());
    std::vector<std::string> items;
    if (const auto* list = node.as_array())
        for (const toml::node& item : *list) items.push_back(value_text(item));
    return fmt::format("[{}]", fmt::join(items, ", "));
}

bool holds_tables(const toml::node& node) {
    const auto* list = node.as_array();
    return list && !list->empty() && list->front().is_table();
}

// When a run ends and what it writes, not what it computes.
bool may_change(const Difference& d) {
    return d.key == "time.end" || d.key == "time.output" || d.key == "time.stationary";
}

std::string unreadable(const CaseError& error) {
    return fmt::format("its case cannot be read by this version: {}", error.what());
}

// Folder and name of the case file, from which its paths are read. Older results do not tell: then its own.
std::string path_of_case(const Result& result, const std::filesystem::path& file) {
    const auto* path = find_value<std::string>(result.about, "case_path");
    return path ? *path : file.string();
}

}  // namespace

std::map<std::string, std::string> values_of(const Case& c) {
    std::map<std::string, std::string> out;
    walk(parse_toml(effective_toml(c), c.path), "", [&](const std::string& key, const toml::node& node) {
        if (node.is_table() || holds_tables(node)) return true;
        if (!key.starts_with("about.") && !key.starts_with("units.") && !key.starts_with("expect.") &&
            key != "time.limit")
            out[key] = value_text(node);
        return false;
    });
    return out;
}

std::vector<Difference> differences(const Case& there, const Case& here) {
    const auto old = values_of(there), now = values_of(here);
    std::vector<Difference> out;
    for (const auto& [key, value] : old) {
        const auto other = now.find(key);
        if (other == now.end())
            out.push_back({key, value, absent});
        else if (other->second != value)
            out.push_back({key, value, other->second});
    }
    for (const auto& [key, value] : now)
        if (!old.contains(key)) out.push_back({key, absent, value});
    return out;
}

std::string words(const std::vector<Difference>& differences) {
    std::vector<std::string> parts;
    for (const Difference& d : differences) {
        if (parts.size() == most_named) {
            parts.push_back(fmt::format("and {} more", differences.size() - most_named));
            break;
        }
        parts.push_back(fmt::format("{} is {} there, {} here", d.key, d.there, d.here));
    }
    return fmt::format("{}", fmt::join(parts, "; "));
}

bool is_hdf5(const std::filesystem::path& file) {
    static constexpr std::array<char, 8> signature{'\x89', 'H', 'D', 'F', '\r', '\n', '\x1a', '\n'};
    std::error_code none;
    if (!std::filesystem::is_regular_file(file, none)) return false;
    std::array<char, 8> begin{};
    std::ifstream(file, std::ios::binary).read(begin.data(), begin.size());
    return begin == signature;
}

Case case_of_result(const Result& result, const std::filesystem::path& file, const std::vector<std::string>& sets) {
    std::set<std::string> replaced;
    for (const std::string& set : sets) replaced.insert(key_of(set));
    if (replaced.contains("model.kind")) replaced.insert("model.chosen");  // what was chosen before is no longer asked
    std::vector<std::string> all = result.case_text.sets;
    std::erase_if(all, [&](const std::string& set) { return replaced.contains(key_of(set)); });
    all.insert(all.end(), sets.begin(), sets.end());
    return parse_case(result.case_text.text, all, path_of_case(result, file), result.case_text.inputs);
}

std::optional<ModelKind> chosen_before(const std::filesystem::path& file) {
    const std::string key = "model.chosen=";
    std::optional<ModelKind> out;
    for (const std::string& set : read_case_text(file).sets)
        for (const ModelEntry& m : models)
            if (set == key + m.name) out = m.kind;
    return out;
}

std::size_t frame_named(const Result& result, long number) {
    const long count = static_cast<long>(result.frames.size()), index = number < 0 ? count + number : number;
    if (index >= 0 && index < count) return static_cast<std::size_t>(index);
    throw std::runtime_error(
        fmt::format("no frame {}: there are {}", number, count > 0 ? fmt::format("0 to {}", count - 1) : "none"));
}

std::optional<Stop> stop_of(const Result& result) {
    const auto* stop = find_value<std::string>(result.about, "stop");
    return stop ? stop_from_name(*stop) : std::nullopt;
}

CaseInputs inputs_to_resume(const std::filesystem::path& file) {
    try {
        return is_hdf5(file) ? read_case_text(file).inputs : CaseInputs{};
    } catch (const std::runtime_error&) {
        return {};  // no result, or a damaged one: the run says so
    }
}

bool goes_on(const Case& c, const Result& result, const std::filesystem::path& file) {
    const auto refuse = [&](const std::string& why) {
        throw CaseError(fmt::format("{}: cannot be resumed with {}: {}", file.string(), c.path, why));
    };
    Case before;
    try {
        before = parse_case(result.case_text.text, result.case_text.sets, c.path, result.case_text.inputs);
    } catch (const CaseError& error) {
        refuse(unreadable(error));
    }
    if (const std::string changed = changed_input(c, result.case_text.inputs); !changed.empty())
        refuse(fmt::format("{}\nbring back the file that it began with, or run the case anew: --overwrite or -o FILE",
                           changed));
    if (c.moves() && !before.moves()) refuse("nothing moves in its case, so time.end must be absent");
    std::vector<Difference> fixed = differences(before, c);
    std::erase_if(fixed, may_change);
    if (!fixed.empty())
        refuse(
            fmt::format("it belongs to another case or other --set: {}\nonly time.end, time.output, time.stationary "
                        "and time.limit may change",
                        words(fixed)));
    const auto stop = stop_of(result);
    const bool unfinished = !stop || can_go_on(*stop);
    if (!c.moves()) return unfinished;
    const std::vector<double>& times = result.series.at("time");
    const double reached = times.empty() ? 0 : times.back();
    if (c.time.end < reached * (1 - 1e-12))
        refuse(fmt::format("time.end must be later than t = {:.6g}, which the result has reached, not {}", reached,
                           c.time.end));
    if (unfinished) return true;
    const bool longer = c.time.end > before.time.end;
    if (*stop == Stop::finished) return longer;
    if (*stop == Stop::stationary) return longer || c.time.stationary != before.time.stationary;
    if (longer)
        refuse(
            fmt::format("its run ended at t = {:.6g} with {}: a later time.end changes nothing", reached, name(*stop)));
    return false;
}

std::vector<double> missed_outputs(const Case& c, const Result& result, double from) {
    std::vector<double> out;
    for (const double t : c.time.output) {
        const auto there = [&](const Record& frame) { return frame.time == t; };
        if (t > 0 && t <= from && std::ranges::none_of(result.frames, there)) out.push_back(t);
    }
    return out;
}

std::string other_case(const Case& c, const CaseText& of_result) {
    if (of_result.text == c.text && of_result.sets == c.sets) return changed_input(c, of_result.inputs);
    try {
        return words(differences(parse_case(of_result.text, of_result.sets, c.path, of_result.inputs), c));
    } catch (const CaseError& error) {
        return unreadable(error);
    }
}

}  // namespace tubule
