// All that a result file holds, in memory and as HDF5, the layout of docs/results.md.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <utility>
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

struct Contents : Result {
    std::uint64_t about_begun = 0;  // how many of `about` were there when the run began; the rest came at its end
    std::vector<Segment> segments;

    std::size_t frames_in_segments() const { return segments.empty() ? 0 : segments.back().end; }
    std::size_t rows() const { return series.at("time").size(); }
    void add_row(std::span<const double> values) {
        for (std::size_t j = 0; j < values.size(); ++j) series[series_names[j]].push_back(values[j]);
    }
    // Its number, that of an equal one if there is one.
    std::size_t add_mesh(const SurfaceCells& cells) {
        const auto number = static_cast<std::size_t>(std::ranges::find(meshes, cells) - meshes.begin());
        if (number == meshes.size()) meshes.push_back(cells);
        return number;
    }
    void forget() {
        for (auto& [name, column] : series) column.clear();
        meshes.clear();
        frames.clear();
        checkpoint.reset();
        segments.clear();
    }
};

// The kind of a record by its name. Throws std::runtime_error if there is none.
RecordKind record_kind(std::string_view name);

// The bytes of the file, made in memory. In place of the frames that are in segments it has links to them.
std::vector<std::byte> hdf5_image(const Contents& contents);

// The bytes of a segment with the frames from `first` on, and its CRC.
std::pair<std::vector<std::byte>, std::uint32_t> segment_image(const Contents& contents, std::size_t first);

// All throw std::runtime_error naming the file, and what is missing if it is HDF5 but not a result.
Contents read_hdf5(const std::filesystem::path& file);
CaseText read_hdf5_case(const std::filesystem::path& file);

// The bytes of a file from which read_result() gives this result.
std::vector<std::byte> result_image(const Result& result);

// The bytes of a file in which VTK finds that frame of `file`, a path relative to the folder of the one to be written.
std::vector<std::byte> view_image(const std::string& file, std::size_t frame);

// view/NAME_000123.hdf beside a result NAME.hdf: a tiny file for each frame that has a mesh, in which VTK's reader
// finds it (by an external link), and view/NAME.hdf.series with their times. For ParaView 5.11; newer ones open
// NAME.hdf. Writes what is missing or differs, and removes what belongs to frames that no longer exist.
void write_view(const std::filesystem::path& result, const Contents& contents);

}  // namespace tubule
