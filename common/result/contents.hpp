// All that a result file holds, in memory.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/result/result.hpp"

namespace tubule {

// More bytes of frames than these are not written again and again, but move to a segment; the tests lower it.
inline std::size_t most_rewritten = std::size_t{100} << 20;

// A file beside a large result with some of its frames, which are not written again: those from the previous segment's
// end to `end`.
struct Segment {
    std::string file;  // without its folder
    std::size_t end;
    std::uint32_t crc;  // of its HDF5 part
};

struct Contents {
    std::uint64_t about_begun = 0;  // how many of `about` were there when the run began; the rest came at its end
    CaseText case_text;
    About about;
    std::vector<std::string> series;  // names
    std::vector<double> rows;         // row-major, series.size() numbers a row
    std::vector<SurfaceCells> meshes;
    std::vector<Record> frames;
    std::optional<Record> checkpoint;
    std::vector<Segment> segments;

    std::size_t frames_in_segments() const { return segments.empty() ? 0 : segments.back().end; }
    void add_row(std::span<const double> values) { rows.insert(rows.end(), values.begin(), values.end()); }
    void forget() {
        rows.clear();
        meshes.clear();
        frames.clear();
        checkpoint.reset();
        segments.clear();
    }
};

// The kind of this name. Throws std::runtime_error if there is none.
RecordKind record_kind(std::string_view name);

}  // namespace tubule
