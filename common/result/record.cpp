#include "common/result/record.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "common/result/hdf5_file.hpp"

namespace tubule {

namespace {

// In the order of RecordKind.
constexpr std::string_view kind_names[] = {"graph", "curve", "equilibrium", "surface"};

[[noreturn]] void refuse(const std::string& what) {
    throw std::runtime_error(fmt::format("cannot resume from this frame: {}; run the case without --resume", what));
}

[[noreturn]] void missing(const std::string& name) {
    refuse(fmt::format("{} is missing; results of other versions may not have it", name));
}

}  // namespace

std::string_view name(RecordKind kind) {
    return kind_names[static_cast<std::size_t>(kind)];
}

RecordKind record_kind(std::string_view name) {
    const auto found = std::find(std::begin(kind_names), std::end(kind_names), name);
    if (found == std::end(kind_names)) throw std::runtime_error(fmt::format("\"{}\" is not a kind of frame", name));
    return static_cast<RecordKind>(found - std::begin(kind_names));
}

RecordKind kind_of(const Record& record) {
    if (record.kind) return *record.kind;
    if (record.mesh) return RecordKind::surface;
    if (find_array(record, "restart_y")) return RecordKind::curve;
    return find_array(record, "knots") ? RecordKind::graph : RecordKind::equilibrium;
}

const Array* find_array(const Record& record, std::string_view name) {
    const auto found = std::find_if(record.arrays.begin(), record.arrays.end(),
                                    [&](const Array& array) { return array.name == name; });
    return found == record.arrays.end() ? nullptr : &*found;
}

std::optional<double> find_number(const Record& record, std::string_view name) {
    for (const auto& [key, value] : record.numbers)
        if (key == name) return value;
    return std::nullopt;
}

Array array(const std::string& name, std::vector<double> values) {
    return {name, {values.size()}, std::move(values)};
}

RecordReader::RecordReader(const Record& record, RecordKind kind) : record_(record) {
    if (kind_of(record) != kind) refuse(fmt::format("its kind is {}, not {}", name(kind_of(record)), name(kind)));
}

double RecordReader::number_of(const std::string& name) const {
    const std::optional<double> found = find_number(record_, name);
    if (!found) missing(name);
    if (!std::isfinite(*found)) refuse(fmt::format("{} is {}", name, *found));
    return *found;
}

int RecordReader::integer_of(const std::string& name) const {
    const double found = number_of(name);
    if (std::abs(found) > std::numeric_limits<int>::max() || found != std::trunc(found))
        refuse(fmt::format("{} must be an integer, not {}", name, found));
    return static_cast<int>(found);
}

const std::vector<double>& RecordReader::data_of(const std::string& name, std::optional<Eigen::Index> count,
                                                 std::size_t width) const {
    const Array* found = find_array(record_, name);
    if (!found) missing(name);
    std::vector<std::size_t> expected{count ? static_cast<std::size_t>(*count) : found->data.size() / width};
    if (width > 1) expected.push_back(width);
    if (found->shape != expected || found->data.size() != expected[0] * width)
        refuse(fmt::format("{} has shape {}, not {}", name, found->shape, expected));
    return found->data;
}

void RecordReader::array(const std::string& name, std::vector<double>& values,
                         std::optional<Eigen::Index> count) const {
    values = data_of(name, count, 1);
}
void RecordReader::array(const std::string& name, Eigen::VectorXd& values, std::optional<Eigen::Index> count) const {
    const std::vector<double>& data = data_of(name, count, 1);
    values = Eigen::Map<const Eigen::VectorXd>(data.data(), static_cast<Eigen::Index>(data.size()));
}
void RecordReader::array(const std::string& name, Eigen::Matrix3Xd& values, std::optional<Eigen::Index> count) const {
    const std::vector<double>& data = data_of(name, count, 3);
    values = Eigen::Map<const Eigen::Matrix3Xd>(data.data(), 3, static_cast<Eigen::Index>(data.size() / 3));
}

void nest(Record& in, const std::string& prefix, Record inner) {
    in.numbers.emplace_back(prefix + "time", inner.time);
    for (auto& [name, value] : inner.numbers) in.numbers.emplace_back(prefix + name, value);
    for (Array& a : inner.arrays) in.arrays.push_back({prefix + a.name, std::move(a.shape), std::move(a.data)});
}

Record nested(const Record& record, const std::string& prefix, RecordKind kind) {
    Record out;
    RecordReader(record).number(prefix + "time", out.time);
    out.kind = kind;
    for (const auto& [name, value] : record.numbers)
        if (name.starts_with(prefix)) out.numbers.emplace_back(name.substr(prefix.size()), value);
    for (const Array& a : record.arrays)
        if (a.name.starts_with(prefix)) out.arrays.push_back({a.name.substr(prefix.size()), a.shape, a.data});
    return out;
}

}  // namespace tubule
