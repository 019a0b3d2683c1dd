#include "common/series/catalogue.hpp"

#include <algorithm>
#include <charconv>

#include "common/energy/bending.hpp"

namespace tubule {

namespace {

const std::string_view energy_terms = SeriesName("energy_<kl>").entry().name;

bool is_number(std::string_view digits) {
    int n = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), n);
    return error == std::errc{} && n >= 0 && digits == std::to_string(n);
}

// 41 or 12_3: the geometric order of a term and its power of K.
bool is_order_and_power(std::string_view name) {
    const std::size_t bar = name.find('_');
    if (bar == name.npos && name.size() != 2) return false;
    const std::string_view order = name.substr(0, bar == name.npos ? 1 : bar),
                           power = name.substr(bar == name.npos ? 1 : bar + 1);
    if (!is_number(order) || !is_number(power) || (bar != name.npos && order.size() < 2)) return false;
    return std::stoi(std::string(order)) >= std::max(1, 2 * std::stoi(std::string(power)));
}

bool is_member(const SeriesEntry& family, std::string_view name) {
    if (!name.starts_with(family.stem())) return false;
    const std::string_view number = name.substr(family.stem().size());
    if (family.name != energy_terms) return is_number(number);
    bool listed = false;
    for_each_bending_term([&](std::size_t, const auto& term) { listed = listed || number == term.name; });
    return listed || is_order_and_power(number);
}

}  // namespace

const SeriesEntry* find_series(std::string_view name) {
    for (const SeriesEntry& entry : series_catalogue)
        if (entry.is_family() ? is_member(entry, name) : entry.name == name) return &entry;
    return nullptr;
}

std::string meaning_of(const SeriesEntry& entry, std::string_view name) {
    std::string out(entry.meaning);
    if (!entry.is_family()) return out;
    const std::size_t from = out.find('<'), to = out.find('>', from);
    return out.replace(from, to + 1 - from, name.substr(entry.stem().size()));
}

bool is_expectable(std::string_view name) {
    const SeriesEntry* entry = find_series(name);
    return entry && entry->use != SeriesUse::effort;
}

std::vector<std::string> expectable_series() {
    std::vector<std::string> out;
    for (const SeriesEntry& entry : series_catalogue) {
        if (entry.use == SeriesUse::effort) continue;
        if (entry.name != energy_terms)
            out.emplace_back(entry.name);
        else
            for_each_bending_term(
                [&](std::size_t, const auto& term) { out.push_back(std::string(entry.stem()) + term.name); });
    }
    return out;
}

std::string_view energy_part(std::string_view name) {
    const SeriesEntry* entry = find_series(name);
    const std::string_view stem = SeriesName("energy_<kl>").entry().stem();
    const bool part =
        entry && (entry->name == energy_terms || entry->name == "energy_formula" || entry->name == "energy_kg");
    return part ? name.substr(stem.size()) : std::string_view();
}

}  // namespace tubule
