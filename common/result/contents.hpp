// All that a result file holds, in memory.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/result/result.hpp"

namespace tubule {

struct Contents {
    std::uint64_t about_begun = 0;  // how many of `about` were there when the run began; the rest came at its end
    CaseText case_text;
    About about;
    std::vector<std::string> series;  // names
    std::vector<double> rows;         // row-major, series.size() numbers a row
    std::vector<SurfaceCells> meshes;
    std::vector<Record> frames;
    std::optional<Record> checkpoint;

    void add_row(std::span<const double> values) { rows.insert(rows.end(), values.begin(), values.end()); }
    void forget() {
        rows.clear();
        meshes.clear();
        frames.clear();
        checkpoint.reset();
    }
};

// The kind of this name. Throws std::runtime_error if there is none.
RecordKind record_kind(std::string_view name);

}  // namespace tubule
