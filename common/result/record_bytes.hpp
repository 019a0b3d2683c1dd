// Values, records and meshes as bytes, for ranks and for what a case reads.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/result/result.hpp"

namespace tubule {

// In the byte order of the machine (little-endian).
using Bytes = std::vector<std::byte>;

inline void put(Bytes& out, std::span<const std::byte> bytes) {
    out.insert(out.end(), bytes.begin(), bytes.end());
}
inline void put(Bytes& out, std::span<const double> values) {
    put(out, std::as_bytes(values));
}
inline void put(Bytes& out, double value) {
    put(out, std::as_bytes(std::span(&value, 1)));
}
inline void put(Bytes& out, std::uint64_t value) {
    put(out, std::as_bytes(std::span(&value, 1)));
}
inline void put(Bytes& out, const std::string& text) {
    put(out, std::uint64_t{text.size()});
    put(out, std::as_bytes(std::span(text)));
}
template <class T>
void put_list(Bytes& out, const std::vector<T>& values) {
    put(out, std::uint64_t{values.size()});
    put(out, std::as_bytes(std::span(values)));
}

// Takes values from the front. Checksums have been found right, so running over the end is a fault of the program that
// wrote them; throws std::runtime_error.
class Payload {
public:
    explicit Payload(std::span<const std::byte> bytes) : rest_(bytes) {}

    bool empty() const { return rest_.empty(); }
    std::span<const std::byte> take(std::size_t n) {
        if (n > rest_.size()) throw std::runtime_error("a record is shorter than its stated length");
        const auto taken = rest_.first(n);
        rest_ = rest_.subspan(n);
        return taken;
    }
    template <class T>
    T get() {
        T value;
        std::memcpy(&value, take(sizeof(T)).data(), sizeof(T));
        return value;
    }
    std::string text() {
        const auto bytes = take(get<std::uint64_t>());
        return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
    }
    template <class T>
    std::vector<T> values(std::size_t n) {
        if (n > rest_.size() / sizeof(T)) throw std::runtime_error("a record is shorter than its stated length");
        const auto bytes = take(n * sizeof(T));
        std::vector<T> out(n);
        if (n > 0) std::memcpy(out.data(), bytes.data(), bytes.size());
        return out;
    }
    template <class T>
    std::vector<T> list() {
        return values<T>(get<std::uint64_t>());
    }

private:
    std::span<const std::byte> rest_;
};

void put(Bytes& out, const Record& record);
void put(Bytes& out, const SurfaceCells& mesh);
void put(Bytes& out, const CaseInputs& inputs);

// Throw as Payload.
Record get_record(Payload& in);
SurfaceCells get_mesh(Payload& in);
CaseInputs get_inputs(Payload& in);

}  // namespace tubule
