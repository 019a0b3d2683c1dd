// The series of one kind of run: names and values of its rows from one table.
#pragma once

#include <functional>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

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

}  // namespace tubule
