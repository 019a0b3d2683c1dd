#include "common/result/result_index.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <utility>

#include "common/result/record_bytes.hpp"
#include "common/result/vtk_grid.hpp"

namespace tubule {

namespace {

using tubule::put;

const std::string kind_of_index = "result 1";
constexpr double lost = std::numeric_limits<double>::quiet_NaN();

// ---- writing

void put(Bytes& out, const std::vector<std::string>& texts) {
    put(out, std::uint64_t{texts.size()});
    for (const std::string& text : texts) put(out, text);
}

void put(Bytes& out, const About& about) {
    put(out, std::uint64_t{about.size()});
    for (const auto& [name, value] : about) {
        put(out, name);
        put(out, std::uint64_t{value.index()});
        if (const auto* integer = std::get_if<std::int64_t>(&value)) put(out, static_cast<std::uint64_t>(*integer));
        if (const auto* number = std::get_if<double>(&value)) put(out, *number);
        if (const auto* text = std::get_if<std::string>(&value)) put(out, *text);
    }
}

// Without the numbers.
void put_outline(Bytes& out, const Record& record) {
    Record outline{record.time, record.numbers, {}, record.mesh, record.kind};
    for (const Array& array : record.arrays) outline.arrays.push_back({array.name, array.shape, {}});
    Bytes bytes;
    put(bytes, outline);
    put_list(out, bytes);
}

// ---- reading

std::vector<std::string> get_texts(Payload& in) {
    std::vector<std::string> texts;
    for (auto n = in.get<std::uint64_t>(); n > 0; --n) texts.push_back(in.text());
    return texts;
}

About get_about(Payload& in) {
    About about;
    for (auto n = in.get<std::uint64_t>(); n > 0; --n) {
        std::string name = in.text();
        switch (in.get<std::uint64_t>()) {
            case 0:
                about.emplace_back(std::move(name), in.get<std::int64_t>());
                break;
            case 1:
                about.emplace_back(std::move(name), in.get<double>());
                break;
            default:
                about.emplace_back(std::move(name), in.text());
        }
    }
    return about;
}

Record get_outline(Payload& in) {
    const Bytes bytes = in.list<std::byte>();
    Payload outline(bytes);
    return get_record(outline);
}

// Takes the extents in their order, and from the file what is good of them.
class Datasets {
public:
    Datasets(Payload& in, std::span<const std::byte> file) : in_(in), file_(file) {}

    std::vector<double> numbers() { return next<double>(lost); }
    // Empty if any is lost.
    std::vector<std::int64_t> integers() {
        std::vector<std::int64_t> values = next<std::int64_t>(0);
        if (!whole_) values.clear();
        return values;
    }

private:
    template <class T>
    std::vector<T> next(T unknown) {
        const auto offset = in_.get<std::uint64_t>(), size = in_.get<std::uint64_t>();
        const auto crcs = in_.list<std::uint32_t>();
        if (size % sizeof(T) != 0 || crcs.size() != size / Extent::chunk + (size % Extent::chunk != 0))
            throw std::runtime_error("its index does not fit its checksums");
        std::vector<T> values(size / sizeof(T), unknown);
        whole_ = true;
        for (std::size_t i = 0; i < crcs.size(); ++i) {
            const std::size_t from = i * Extent::chunk, n = std::min(Extent::chunk, size - from);
            const bool there = offset <= file_.size() && from + n <= file_.size() - offset;
            const auto bytes = there ? file_.subspan(offset + from, n) : std::span<const std::byte>{};
            const bool good = there && crc32(0, bytes) == crcs[i];
            if (good) std::memcpy(values.data() + from / sizeof(T), bytes.data(), n);
            whole_ = whole_ && good;
        }
        return values;
    }

