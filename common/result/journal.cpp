#include "common/result/journal.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <string_view>
#include <utility>

namespace tubule {

namespace {

constexpr std::string_view magic = "TUBULEJ1";
constexpr std::size_t header_size = 16;

struct Head {
    std::uint64_t length;
    std::uint64_t sequence;
    std::uint32_t kind;
    std::uint32_t crc;
};
constexpr std::size_t summed_head = offsetof(Head, crc);

// Eight tables process eight bytes at a time: a bytewise CRC would take longer than writing a row.
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

std::uint32_t seed_of(std::uint64_t id) {
    return crc32(0, std::as_bytes(std::span(&id, 1)));
}

std::uint32_t record_crc(std::uint32_t seed, std::span<const std::byte> record) {
    return crc32(crc32(seed, record.first(summed_head)), record.subspan(sizeof(Head)));
}

// Writing of a payload.
void put(std::vector<std::byte>& out, std::span<const std::byte> bytes) {
    out.insert(out.end(), bytes.begin(), bytes.end());
}
void put(std::vector<std::byte>& out, std::span<const double> values) {
    put(out, std::as_bytes(values));
}
void put(std::vector<std::byte>& out, double value) {
    put(out, std::span<const double>(&value, 1));
}
void put(std::vector<std::byte>& out, std::uint64_t value) {
    put(out, std::as_bytes(std::span(&value, 1)));
}
void put(std::vector<std::byte>& out, const std::string& text) {
    put(out, std::uint64_t{text.size()});
    put(out, std::as_bytes(std::span(text)));
}

// In place of the number of a mesh.
constexpr std::uint64_t no_mesh = ~std::uint64_t{0};

// Reading of a payload. Its CRC matched, so reading past its end is a bug in this file.
class Payload {
public:
    explicit Payload(std::span<const std::byte> bytes) : rest_(bytes) {}

