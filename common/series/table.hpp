// The series of one kind of run: names and values of its rows from one table.
#pragma once

#include <algorithm>
#include <functional>
#include <initializer_list>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/energy/bending.hpp"
#include "common/series/catalogue.hpp"

namespace tubule {

// `Row` is what the values of a row are computed from.
template <class Row>
class SeriesTable {
public:
    struct Column {
        SeriesName name;
        double (*value)(const Row&);
    };
    void add(std::initializer_list<Column> columns) {
        for (const Column& column : columns) columns_.emplace_back(column.name.entry().name, column.value);
    }
    // One series for each number that takes the place of <...>; `value` is given its index.
    template <class Value>
    void add_family(SeriesName family, const std::vector<std::string>& numbers, Value value) {
        for (std::size_t i = 0; i < numbers.size(); ++i)
            columns_.emplace_back(std::string(family.entry().stem()) + numbers[i],
                                  [value, i](const Row& row) { return value(row, i); });
    }

    std::vector<std::string> names() const {
        std::vector<std::string> out;
        for (const auto& [name, value] : columns_) out.push_back(name);
        return out;
    }
    std::vector<double> values(const Row& row) const {
        std::vector<double> out;
        for (const auto& [name, value] : columns_) out.push_back(value(row));
        return out;
    }

private:
    std::vector<std::pair<std::string, std::function<double(const Row&)>>> columns_;
};

// The energy and those of its parts that belong to the surface alone. From a row, `of`, which captures nothing, gives
// the integrals with these names as members.
template <class Row, class Of>
void add_energies(SeriesTable<Row>& table, const Bending& energy, const Of& /*of*/) {
    table.add({{"energy", [](const Row& r) -> double { return Of{}(r).energy; }}});
    table.add_family("energy_<kl>", term_names(energy),
                     [](const Row& r, std::size_t term) { return Of{}(r).energy_term[term]; });
    if (energy.kg > 0) table.add({{"energy_kg", [](const Row& r) -> double { return Of{}(r).energy_kg; }}});
    if constexpr (requires(const Row& r) { Of{}(r).energy_alpha; })
        if (energy.alpha)
            table.add({{"energy_alpha", [](const Row& r) -> double { return Of{}(r).energy_alpha; }},
                       {"M", [](const Row& r) -> double { return Of{}(r).M; }}});
}

// What a row has for one of its series; NaN if it has no such series, or there is no row.
inline double value_in(std::span<const double> row, const std::vector<std::string>& series, std::string_view name) {
    const auto at = static_cast<std::size_t>(std::ranges::find(series, name) - series.begin());
    return at < row.size() ? row[at] : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace tubule
