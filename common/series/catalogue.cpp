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

bool is_member(const SeriesEntry& family, std::string_view name) {
    if (!name.starts_with(family.stem())) return false;
    const std::string_view number = name.substr(family.stem().size());
    if (family.name != energy_terms) return is_number(number);
    const std::vector<std::string> terms = energy_term_numbers();
    return std::find(terms.begin(), terms.end(), number) != terms.end();
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
            for (const std::string& number : energy_term_numbers()) out.push_back(std::string(entry.stem()) + number);
    }
    return out;
}

std::vector<std::string> energy_term_numbers() {
    std::vector<std::string> out;
    for_each_bending_term([&](std::size_t, const auto& term) { out.emplace_back(term.name); });
    return out;
}

}  // namespace tubule
