#include "common/result/hdf5_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <hdf5.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <mutex>
#include <set>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "common/energy/bending.hpp"
#include "common/result/checksums.hpp"
#include "common/result/durable_io.hpp"
#include "common/result/hdf5_objects.hpp"
#include "common/result/start_frame.hpp"
#include "common/result/vtk_grid.hpp"
#include "common/series/catalogue.hpp"

namespace tubule {

using namespace h5;

namespace {

std::mutex library;  // HDF5 may be built without thread safety

// ---- writing

void put_record(hid_t parent, const std::string& name, const Record& record, const std::vector<WrittenMesh>& meshes) {
    const auto group = make_group(parent, name);
    put_attribute(group, "time", record.time);
    if (record.kind) put_attribute(group, "kind", std::string(tubule::name(*record.kind)));
    for (const auto& [key, value] : record.numbers) put_attribute(group, key, value);
    if (record.mesh) {
        put_grid(group, record, meshes[*record.mesh]);
        return;
    }
    for (const Array& array : record.arrays) put_dataset(group, array.name, array.data, array.shape);
}

void put_series(hid_t file, const Contents& contents) {
    const auto group = make_group(file, "series");
    put_attribute(group, "order", contents.series_names);
    for (const std::string& name : contents.series_names) {
        const auto data = put_dataset(group, name, contents.series.at(name));
        if (const SeriesEntry* entry = find_series(name)) {
            put_attribute(data, "unit", std::string(entry->unit));
            put_attribute(data, "meaning", meaning_of(*entry, name));
            if (const auto term = energy_part(name); !term.empty()) put_attribute(data, "label", term_label(term));
        }
    }
}

std::string frame_name(std::size_t number) {
    return fmt::format("{:06}", number);
}

void put_segments(hid_t file, hid_t frames, const std::vector<Segment>& segments) {
    if (segments.empty()) return;
    std::vector<std::string> words;
    std::size_t frame = 0;
    for (const Segment& segment : segments) {
        words.push_back(fmt::format("{} {} {}", segment.end, segment.crc, segment.file));
        for (; frame < segment.end; ++frame) {
            const std::string name = frame_name(frame), target = "/frames/" + name;
            require(H5Lcreate_external(segment.file.c_str(), target.c_str(), frames, name.c_str(), H5P_DEFAULT,
                                       H5P_DEFAULT) >= 0,
                    "link", segment.file);
        }
    }
    put_attribute(file, "segments", words);
}

std::size_t size_estimate(const Contents& contents) {
    std::size_t doubles = contents.rows() * contents.series_names.size();
    for (std::size_t i = contents.frames_in_segments(); i < contents.frames.size(); ++i)
        for (const Array& array : contents.frames[i].arrays) doubles += array.data.size();
    std::size_t integers = 0;
    for (const SurfaceCells& mesh : contents.meshes) integers += 2 * mesh.cells.size();
    return doubles * sizeof(double) + integers * sizeof(std::int64_t) + contents.frames.size() * 4096;
}

// ---- reading

// All attributes of a record are numbers but its kind and, on a mesh, these.
bool is_of_the_grid(const std::string& attribute) {
    return std::find(std::begin(grid_attributes), std::end(grid_attributes), attribute) != std::end(grid_attributes);
}

// No number of a result is NaN or infinite: the writer refuses them.
void require_finite(const std::vector<double>& values, const std::string& what) {
    const auto bad = std::find_if_not(values.begin(), values.end(), [](double x) { return std::isfinite(x); });
    if (bad != values.end())
        throw std::runtime_error(
            fmt::format("{} is {} in row {}, and no number of a result can be that: the file is "
                        "damaged",
                        what, *bad, bad - values.begin()));
}

Record get_record(hid_t parent, const std::string& name, const std::vector<SurfaceCells>& meshes) {
    Record record;
    const auto group = open_group(parent, name);
    for (const std::string& key : attribute_names(group)) {
        if (key == "mesh")
            record.mesh = get_number<std::uint64_t>(group, key);
        else if (key == "kind")
            record.kind = record_kind(fmt::format("{}", fmt::join(get_texts(group, key), " ")));
        else if (is_of_the_grid(key))
            continue;
        else if (key == "time")
            record.time = get_number<double>(group, key);
        else
            record.numbers.emplace_back(key, get_number<double>(group, key));
    }
    if (record.mesh) {
        if (*record.mesh >= meshes.size())
            throw std::runtime_error(fmt::format("{} refers to mesh {}, which is missing", name, *record.mesh));
        record.arrays = get_grid_arrays(group, meshes[*record.mesh]);
    } else {
        for (const std::string& key : member_names(group)) record.arrays.push_back(get_array(group, key));
    }
    for (const Array& array : record.arrays) require_finite(array.data, fmt::format("{}: {}", name, array.name));
    for (const auto& [key, value] : record.numbers) require_finite({value}, fmt::format("{}: {}", name, key));
    require_finite({record.time}, fmt::format("{}: time", name));
    return record;
}

void get_series(hid_t file, Contents& contents) {
    const auto group = open_group(file, "series");
    contents.series_names = get_texts(group, "order");
    for (const std::string& name : contents.series_names) {
        std::vector<double>& column = contents.series[name] = get_array(group, name).data;
        require_finite(column, "series " + name);
        const std::string& first = contents.series_names.front();
        if (column.size() != contents.series.at(first).size())
            throw std::runtime_error(fmt::format("series {} and {} differ in length", first, name));
    }
    if (!contents.series.contains("time")) throw std::runtime_error("/series/time is missing");
}

void require_parts(hid_t file) {
    if (has(file, "scan") && has(file, "axes"))
        throw std::runtime_error("is the result of a scan: this needs the result of a run");
    for (const char* part : {"case", "about", "series", "frames"})
        if (!has(file, part)) throw std::runtime_error(fmt::format("not a Tubule result: /{} is missing", part));
    if (H5Aexists(file, "about_begun") <= 0)
        throw std::runtime_error("not a Tubule result: the attribute about_begun is missing");
}

std::vector<Segment> get_segments(hid_t file) {
    std::vector<Segment> segments;
    if (H5Aexists(file, "segments") <= 0) return segments;
    for (const std::string& words : get_texts(file, "segments")) {
        std::istringstream in(words);
        Segment segment{};
        in >> segment.end >> segment.crc >> std::ws;
        std::getline(in, segment.file);
        segments.push_back(segment);
    }
    return segments;
}

// HDF5 follows the links to them: they must be as they were written, too.
void require_segments(hid_t file, const std::filesystem::path& folder) {
    for (const Segment& segment : get_segments(file)) {
        const auto path = folder / segment.file;
        if (!std::filesystem::exists(path))
            throw std::runtime_error(fmt::format("{}, which has some of its frames, is missing", path.string()));
        const Wholeness found = examine(path);
        if (found.kind != Wholeness::Kind::whole || found.crc != segment.crc)
            throw std::runtime_error(
                fmt::format("{}, which has some of its frames, {}", path.string(),
                            found.damage.empty() ? "belongs to another result" : "cannot be read: " + found.damage));
    }
}

CaseText get_case(hid_t file) {
    const Handle text(H5Dopen2(file, "case", H5P_DEFAULT), H5Dclose, "open", "case");
    CaseText out{get_text_dataset(file, "case"), get_texts(text, "set"), get_inputs(file)};
    if (has(file, "resolved_case")) out.resolved = get_text_dataset(file, "resolved_case");
    return out;
}

Contents get_contents(hid_t file) {
    Contents contents;
    contents.about_begun = get_number<std::uint64_t>(file, "about_begun");
    contents.case_text = get_case(file);
    contents.segments = get_segments(file);
    const auto about = open_group(file, "about");
    for (const std::string& name : attribute_names(about)) contents.about.emplace_back(name, get_value(about, name));
    get_series(file, contents);
    if (has(file, "meshes")) {
        const auto meshes = open_group(file, "meshes");
        for (std::size_t i = member_names(meshes).size(); contents.meshes.size() < i;)
            contents.meshes.push_back(get_mesh(meshes, fmt::format("{:06}", contents.meshes.size())));
    }
    const auto frames = open_group(file, "frames");
    for (std::size_t i = member_names(frames).size(); contents.frames.size() < i;)
        contents.frames.push_back(get_record(frames, frame_name(contents.frames.size()), contents.meshes));
    if (has(file, "checkpoint")) contents.checkpoint = get_record(file, "checkpoint", contents.meshes);
    return contents;
}

// Opens a result and returns read(its handle).
template <class Read>
auto with_result(const std::filesystem::path& file, const Read& read) {
    const std::lock_guard lock(library);
    const Quiet quiet;
    std::error_code error;
    const auto status = std::filesystem::status(file, error);
    if (!std::filesystem::exists(status)) durable::fail("open", file, error ? error.value() : ENOENT);
    if (!std::filesystem::is_regular_file(status))
        throw std::runtime_error(fmt::format("{}: not a regular file", file.string()));
    for (int tries = 1;; ++tries) {
        bool has_segments = false;
        try {
            const auto opened = open_file(file);
            require_parts(opened);
            has_segments = !get_segments(opened).empty();
            require_segments(opened, file.parent_path());
            return read(opened);
        } catch (const std::runtime_error& e) {
            // Its writer may have ended: then the segments are gone, and the file has all.
            if (!has_segments || tries == 3) throw std::runtime_error(fmt::format("{}: {}", file.string(), e.what()));
        }
    }
}

}  // namespace

std::vector<std::byte> hdf5_image(const Contents& contents) {
    const std::lock_guard lock(library);
    const Quiet quiet;
    // Grows in steps of the expected size, so that it is rarely reallocated.
    const auto file = make_image(std::max<std::size_t>(size_estimate(contents), 1 << 16));
    put_attribute(file, "about_begun", contents.about_begun);
    put_attribute(put_dataset(file, "case", contents.case_text.text), "set", contents.case_text.sets);
    if (!contents.case_text.resolved.empty()) put_dataset(file, "resolved_case", contents.case_text.resolved);
    put_inputs(file, contents.case_text.inputs);
    const auto about = make_group(file, "about");
    for (const auto& [key, value] : contents.about)
        std::visit([&, &key = key](const auto& v) { put_attribute(about, key, v); }, value);
    put_series(file, contents);
    const auto meshes = put_meshes(file, contents.meshes);
    const auto frames = make_group(file, "frames");
    put_segments(file, frames, contents.segments);
    for (std::size_t i = contents.frames_in_segments(); i < contents.frames.size(); ++i)
        put_record(frames, frame_name(i), contents.frames[i], meshes);
    if (contents.checkpoint) put_record(file, "checkpoint", *contents.checkpoint, meshes);
    put_steps(file, contents, meshes);
    auto bytes = bytes_of(file);
    seal(bytes);
    return bytes;
}

std::pair<std::vector<std::byte>, std::uint32_t> segment_image(const Contents& contents, std::size_t first) {
    const std::lock_guard lock(library);
    const Quiet quiet;
    std::set<std::size_t> needed;
    for (std::size_t i = first; i < contents.frames.size(); ++i)
        if (contents.frames[i].mesh) needed.insert(*contents.frames[i].mesh);
    const auto file = make_image(std::max<std::size_t>(size_estimate(contents), 1 << 16));
    const auto meshes = put_meshes(file, contents.meshes, [&](std::size_t mesh) { return needed.contains(mesh); });
    const auto frames = make_group(file, "frames");
    for (std::size_t i = first; i < contents.frames.size(); ++i)
        put_record(frames, frame_name(i), contents.frames[i], meshes);
    auto bytes = bytes_of(file);
    const std::uint32_t crc = seal(bytes);
    return {std::move(bytes), crc};
}

std::vector<std::byte> view_image(const std::string& file, std::size_t frame) {
    const std::lock_guard lock(library);
    const Quiet quiet;
    const auto image = make_image(4096);
    const std::string target = fmt::format("/frames/{:06}", frame);
    require(H5Lcreate_external(file.c_str(), target.c_str(), image, "VTKHDF", H5P_DEFAULT, H5P_DEFAULT) >= 0, "link",
            file);
    return bytes_of(image);
}

Contents read_hdf5(const std::filesystem::path& file) {
    return with_result(file, get_contents);
}

CaseText read_hdf5_case(const std::filesystem::path& file) {
    return with_result(file, get_case);
}

void require_result(const std::filesystem::path& file) {
    with_result(file, [](hid_t) {});
}

std::vector<std::byte> result_image(const Result& result) {
    Contents contents{result, result.about.size(), {}};
    contents.case_text.resolved = resolved_case(result.case_text);
    return hdf5_image(contents);
}

}  // namespace tubule
