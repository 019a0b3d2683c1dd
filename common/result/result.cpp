#include "common/result/result.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>
#include <utility>

#include "common/result/about.hpp"
#include "common/result/file_writer.hpp"
#include "common/result/hdf5_file.hpp"
#include "common/result/record.hpp"
#include "common/result/vtk_grid.hpp"

namespace tubule {

namespace {

namespace fs = std::filesystem;

// ---- refusals

void check_finite(double value, const std::string& where, const std::string& name) {
    if (!std::isfinite(value)) throw std::invalid_argument(fmt::format("{} {} is {}", where, name, value));
}

// Names become HDF5 names, of which '/' and '.' are syntax. `taken` holds those seen so far.
void check_name(const std::string& name, const std::string& where, std::set<std::string>& taken) {
    if (name.empty() || name == "." || name.find('/') != std::string::npos || name.find('\0') != std::string::npos)
        throw std::invalid_argument(fmt::format("{}: \"{}\" cannot be a name", where, name));
    if (!taken.insert(name).second) throw std::invalid_argument(fmt::format("{}: {} occurs twice", where, name));
}

// HDF5 ends its strings with a zero byte.
void check_text(const std::string& text, const std::string& where) {
    if (text.find('\0') != std::string::npos)
        throw std::invalid_argument(fmt::format("{} contains a zero byte", where));
}

void check_case(const CaseText& c) {
    check_text(c.text, "the case");
    for (const std::string& set : c.sets) check_text(set, "--set");
}

void check_about(const About& about) {
    std::set<std::string> taken;
    for (const auto& [name, value] : about) {
        check_name(name, "about", taken);
        if (const auto* number = std::get_if<double>(&value)) check_finite(*number, "about", name);
        if (const auto* text = std::get_if<std::string>(&value)) check_text(*text, "about " + name);
    }
}

void check_series(const std::vector<std::string>& series) {
    std::set<std::string> taken;
    for (const std::string& name : series) check_name(name, "series", taken);
    if (!taken.contains("time")) throw std::invalid_argument("series: a series named time is required");
}

void check_free(const std::string& name, std::span<const char* const> taken, const std::string& where) {
    if (std::find(taken.begin(), taken.end(), name) != taken.end())
        throw std::invalid_argument(fmt::format("{}: {} is a name reserved by the mesh format", where, name));
}

void check_mesh(const SurfaceCells& mesh) {
    const auto refuse = [](const std::string& why) { throw std::invalid_argument("mesh: " + why); };
    if (mesh.order < 1 || mesh.order > 4) refuse(fmt::format("its order is {}, not 1 to 4", mesh.order));
    const std::size_t width = mesh.nodes_per_cell();
    if (mesh.cells.empty() || mesh.cells.size() % width != 0)
        refuse(fmt::format("{} node numbers do not divide into cells of {}", mesh.cells.size(), width));
    for (const int node : mesh.cells)
        if (node < 0 || static_cast<std::size_t>(node) >= mesh.nodes)
            refuse(fmt::format("a cell uses node {}, but there are {}", node, mesh.nodes));
    if (!std::isfinite(mesh.period) || mesh.period < 0) refuse(fmt::format("its period is {}", mesh.period));
    const std::size_t shifts = mesh.period > 0 ? mesh.cells.size() : 0;
    if (mesh.shifts.size() != shifts)
        refuse(fmt::format("{} shifts, but its period {} requires {}", mesh.shifts.size(), mesh.period, shifts));
}

// A record on a curved surface.
void check_grid(const Record& record, const std::vector<SurfaceCells>& meshes, const std::string& where) {
    const auto refuse = [&](const std::string& why) { throw std::invalid_argument(where + ": " + why); };
    if (*record.mesh >= meshes.size())
        refuse(fmt::format("it refers to mesh {}, but there are {}", *record.mesh, meshes.size()));
    const SurfaceCells& mesh = meshes[*record.mesh];
    const Array* points = find_array(record, "points");
    if (!points || points->shape != std::vector<std::size_t>{mesh.nodes, 3})
        refuse(fmt::format("on a mesh it must have an array points [{}, 3]", mesh.nodes));
    for (const Array& array : record.arrays)
        if (!is_point_data(array, mesh)) check_free(array.name, grid_members, where);
}

void check_record(const Record& record, const std::vector<SurfaceCells>& meshes, const std::string& where) {
    check_finite(record.time, where, "time");
    std::set<std::string> numbers{"time", "kind"};
    for (const auto& [name, value] : record.numbers) {
        check_name(name, where, numbers);
        check_free(name, grid_attributes, where);
        check_finite(value, where, name);
    }
    std::set<std::string> arrays;
    for (const Array& array : record.arrays) {
        check_name(array.name, where, arrays);
        std::size_t size = 1;
        for (const std::size_t extent : array.shape) size *= extent;
        if (size != array.data.size())
            throw std::invalid_argument(fmt::format("{} {}: its shape requires {} numbers, but it has {}", where,
                                                    array.name, size, array.data.size()));
        const auto bad =
            std::find_if_not(array.data.begin(), array.data.end(), [](double x) { return std::isfinite(x); });
        if (bad != array.data.end())
            check_finite(*bad, where, fmt::format("{}[{}]", array.name, bad - array.data.begin()));
    }
    if (record.mesh) check_grid(record, meshes, where);
}

// The absolute path of a result, valid after a change of directory; symbolic links are followed.
fs::path resolved(const fs::path& file) {
    return fs::weakly_canonical(fs::absolute(file));
}

// A typo after -o must not overwrite a case file or other data.
void refuse_to_replace_others(const fs::path& file) {
    if (!fs::exists(file)) return;
    try {
        require_result(file);
    } catch (const std::runtime_error& e) {
        throw std::runtime_error(fmt::format(
            "{}\nit was not replaced, since it may be needed: remove it first, or write elsewhere", e.what()));
    }
}

// ---- contents

// Drops everything after the newest restart record, and returns that record.
Record rewind(Contents& contents) {
    const Record* newest = contents.frames.empty() ? nullptr : &contents.frames.back();
    if (contents.checkpoint && (!newest || contents.checkpoint->time >= newest->time)) newest = &*contents.checkpoint;
    if (!newest) throw std::runtime_error("it contains no frame or checkpoint to resume from");
    Record record = *newest;

    const std::vector<double> times = contents.series.at("time");
    for (auto& [name, column] : contents.series) {
        std::size_t i = 0;
        std::erase_if(column, [&](double) { return times[i++] > record.time; });
    }
    std::erase_if(contents.frames, [&](const Record& frame) { return frame.time > record.time; });
    // From the end only, so that the numbers of the others do not change.
    std::size_t needed = record.mesh ? *record.mesh + 1 : 0;
    for (const Record& frame : contents.frames)
        if (frame.mesh) needed = std::max(needed, *frame.mesh + 1);
    if (contents.checkpoint && contents.checkpoint->mesh) needed = std::max(needed, *contents.checkpoint->mesh + 1);
    contents.meshes.resize(needed);
    contents.about.resize(std::min<std::size_t>(contents.about.size(), contents.about_begun));
    return record;
}

}  // namespace

struct ResultWriter::Impl {
    // Fails if another writer holds the file, or if permissions are missing.
    explicit Impl(const fs::path& path) : file(path) {}
    // A run that ended by an exception; if the disk is the reason, nothing more can be done.
    ~Impl() {
        try {
            if (began && unwritten) write();
        } catch (const std::exception&) {
        }
    }