    Payload& in_;
    std::span<const std::byte> file_;
    bool whole_ = true;
};

void fill(Record& record, Datasets& datasets) {
    for (Array& array : record.arrays) {
        array.data = datasets.numbers();
        std::size_t size = 1;
        for (const std::size_t extent : array.shape) size *= extent;
        if (array.data.size() != size)
            throw std::runtime_error(fmt::format("in its index the shape of {} does not fit its size", array.name));
    }
}

void fill(SurfaceCells& mesh, Datasets& datasets) {
    const auto connectivity = datasets.integers();
    std::vector<std::int64_t> node, shift;
    if (mesh.period > 0) node = datasets.integers(), shift = datasets.integers();
    const bool good = !connectivity.empty() && (mesh.period == 0 || (!node.empty() && !shift.empty()));
    if (good) set_cells(mesh, connectivity, node, shift, "of the index");
}

// ---- what is lost

bool has_lost(const std::vector<double>& values) {
    return std::any_of(values.begin(), values.end(), [](double x) { return std::isnan(x); });
}

// Of a frame or checkpoint, in words; empty if it is whole.
std::string lost_of(const Record& record, const std::vector<SurfaceCells>& meshes) {
    std::vector<std::string> parts;
    if (record.mesh && (*record.mesh >= meshes.size() || meshes[*record.mesh].cells.empty()))
        parts.push_back(fmt::format("mesh {}", *record.mesh));
    for (const Array& array : record.arrays)
        if (has_lost(array.data)) parts.push_back(array.name);
    return fmt::format("{}", fmt::join(parts, ", "));
}

// "rows 512 to 1023: energy, area"
void drop_rows(Contents& contents, std::vector<std::string>& words) {
    const std::size_t width = contents.series.size();
    std::vector<double> good;
    std::vector<std::string> names;  // of what the present rows lack
    std::size_t first = 0;
    const auto say = [&](std::size_t end) {
        if (!names.empty()) words.push_back(fmt::format("rows {} to {}: {}", first, end - 1, fmt::join(names, ", ")));
    };
    const std::size_t rows = contents.rows.size() / width;
    for (std::size_t i = 0; i < rows; ++i) {
        const auto row = std::span(contents.rows).subspan(i * width, width);
        std::vector<std::string> here;
        for (std::size_t j = 0; j < width; ++j)
            if (std::isnan(row[j])) here.push_back(contents.series[j]);
        if (here.empty()) good.insert(good.end(), row.begin(), row.end());
        if (here == names) continue;
        say(i);
        names = std::move(here), first = i;
    }
    say(rows);
    contents.rows = std::move(good);
}

// Series that lack more than half of their numbers: to drop them costs less than to drop the rows that lack them.
// Without its times a row means nothing, and without all series no run goes on.
void drop_series(Contents& contents, std::vector<std::string>& words) {
    const std::size_t width = contents.series.size(), rows = contents.rows.size() / width;
    std::vector<std::size_t> kept;
    for (std::size_t j = 0; j < width; ++j) {
        std::size_t lost = 0;
        for (std::size_t i = 0; i < rows; ++i) lost += std::isnan(contents.rows[i * width + j]);
        if (contents.series[j] == "time" || 2 * lost <= rows)
            kept.push_back(j);
        else
            words.push_back(fmt::format("series {}: {} of {} rows", contents.series[j], lost, rows));
    }
    if (kept.size() == width) return;
    std::vector<double> good;
    for (std::size_t i = 0; i < rows; ++i)
        for (const std::size_t j : kept) good.push_back(contents.rows[i * width + j]);
    std::vector<std::string> names;
    for (const std::size_t j : kept) names.push_back(contents.series[j]);
    contents.rows = std::move(good), contents.series = std::move(names);
    if (contents.checkpoint) words.push_back("checkpoint: a run goes on with all of its series only");
    contents.checkpoint.reset();
}

void drop_meshes(Contents& contents) {
    std::vector<Record*> records;
    for (Record& frame : contents.frames) records.push_back(&frame);
    if (contents.checkpoint) records.push_back(&*contents.checkpoint);
    std::vector<SurfaceCells> kept;
    std::vector<std::optional<std::size_t>> number(contents.meshes.size());
    for (Record* record : records) {
        if (!record->mesh) continue;
        auto& mine = number[*record->mesh];
        if (!mine) {
            mine = kept.size();
            kept.push_back(contents.meshes[*record->mesh]);
        }
        record->mesh = mine;
    }
    contents.meshes = std::move(kept);
}

}  // namespace

Bytes index_of(const Contents& contents, const std::vector<Extent>& extents) {
    Bytes out;
    put(out, std::as_bytes(std::span(kind_of_index)));
    for (const std::uint64_t number : {contents.id, contents.sequence, contents.about_begun}) put(out, number);
    put(out, contents.case_text.text);
    put(out, contents.case_text.sets);
    put(out, contents.about);
    put(out, contents.series);
    put(out, std::uint64_t{contents.meshes.size()});
    for (const SurfaceCells& mesh : contents.meshes)
        put(out, SurfaceCells{mesh.order, mesh.nodes, {}, mesh.period, {}});
    put(out, std::uint64_t{contents.frames.size()});
    for (const Record& frame : contents.frames) put_outline(out, frame);
    put(out, std::uint64_t{contents.checkpoint.has_value()});
    if (contents.checkpoint) put_outline(out, *contents.checkpoint);
    for (const Extent& extent : extents) {
        put(out, extent.offset);
        put(out, extent.size);
        put_list(out, extent.crcs);
    }
    if (!contents.case_text.inputs.empty()) put(out, contents.case_text.inputs);  // last: earlier versions lack them
    return out;
}

Contents contents_by_index(std::span<const std::byte> index, std::span<const std::byte> file) {
    const auto kind = std::as_bytes(std::span(kind_of_index));
    if (index.size() < kind.size() || !std::equal(kind.begin(), kind.end(), index.begin()))
        throw std::runtime_error("it is a scan, or of a later version: nothing of it can be rescued");
    Payload in(index.subspan(kind.size()));
    Contents contents;
    for (std::uint64_t* number : {&contents.id, &contents.sequence, &contents.about_begun})
        *number = in.get<std::uint64_t>();
    contents.case_text.text = in.text();
    contents.case_text.sets = get_texts(in);
    contents.about = get_about(in);
    contents.series = get_texts(in);
    if (contents.series.empty()) throw std::runtime_error("its index has no series");
    for (auto n = in.get<std::uint64_t>(); n > 0; --n) contents.meshes.push_back(get_mesh(in));
    for (auto n = in.get<std::uint64_t>(); n > 0; --n) contents.frames.push_back(get_outline(in));
    if (in.get<std::uint64_t>() != 0) contents.checkpoint = get_outline(in);

    Datasets datasets(in, file);
    const std::size_t width = contents.series.size();
    for (std::size_t j = 0; j < width; ++j) {
        const std::vector<double> column = datasets.numbers();
        contents.rows.resize(width * column.size());
        for (std::size_t i = 0; i < column.size(); ++i) contents.rows[i * width + j] = column[i];
    }
    for (SurfaceCells& mesh : contents.meshes) fill(mesh, datasets);
    for (Record& frame : contents.frames) fill(frame, datasets);
    if (contents.checkpoint) fill(*contents.checkpoint, datasets);
    if (!in.empty()) contents.case_text.inputs = get_inputs(in);
    return contents;
}

std::vector<std::string> drop_what_is_lost(Contents& contents) {
    std::vector<std::string> words;
    drop_series(contents, words);
    drop_rows(contents, words);
    std::vector<Record> good;
    for (std::size_t i = 0; i < contents.frames.size(); ++i) {
        const std::string parts = lost_of(contents.frames[i], contents.meshes);
        if (parts.empty())
            good.push_back(std::move(contents.frames[i]));
        else
            words.push_back(fmt::format("frame {}: {}", i, parts));
    }
    contents.frames = std::move(good);
    if (contents.checkpoint)
        if (const std::string parts = lost_of(*contents.checkpoint, contents.meshes); !parts.empty()) {
            words.push_back(fmt::format("checkpoint: {}", parts));
            contents.checkpoint.reset();
        }
    drop_meshes(contents);
    return words;
}

}  // namespace tubule
