#include "common/result/start_frame.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "common/case/input_file.hpp"
#include "common/case/read.hpp"
#include "common/result/checksums.hpp"
#include "common/result/frame_profile.hpp"
#include "common/result/hdf5_file.hpp"

namespace tubule {
namespace {

constexpr std::size_t most_kept = 64 * 1024, most_read = 512 * megabyte;

bool is_of_run(const std::string& name) {
    return name.starts_with("restart_");
}

StartFrame without_restart(Record frame, const std::vector<SurfaceCells>& meshes) {
    StartFrame out{std::move(frame), {}};
    std::erase_if(out.record.numbers, [](const auto& number) { return is_of_run(number.first); });
    std::erase_if(out.record.arrays, [](const Array& array) { return is_of_run(array.name); });
    out.record.kind = kind_of(out.record);
    if (out.record.mesh) out.cells = meshes.at(*std::exchange(out.record.mesh, 0));
    return out;
}

StartFrame read_frame(const Case& c, const ResultFrame& from) {
    Result result;
    try {
        result = read_result(beside(c, from.path));
    } catch (const std::runtime_error& error) {
        throw complaint(c, "shape.path", fmt::format("cannot be used: {}", error.what()));
    }
    const int count = static_cast<int>(result.frames.size()), number = from.frame < 0 ? count + from.frame : from.frame;
    if (number < 0 || number >= count)
        throw complaint(c, "shape.frame",
                        fmt::format("must be one of the {} frames of {}, not {}", count, from.path, from.frame));
    return without_restart(std::move(result.frames[number]), result.meshes);
}

// ---- a frame as bytes, in the byte order of the machine (little-endian): written and read by one list of fields

struct ToBytes {
    std::string bytes;
    bool more() const { return true; }
    void raw(const void* data, std::size_t size) { bytes.append(static_cast<const char*>(data), size); }
    template <class List>
    void resize(List&, std::uint64_t) const {}
};

struct FromBytes {
    std::string_view rest;
    bool more() const { return !rest.empty(); }
    void raw(void* data, std::size_t size) {
        require(size);
        std::memcpy(data, rest.data(), size);
        rest.remove_prefix(size);
    }
    template <class List>
    void resize(List& list, std::uint64_t size) const {
        require(size);  // each entry has a byte at least
        list.resize(size);
    }
    // Its checksum has been found right: running over the end is a fault of the program that wrote it.
    void require(std::uint64_t size) const {
        if (size > rest.size()) throw std::runtime_error("a record is shorter than its stated length");
    }
};

template <class Bytes, class List, class Entry>
void put_list(Bytes& b, List& list, const Entry& entry) {
    std::uint64_t size = list.size();
    b.raw(&size, sizeof size);
    b.resize(list, size);
    for (auto& one : list) entry(one);
}
template <class Bytes, class List>
void put_values(Bytes& b, List& list) {  // of numbers or characters
    put_list(b, list, [&](auto& one) { b.raw(&one, sizeof one); });
}

template <class Bytes>
void put_fields(Bytes& b, StartFrame& frame) {
    constexpr std::uint64_t no_mesh = ~std::uint64_t{0};
    Record& record = frame.record;
    b.raw(&record.time, sizeof record.time);
    put_list(b, record.numbers, [&](auto& number) {
        put_values(b, number.first);
        b.raw(&number.second, sizeof number.second);
    });
    put_list(b, record.arrays, [&](Array& array) {
        put_values(b, array.name);
        put_values(b, array.shape);
        put_values(b, array.data);
    });
    std::uint64_t mesh = record.mesh.value_or(no_mesh);
    if (b.more()) b.raw(&mesh, sizeof mesh);
    if (mesh != no_mesh) record.mesh = mesh;
    std::string kind(record.kind ? name(*record.kind) : "");
    if (b.more()) put_values(b, kind);
    if (!kind.empty()) record.kind = record_kind(kind);
    if (mesh == no_mesh || !b.more()) return;
    SurfaceCells& cells = frame.cells ? *frame.cells : frame.cells.emplace();
    std::uint64_t order = cells.order, nodes = cells.nodes;
    b.raw(&order, sizeof order), b.raw(&nodes, sizeof nodes), b.raw(&cells.period, sizeof cells.period);
    cells.order = static_cast<int>(order), cells.nodes = nodes;
    put_values(b, cells.cells);
    put_values(b, cells.shifts);
}

std::string to_bytes(StartFrame frame) {
    ToBytes out;
    put_fields(out, frame);
    return std::move(out.bytes);
}

StartFrame from_bytes(const std::string& bytes) {
    FromBytes in{bytes};
    StartFrame out;
    put_fields(in, out);
    return out;
}

// ----

// Whether there is a file where the shape comes from, readable or not.
bool has_file(const Case& c) {
    return std::visit(
        [&](const auto& shape) {
            if constexpr (requires { shape.path; }) return std::filesystem::exists(beside(c, shape.path));
            return false;
        },
        c.shape);
}

}  // namespace

StartFrame start_frame(const Case& c) {
    if (c.input && !c.input->bytes.empty()) return from_bytes(c.input->bytes);
    return read_frame(c, std::get<ResultFrame>(c.shape));
}

PerturbedCurve disturbed_curve(const Case& c, const Record& frame) {
    const auto& from = std::get<ResultFrame>(c.shape);
    const PerturbedCurve curve = frame_curve(frame);
    if (from.modes.empty()) return curve;
    try {
        return disturbed(curve, from);
    } catch (const std::invalid_argument& error) {
        throw complaint(c, c.places.contains("shape.mode") ? "shape.mode" : "shape.noise", error.what());
    }
}

std::shared_ptr<const CaseInput> frame_as_input(const ResultFrame& shape, const Result& result) {
    const std::size_t number = shape.frame < 0 ? result.frames.size() + shape.frame : shape.frame;
    CaseInput out;
    out.name = input_name(shape);
    out.bytes = to_bytes(without_restart(result.frames.at(number), result.meshes));
    out.size = out.bytes.size(), out.crc = crc32(0, std::as_bytes(std::span(out.bytes)));
    return std::make_shared<const CaseInput>(std::move(out));
}

std::shared_ptr<const CaseInput> current_input(const Case& c) {
    CaseInput out;
    out.name = input_name(c.shape);
    if (out.name.empty()) return nullptr;
    try {
        if (const auto* from = std::get_if<ResultFrame>(&c.shape))
            out.bytes = to_bytes(read_frame(c, *from));
        else
            std::visit(
                [&](const auto& shape) {
                    if constexpr (requires { shape.path; }) out.bytes = read_input(beside(c, shape.path), most_read);
                },
                c.shape);
    } catch (const std::runtime_error&) {
        return nullptr;
    }
    out.size = out.bytes.size(), out.crc = crc32(0, std::as_bytes(std::span(out.bytes)));
    if (out.size > most_kept) out.bytes.clear();
    return std::make_shared<const CaseInput>(std::move(out));
}

std::string changed_input(const Case& c, const CaseInputs& of_result) {
    const auto name = input_name(c.shape);
    const auto old = std::ranges::find(of_result, name, [](const auto& input) { return input->name; });
    if (name.empty() || old == of_result.end()) return {};
    const auto now = current_input(c);
    if (now ? same_input(*now, **old) : !has_file(c)) return {};
    return fmt::format("{} has changed since", name);
}

CaseText kept_case(const Case& c) {
    return {c.text, c.sets, inputs_of(c), effective_toml(c)};
}

std::string resolved_case(const CaseText& c) {
    if (!c.resolved.empty()) return c.resolved;
    try {
        return effective_toml(parse_case(c.text, c.sets, "case", c.inputs));
    } catch (const std::runtime_error&) {
        return {};
    }
}

}  // namespace tubule