    FileWriter file;
    Contents contents;
    Record restart;
    bool resumed = false;
    bool began = false;              // the file is this writer's
    bool unwritten = false;          // it lacks something
    bool has_other_segments = true;  // maybe: of another run, or of frames that are forgotten
    bool finished = false;

    void write() {
        move_frames_to_segment();
        write_file();
    }
    void write_file() {
        file.write([this] { return hdf5_image(contents); });
        unwritten = false;
        if (std::exchange(has_other_segments, false)) remove_other_segments();
        write_view(file.path(), contents);
    }
    fs::path segment(std::size_t number) const { return file.path().string() + fmt::format(".frames{}", number); }
    // Large frames that are written are not written again until the end: they move to a file of their own.
    void move_frames_to_segment() {
        const std::size_t first = contents.frames_in_segments();
        std::size_t bytes = 0;
        for (std::size_t i = first; i < contents.frames.size(); ++i)
            for (const Array& array : contents.frames[i].arrays) bytes += array.data.size() * sizeof(double);
        if (bytes <= most_rewritten) return;
        std::size_t number = 0;
        while (fs::exists(segment(number))) ++number;
        const auto [image, crc] = segment_image(contents, first);
        durable::replace(segment(number), image);
        contents.segments.push_back({segment(number).filename().string(), contents.frames.size(), crc});
    }
    void remove_other_segments() {
        std::vector<fs::path> others;
        for (const auto& entry : fs::directory_iterator(file.path().parent_path())) {
            const std::string name = entry.path().filename().string();
            const auto is_it = [&](const Segment& segment) { return segment.file == name; };
            if (name.starts_with(file.path().filename().string() + ".frames") &&
                std::ranges::none_of(contents.segments, is_it))
                others.push_back(entry.path());
        }
        for (const fs::path& other : others) durable::remove(other);
    }

