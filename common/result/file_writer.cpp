#include "common/result/file_writer.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <stdexcept>
#include <utility>

namespace tubule {

namespace {

namespace fs = std::filesystem;

fs::path with_ending(fs::path file, const char* ending) {
    return file += ending;
}

// If another writer removed the file in between, it is no longer the lock: try again.
durable::File locked(const fs::path& path, const fs::path& file) {
    while (true) {
        durable::File lock(path, O_RDWR | O_CREAT);
        // Some network file systems do not support locks; a run is not refused for that.
        if (::flock(lock.descriptor(), LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
            throw std::runtime_error(
                fmt::format("{} is in use: another process is writing this result", file.string()));
        struct stat mine {
        }, named{};
        ::fstat(lock.descriptor(), &mine);
        if (::stat(path.c_str(), &named) == 0 && mine.st_ino == named.st_ino && mine.st_dev == named.st_dev)
            return lock;
    }
}

}  // namespace

FileWriter::FileWriter(fs::path file) : file_(std::move(file)), lock_(locked(with_ending(file_, ".lock"), file_)) {}

std::optional<double> FileWriter::seconds_between_writes = [] {
    const char* text = std::getenv("TUBULE_WRITE_SECONDS");
    return text ? std::optional(std::atof(text)) : std::nullopt;
}();

bool FileWriter::due() const {
    const std::chrono::duration<double> passed = Clock::now() - written_at_, cost = cost_;
    return passed.count() >= seconds_between_writes.value_or(std::max(2.0, 50 * cost.count()));
}

void FileWriter::write(const std::function<std::vector<std::byte>()>& image) {
    const auto start = Clock::now();
    durable::replace(file_, image());
    written_at_ = Clock::now();
    cost_ = written_at_ - start;
}

void FileWriter::release() {
    if (!lock_.is_open()) return;
    std::error_code none;
    fs::remove(lock_.path(), none);
    lock_ = {};
}

}  // namespace tubule