    bool empty() const { return rest_.empty(); }
    std::span<const std::byte> take(std::size_t n) {
        if (n > rest_.size()) throw std::runtime_error("a journal record is shorter than its stated length");
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
    std::vector<T> list(std::size_t n) {
        const auto bytes = take(n * sizeof(T));
        std::vector<T> values(n);
        if (n > 0) std::memcpy(values.data(), bytes.data(), bytes.size());
        return values;
    }

private:
    std::span<const std::byte> rest_;
};

void put(std::vector<std::byte>& out, const Record& record) {
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
        put(out, std::uint64_t{array.data.size()});
        put(out, std::span<const double>(array.data));
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
        array.data = in.list<double>(in.get<std::uint64_t>());
        record.arrays.push_back(std::move(array));
    }
    if (!in.empty())
        if (const auto mesh = in.get<std::uint64_t>(); mesh != no_mesh) record.mesh = mesh;
    if (!in.empty()) record.kind = record_kind(in.text());
    return record;
}

void put(std::vector<std::byte>& out, const std::vector<int>& values) {
    put(out, std::uint64_t{values.size()});
    put(out, std::as_bytes(std::span(values)));
}
void put(std::vector<std::byte>& out, const SurfaceCells& mesh) {
    put(out, static_cast<std::uint64_t>(mesh.order));
    put(out, std::uint64_t{mesh.nodes});
    put(out, mesh.period);
    put(out, mesh.cells);
    put(out, mesh.shifts);
}

SurfaceCells get_mesh(Payload& in) {
    SurfaceCells mesh;
    mesh.order = static_cast<int>(in.get<std::uint64_t>());
    mesh.nodes = in.get<std::uint64_t>();
    mesh.period = in.get<double>();
    mesh.cells = in.list<int>(in.get<std::uint64_t>());
    mesh.shifts = in.list<int>(in.get<std::uint64_t>());
    return mesh;
}

void apply(Entry kind, std::span<const std::byte> bytes, Contents& contents) {
    Payload payload(bytes);
    switch (kind) {
        case Entry::row:
            contents.add_row(payload.list<double>(contents.series.size()));
            return;
        case Entry::frame:
            contents.frames.push_back(get_record(payload));
            return;
        case Entry::checkpoint:
            contents.checkpoint = get_record(payload);
            return;
        case Entry::discard:
            contents.forget();
            return;
        case Entry::mesh:
            contents.meshes.push_back(get_mesh(payload));
            return;
        case Entry::point:
            break;  // belongs to a scan
    }
    throw std::runtime_error(fmt::format("a journal record has the unknown kind {}", static_cast<unsigned>(kind)));
}

// Opens and locks. If another writer removed the file in between, it is no longer the journal: try again.
durable::File open_locked(const std::filesystem::path& path) {
    while (true) {
        durable::File file(path, O_RDWR | O_CREAT | O_APPEND);
        // Some network file systems do not support locks; a run is not rejected for that.
        if (::flock(file.descriptor(), LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
            throw std::runtime_error(
                fmt::format("{} is in use: another process is writing this result", path.string()));
        struct stat mine {};
        struct stat named {};
        ::fstat(file.descriptor(), &mine);
        if (::stat(path.c_str(), &named) == 0 && mine.st_ino == named.st_ino && mine.st_dev == named.st_dev)
            return file;
    }
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

std::filesystem::path journal_path(const std::filesystem::path& result) {
    auto path = result;
    path += ".journal";
    return path;
}

Journal::Journal(const std::filesystem::path& result) : file_(open_locked(journal_path(result))) {
    struct stat info {};
    ::fstat(file_.descriptor(), &info);
    size_ = static_cast<std::size_t>(info.st_size);
}

Journal::~Journal() {
    if (file_.is_open() && size_ == 0) ::unlink(file_.path().c_str());
}

void Journal::restart(std::uint64_t id) {
    sound_ = false;
    file_.truncate(0);
    size_ = header_size;  // even if the header fails now: there was a journal, leave its file alone
    std::vector<std::byte> header;
    put(header, std::as_bytes(std::span(magic)));
    put(header, id);
    file_.write(header);
    seed_ = seed_of(id);
    sound_ = true;
}

void Journal::remove() {
    durable::remove(file_.path());
    file_ = {};
}

void Journal::begin(Entry kind) {
    buffer_.resize(sizeof(Head));
    const Head head{0, 0, static_cast<std::uint32_t>(kind), 0};
    std::memcpy(buffer_.data(), &head, sizeof(Head));
}

void Journal::commit(std::uint64_t sequence) {
    if (!sound_) throw durable::Error(fmt::format("{} was damaged by an earlier error", file_.path().string()));
    Head head;
    std::memcpy(&head, buffer_.data(), sizeof(Head));
    head.length = buffer_.size() - sizeof(Head);
    head.sequence = sequence;
    std::memcpy(buffer_.data(), &head, sizeof(Head));
    head.crc = record_crc(seed_, buffer_);
    std::memcpy(buffer_.data(), &head, sizeof(Head));
    try {
        file_.write(buffer_);
    } catch (...) {
        // A torn record would hide all later ones if the caller continued.
        sound_ = false;
        try {
            file_.truncate(size_);
            sound_ = true;
        } catch (const std::runtime_error&) {  // it stays unsound, and the next record reports that
        }
        throw;
    }
    size_ += buffer_.size();
}

void Journal::row(std::uint64_t sequence, std::span<const double> values) {
    begin(Entry::row);
    put(buffer_, values);
    commit(sequence);
}

void Journal::record(Entry kind, std::uint64_t sequence, const Record& record) {
    begin(kind);
    put(buffer_, record);
    commit(sequence);
}

void Journal::discard(std::uint64_t sequence) {
    begin(Entry::discard);
    commit(sequence);
}

void Journal::mesh(std::uint64_t sequence, const SurfaceCells& mesh) {
    begin(Entry::mesh);
    put(buffer_, mesh);
    commit(sequence);
}

void Journal::bytes(Entry kind, std::uint64_t sequence, std::span<const std::byte> payload) {
    begin(kind);
    put(buffer_, payload);
    commit(sequence);
}

std::vector<std::byte> read_journal(const std::filesystem::path& result) {
    const auto path = journal_path(result);
    const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);  // a pipe must not be waited for
    if (fd < 0 && errno == ENOENT) return {};
    if (fd < 0) durable::fail("open", path, errno);
    const std::unique_ptr<const int, void (*)(const int*)> closer(&fd, [](const int* open) { ::close(*open); });
    struct stat info {};
    if (::fstat(fd, &info) != 0 || !S_ISREG(info.st_mode))
        throw std::runtime_error(fmt::format("{}: not a regular file", path.string()));

    const auto read_from = [&](std::size_t offset, std::span<std::byte> into) {
        ssize_t n = 0;
        do n = ::pread(fd, into.data(), into.size(), static_cast<off_t>(offset));
        while (n < 0 && errno == EINTR);
        if (n < 0) durable::fail("read", path, errno);
        return static_cast<std::size_t>(n);
    };

    while (true) {
        std::vector<std::byte> bytes;
        std::size_t size = 0;
        for (std::size_t n = 1; n > 0; size += n) {
            bytes.resize(std::max<std::size_t>(2 * size, 1 << 16));
            n = read_from(size, std::span(bytes).subspan(size));
        }
        bytes.resize(size);
        // If the run has restarted the journal meanwhile, its first record is a different one, and the data read may
        // mix old and new.
        std::vector<std::byte> front(std::min(size, header_size + sizeof(Head)));
        if (read_from(0, front) == front.size() && std::equal(front.begin(), front.end(), bytes.begin())) return bytes;
    }
}

void replay(std::span<const std::byte> journal, Contents& contents) {
    replay(journal, contents.id, contents.sequence,
           [&](Entry kind, std::span<const std::byte> payload) { apply(kind, payload, contents); });
}

void replay(std::span<const std::byte> journal, std::uint64_t expected_id, std::uint64_t& sequence,
            const std::function<void(Entry, std::span<const std::byte>)>& apply) {
    std::uint64_t id = 0;
    if (journal.size() < header_size || std::memcmp(journal.data(), magic.data(), magic.size()) != 0) return;
    std::memcpy(&id, journal.data() + magic.size(), sizeof(id));
    if (id != expected_id) return;

    const std::uint32_t seed = seed_of(id);
    auto rest = journal.subspan(header_size);
    while (rest.size() >= sizeof(Head)) {
        Head head;
        std::memcpy(&head, rest.data(), sizeof(Head));
        if (head.length > rest.size() - sizeof(Head)) break;
        const auto record = rest.first(sizeof(Head) + head.length);
        if (record_crc(seed, record) != head.crc) break;
        if (head.sequence > sequence + 1)
            throw std::runtime_error(
                fmt::format("its journal begins with record {}, but the file ends with record {}: "
                            "is it an old copy?",
                            head.sequence, sequence));
        if (head.sequence == sequence + 1) {
            apply(static_cast<Entry>(head.kind), record.subspan(sizeof(Head)));
            sequence = head.sequence;
        }
        rest = rest.subspan(record.size());
    }
}

}  // namespace tubule
