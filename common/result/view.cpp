
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <iterator>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "common/result/durable_io.hpp"
#include "common/result/hdf5_file.hpp"

namespace tubule {

namespace {

namespace fs = std::filesystem;

bool holds(const fs::path& file, std::span<const std::byte> bytes) {
    std::ifstream in(file, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    return std::ranges::equal(std::as_bytes(std::span(text)), bytes);
}

void write(const fs::path& file, std::span<const std::byte> bytes) {
    if (!holds(file, bytes)) durable::replace(file, bytes);
}

std::string quoted(const std::string& text) {
    std::string out = "\"";
    for (const char c : text) out += c == '"' || c == '\\' ? std::string("\\") + c : std::string(1, c);
    return out + '"';
}

// Whether this is the view of a frame of that result.
bool is_view_of(const std::string& stem, const std::string& file) {
    const std::string end = ".hdf";
    const std::size_t digits = stem.size() + 1;
    return file.starts_with(stem + "_") && file.ends_with(end) && file.size() >= digits + 6 + end.size() &&
           std::all_of(file.begin() + static_cast<std::ptrdiff_t>(digits),
                       file.end() - static_cast<std::ptrdiff_t>(end.size()),
                       [](unsigned char c) { return std::isdigit(c); });
}

void remove_others(const fs::path& folder, const std::string& stem, const std::set<std::string>& wanted) {
    std::vector<fs::path> others;
    for (const auto& entry : fs::directory_iterator(folder)) {
        const std::string name = entry.path().filename().string();
        const bool ours = is_view_of(stem, name) || name == stem + ".hdf.series";
        if (ours && !wanted.contains(name)) others.push_back(entry.path());
    }
    for (const fs::path& other : others) durable::remove(other);
}

}  // namespace

void write_view(const fs::path& result, const Contents& contents) {
    const fs::path folder = result.parent_path() / "view";
    const std::string stem = result.stem().string();
    std::set<std::string> wanted;
    std::string series;
    for (std::size_t i = 0; i < contents.frames.size(); ++i) {
        const Record& frame = contents.frames[i];
        if (!frame.mesh) continue;
        if (wanted.empty()) fs::create_directories(folder);
        const std::string name = fmt::format("{}_{:06}.hdf", stem, i);
        write(folder / name, view_image("../" + result.filename().string(), i));
        wanted.insert(name);
        series +=
            fmt::format("{}    {{\"name\": {}, \"time\": {}}}", series.empty() ? "" : ",\n", quoted(name), frame.time);
    }
    if (!wanted.empty()) {
        series = fmt::format("{{\n  \"file-series-version\": \"1.0\",\n  \"files\": [\n{}\n  ]\n}}\n", series);
        write(folder / (stem + ".hdf.series"), std::as_bytes(std::span(series)));
        wanted.insert(stem + ".hdf.series");
    }
    if (fs::is_directory(folder)) remove_others(folder, stem, wanted);
}

}  // namespace tubule