    // What comes before the first row of a new result waits for it, and what was there stays: the run may fail at its
    // start.
    void added(bool is_row, bool at_once) {
        unwritten = true;
        const bool begins = !began && !resumed && is_row;
        began = began || resumed || is_row;
        if (began && (begins || at_once || file.due())) write();
    }

    void refuse_if_finished() const {
        if (finished)
            throw std::logic_error(
                fmt::format("{}: the result is finished; nothing can be written after finish()", file.path().string()));
    }
};

ResultWriter::ResultWriter(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
ResultWriter::ResultWriter(ResultWriter&&) noexcept = default;
ResultWriter& ResultWriter::operator=(ResultWriter&&) noexcept = default;
ResultWriter::~ResultWriter() = default;

ResultWriter ResultWriter::create(const fs::path& file, const CaseText& c, const About& about,
                                  const std::vector<std::string>& series) {
    check_case(c);
    check_about(about);
    check_series(series);
    const auto path = resolved(file);
    refuse_to_replace_others(path);

    auto impl = std::make_unique<Impl>(path);
    impl->contents.about_begun = about.size();
    impl->contents.case_text = c;
    impl->contents.about = about;
    impl->contents.series_names = series;
    for (const std::string& name : series) impl->contents.series[name];
    return ResultWriter(std::move(impl));
}

ResultWriter ResultWriter::resume(const fs::path& file, const std::function<void(const Record&)>& check,
                                  const std::optional<CaseText>& now) {
    if (now) check_case(*now);
    const auto path = resolved(file);
    require_result(path);  // refuse a file that is not a result before changing anything
    auto impl = std::make_unique<Impl>(path);
    impl->contents = read_hdf5(path);
    try {
        impl->restart = rewind(impl->contents);
        check(impl->restart);
    } catch (const std::runtime_error& e) {
        throw std::runtime_error(fmt::format("{}: {}", path.string(), e.what()));
    }
    if (now) impl->contents.case_text = *now;
    impl->resumed = true;
    return ResultWriter(std::move(impl));
}

bool ResultWriter::began() const {
    return impl_->began;
}

const Record& ResultWriter::restart_record() const {
    return impl_->restart;
}

void ResultWriter::row(std::span<const double> values) {
    const std::vector<std::string>& series = impl_->contents.series_names;
    if (values.size() != series.size())
        throw std::invalid_argument(
            fmt::format("a row has {} values, but there are {} series", values.size(), series.size()));
    for (std::size_t j = 0; j < values.size(); ++j) check_finite(values[j], "series", series[j]);

    impl_->refuse_if_finished();
    impl_->contents.add_row(values);
    impl_->added(true, false);
}

std::size_t ResultWriter::mesh(const SurfaceCells& cells) {
    check_mesh(cells);
    impl_->refuse_if_finished();
    const std::size_t before = impl_->contents.meshes.size(), number = impl_->contents.add_mesh(cells);
    if (number == before) impl_->added(false, false);
    return number;
}

void ResultWriter::frame(const Record& frame) {
    check_record(frame, impl_->contents.meshes, "frame");
    impl_->refuse_if_finished();
    impl_->contents.frames.push_back(frame);
    impl_->added(false, false);
}

void ResultWriter::checkpoint(const Record& state) {
    check_record(state, impl_->contents.meshes, "checkpoint");
    impl_->refuse_if_finished();
    impl_->contents.checkpoint = state;
    impl_->added(false, true);
}

void ResultWriter::discard() {
    impl_->refuse_if_finished();
    impl_->contents.forget();
    impl_->has_other_segments = true;
    impl_->resumed = false;  // it begins again
    impl_->added(false, false);
}

void ResultWriter::finish(const About& more) {
    check_about(more);
    impl_->refuse_if_finished();
    update(impl_->contents.about, more);
    impl_->contents.segments.clear();  // one file again
    impl_->has_other_segments = true;
    impl_->write_file();
    impl_->file.release();
    impl_->finished = true;
}

bool is_point_data(const Array& array, const SurfaceCells& mesh) {
    if (array.name == "points" || array.name.starts_with("restart_")) return false;
    const auto& shape = array.shape;
    if (shape.empty() || shape[0] != mesh.nodes) return false;
    return shape.size() == 1 || (shape.size() == 2 && (shape[1] == 3 || shape[1] == 6));
}

Result read_result(const fs::path& file) {
    return read_hdf5(file);
}

CaseText read_case_text(const fs::path& file) {
    return read_hdf5_case(file);
}

}  // namespace tubule
