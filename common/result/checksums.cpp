#include "common/result/checksums.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <optional>
#include <stdexcept>

#include "common/result/durable_io.hpp"

namespace tubule {

namespace {

// Eight tables take eight bytes a turn.
constexpr auto crc_tables = [] {
    std::array<std::array<std::uint32_t, 256>, 8> t{};
    for (std::uint32_t i = 0; i < 256; ++i) {
        std::uint32_t c = i;
        for (int bit = 0; bit < 8; ++bit) c = (c & 1) ? 0xEDB88320u ^ (c >> 1) : c >> 1;
        t[0][i] = c;
    }
    for (std::size_t k = 1; k < 8; ++k)
        for (std::size_t i = 0; i < 256; ++i) t[k][i] = t[0][t[k - 1][i] & 0xFF] ^ (t[k - 1][i] >> 8);
    return t;
}();

constexpr std::array<char, 8> seal_magic{'T', 'U', 'B', 'U', 'L', 'E', 'C', '1'};

struct Seal {
    std::array<char, 8> magic;
    std::uint64_t hdf5_size, between_size;
    std::uint32_t hdf5_crc, between_crc;

    bool operator==(const Seal&) const = default;
};

// The bytes of an open file. Throws durable::Error.
class Source {
public:
    explicit Source(int descriptor) : fd_(descriptor) {
        struct stat info {};
        if (::fstat(fd_, &info) != 0) durable::fail("read", "the file", errno);
        size_ = static_cast<std::uint64_t>(info.st_size);
    }
    std::uint64_t size() const { return size_; }
    void read(std::uint64_t offset, std::span<std::byte> into) const {
        while (!into.empty()) {
            const ssize_t n = ::pread(fd_, into.data(), into.size(), static_cast<off_t>(offset));
            if (n < 0 && errno == EINTR) continue;
            if (n <= 0) durable::fail("read", "the file", n < 0 ? errno : EIO);
            offset += static_cast<std::uint64_t>(n);
            into = into.subspan(static_cast<std::size_t>(n));
        }
    }
    template <class T>
    std::optional<T> at(std::uint64_t offset) const {
        if (offset > size_ || size_ - offset < sizeof(T)) return std::nullopt;
        T value;
        read(offset, std::as_writable_bytes(std::span(&value, 1)));
        return value;
    }
    std::uint32_t crc(std::uint64_t offset, std::uint64_t size) const {
        std::vector<std::byte> buffer(std::min<std::uint64_t>(size, 1 << 18));
        std::uint32_t sum = 0;
        while (size > 0) {
            const auto part = std::span(buffer).first(std::min<std::uint64_t>(size, buffer.size()));
            read(offset, part);
            sum = crc32(sum, part);
            offset += part.size(), size -= part.size();
        }
        return sum;
    }

private:
    int fd_;
    std::uint64_t size_ = 0;
};

// Where the file ends for HDF5, by its superblock; nothing if this is not HDF5, or not as HDF5 writes it by default.
std::optional<std::uint64_t> hdf5_end(const Source& file) {
    constexpr std::array<unsigned char, 8> signature{0x89, 'H', 'D', 'F', '\r', '\n', 0x1a, '\n'};
    if (file.at<std::array<unsigned char, 8>>(0) != signature) return std::nullopt;
    const auto version = file.at<std::uint8_t>(8);
    if (!version || *version > 3) return std::nullopt;
    return file.at<std::uint64_t>(*version == 0 ? 40 : *version == 1 ? 44 : 28);
}

std::optional<Seal> seal_at(const Source& file, std::uint64_t offset) {
    const auto found = file.at<Seal>(offset);
    if (!found || found->magic != seal_magic) return std::nullopt;
    const std::uint64_t rest = file.size() - std::min<std::uint64_t>(file.size(), 2 * sizeof(Seal));
    if (found->hdf5_size > rest || found->between_size != rest - found->hdf5_size) return std::nullopt;
    return found;
}

Wholeness unsealed(const Source& file) {
    const auto end = hdf5_end(file);
    if (!end) return {Wholeness::Kind::foreign, ""};
    if (*end == file.size()) return {Wholeness::Kind::unsealed, ""};
    return {Wholeness::Kind::damaged, *end > file.size()
                                          ? fmt::format("it is cut off: {} of {} bytes are there", file.size(), *end)
                                          : "its checksums are damaged"};
}

}  // namespace

std::uint32_t crc32(std::uint32_t crc, std::span<const std::byte> bytes) {
    const auto& t = crc_tables;
    crc = ~crc;
    const std::byte* p = bytes.data();
    std::size_t n = bytes.size();
    for (; n >= 8; n -= 8, p += 8) {
        std::uint64_t word;  // little-endian, as every machine this is built for
        std::memcpy(&word, p, 8);
        word ^= crc;
        crc = 0;
        for (std::size_t k = 0; k < 8; ++k) crc ^= t[7 - k][(word >> (8 * k)) & 0xFF];
    }
    for (; n > 0; --n, ++p) crc = t[0][(crc ^ std::to_integer<std::uint32_t>(*p)) & 0xFF] ^ (crc >> 8);
    return ~crc;
}

std::uint32_t seal(std::vector<std::byte>& hdf5) {
    const Seal seal{seal_magic, hdf5.size(), 0, crc32(0, hdf5), 0};
    const auto bytes = std::as_bytes(std::span(&seal, 1));
    for (int i = 0; i < 2; ++i) hdf5.insert(hdf5.end(), bytes.begin(), bytes.end());
    return seal.hdf5_crc;
}

Wholeness examine(int descriptor) {
    const Source file(descriptor);
    const auto back = file.size() >= sizeof(Seal) ? seal_at(file, file.size() - sizeof(Seal)) : std::nullopt;
    const auto front = seal_at(file, back ? back->hdf5_size : hdf5_end(file).value_or(file.size()));
    const auto& seal = back ? back : front;
    if (!seal) return unsealed(file);
    if (file.crc(0, seal->hdf5_size) != seal->hdf5_crc)
        return {Wholeness::Kind::damaged, "it is damaged: its checksum is wrong"};
    const bool rest_is_good =
        front == back && file.crc(seal->hdf5_size + sizeof(Seal), seal->between_size) == seal->between_crc;
    return rest_is_good ? Wholeness{Wholeness::Kind::whole, "", seal->hdf5_crc}
                        : Wholeness{Wholeness::Kind::damaged, "its checksums are damaged"};
}

Wholeness examine(const std::filesystem::path& file) {
    if (std::filesystem::exists(file) && !std::filesystem::is_regular_file(file))
        throw std::runtime_error(fmt::format("{}: not a regular file", file.string()));
    return examine(durable::File(file, O_RDONLY).descriptor());
}

bool require_whole(int descriptor, const std::filesystem::path& file) {
    const Wholeness found = examine(descriptor);
    if (found.kind == Wholeness::Kind::damaged)
        throw std::runtime_error(
            fmt::format("{}; bring back a copy, or run its case again (docs/stopped_runs.md)", found.damage));
    static std::atomic_flag warned;
    if (found.kind == Wholeness::Kind::unsealed && !warned.test_and_set())
        std::fputs(fmt::format("warning: {} has no checksums (it is of an earlier version, or another program has "
                               "changed it): damage may go unnoticed\n",
                               file.string())
                       .c_str(),
                   stderr);
    return found.kind == Wholeness::Kind::whole;
}

}  // namespace tubule
