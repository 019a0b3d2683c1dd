#include "common/result/journal.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "common/result/checksums.hpp"
#include "common/result/record_bytes.hpp"

namespace tubule {

namespace {

constexpr std::string_view journal_magic = "TUBULEJ1";
constexpr std::size_t header_size = 16;

struct Head {
    std::uint64_t length;
    std::uint64_t sequence;
    std::uint32_t kind;
    std::uint32_t crc;
};
constexpr std::size_t summed_head = offsetof(Head, crc);

std::uint32_t seed_of(std::uint64_t id) {
    return crc32(0, std::as_bytes(std::span(&id, 1)));
}

std::uint32_t record_crc(std::uint32_t seed, std::span<const std::byte> record) {
    return crc32(crc32(seed, record.first(summed_head)), record.subspan(sizeof(Head)));
}

void apply(Entry kind, std::span<const std::byte> bytes, Contents& contents) {
    Payload payload(bytes);
    switch (kind) {
        case Entry::row:
            contents.add_row(payload.values<double>(contents.series.size()));
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
        case Entry::point_of_version_0:
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
    Bytes header;
    put(header, std::as_bytes(std::span(journal_magic)));
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

Bytes read_journal(const std::filesystem::path& result) {
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
        Bytes bytes;
        std::size_t size = 0;
        for (std::size_t n = 1; n > 0; size += n) {
            bytes.resize(std::max<std::size_t>(2 * size, 1 << 16));
            n = read_from(size, std::span(bytes).subspan(size));
        }
        bytes.resize(size);
        // If the run has begun the journal anew meanwhile, its first record is another one now, and what was read may
        // be part old, part new.
        Bytes front(std::min(size, header_size + sizeof(Head)));
        if (read_from(0, front) == front.size() && std::equal(front.begin(), front.end(), bytes.begin())) return bytes;
    }
}

std::size_t replay(std::span<const std::byte> journal, Contents& contents) {
    return replay(journal, contents.id, contents.sequence,
                  [&](Entry kind, std::span<const std::byte> payload) { apply(kind, payload, contents); });
}

std::size_t replay(std::span<const std::byte> journal, std::uint64_t id, std::uint64_t& sequence,
                   const std::function<void(Entry, std::span<const std::byte>)>& apply) {
    if (journal.size() < header_size) return 0;
    // Whose journal it is the records tell as well: one damaged byte of the header must not cost them.
    const std::uint32_t seed = seed_of(id);
    const bool says_so = std::memcmp(journal.data() + journal_magic.size(), &id, sizeof(id)) == 0;
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
    const bool is_ours = says_so || rest.size() < journal.size() - header_size;
    return is_ours ? rest.size() : 0;
}

void warn_of_rest(std::size_t bytes, const std::filesystem::path& result) {
    if (bytes == 0) return;
    std::fputs(
        fmt::format("warning: {}: its last {} bytes are no whole record: the run was killed while it wrote them, or "
                    "they are damaged; what they recorded is lost\n",
                    journal_path(result).string(), bytes)
            .c_str(),
        stderr);
}

}  // namespace tubule
