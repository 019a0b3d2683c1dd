#include "common/result/record_bytes.hpp"

#include <utility>

#include "common/result/contents.hpp"

namespace tubule {

namespace {

// In place of the number of a mesh.
constexpr std::uint64_t no_mesh = ~std::uint64_t{0};

}  // namespace

void put(Bytes& out, const Record& record) {
    put(out, record.time);
    put(out, std::uint64_t{record.numbers.size()});
    for (const auto& [name, value] : record.numbers) {
        put(out, name);
        put(out, value);
    }
    put(out, std::uint64_t{record.arrays.size()});
    for (const Array& array : record.arrays) {
        put(out, array.name);
        put(out, std::uint64_t{array.shape.size()});
        for (const std::size_t extent : array.shape) put(out, std::uint64_t{extent});
        put_list(out, array.data);
    }
    if (!record.mesh && !record.kind) return;
    put(out, record.mesh ? std::uint64_t{*record.mesh} : no_mesh);
    if (record.kind) put(out, std::string(name(*record.kind)));
}

Record get_record(Payload& in) {
    Record record;
    record.time = in.get<double>();
    for (auto n = in.get<std::uint64_t>(); n > 0; --n) {
        auto name = in.text();
        record.numbers.emplace_back(std::move(name), in.get<double>());
    }
    for (auto n = in.get<std::uint64_t>(); n > 0; --n) {
        Array array;
        array.name = in.text();
        for (auto rank = in.get<std::uint64_t>(); rank > 0; --rank) array.shape.push_back(in.get<std::uint64_t>());
        array.data = in.list<double>();
        record.arrays.push_back(std::move(array));
    }
    if (!in.empty())
        if (const auto mesh = in.get<std::uint64_t>(); mesh != no_mesh) record.mesh = mesh;
    if (!in.empty()) record.kind = record_kind(in.text());
    return record;
}

void put(Bytes& out, const SurfaceCells& mesh) {
    put(out, static_cast<std::uint64_t>(mesh.order));
    put(out, std::uint64_t{mesh.nodes});
    put(out, mesh.period);
    put_list(out, mesh.cells);
    put_list(out, mesh.shifts);
}

SurfaceCells get_mesh(Payload& in) {
    SurfaceCells mesh;
    mesh.order = static_cast<int>(in.get<std::uint64_t>());
    mesh.nodes = in.get<std::uint64_t>();
    mesh.period = in.get<double>();
    mesh.cells = in.list<int>();
    mesh.shifts = in.list<int>();
    return mesh;
}

void put(Bytes& out, const CaseInputs& inputs) {
    put(out, std::uint64_t{inputs.size()});
    for (const auto& input : inputs) {
        put(out, input->name);
        put(out, input->size);
        put(out, std::uint64_t{input->crc});
        put(out, input->bytes);
    }
}

CaseInputs get_inputs(Payload& in) {
    CaseInputs out;
    for (auto n = in.get<std::uint64_t>(); n > 0; --n) {
        CaseInput input;
        input.name = in.text();
        input.size = in.get<std::uint64_t>(), input.crc = static_cast<std::uint32_t>(in.get<std::uint64_t>());
        input.bytes = in.text();
        out.push_back(std::make_shared<const CaseInput>(std::move(input)));
    }
    return out;
}

}  // namespace tubule
