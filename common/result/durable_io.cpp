#include "common/result/durable_io.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "common/case/input_file.hpp"

namespace tubule::durable {

namespace {

// Whether the operation may proceed; if not, errno is set.
bool allowed(const Operation& operation) {
    const int error = fault ? fault(operation) : 0;
    if (error != 0) errno = error;
    return error == 0;
}

void sync_directory(const std::filesystem::path& directory) {
    File handle(directory, O_RDONLY | O_DIRECTORY);
    // Some file systems cannot sync a directory and return EINVAL; nothing more can be done.
    const bool done = allowed({Call::sync, handle.descriptor(), {}}) && ::fsync(handle.descriptor()) == 0;
    if (!done && errno != EINVAL) fail("sync directory", directory, errno);
}

}  // namespace

void fail(const char* verb, const std::filesystem::path& path, int error) {
    throw Error(fmt::format("cannot {} {}: {}{}", verb, path.string(), std::strerror(error),
                            error == ENOENT ? why_missing(path) : ""));
}

File::File(const std::filesystem::path& path, int flags) : path_(path) {
    if (allowed({Call::open, -1, {}})) fd_ = ::open(path.c_str(), flags | O_CLOEXEC, 0666);
    if (fd_ < 0) fail("open", path, errno);
}

File::File(File&& other) noexcept : fd_(std::exchange(other.fd_, -1)), path_(std::move(other.path_)) {}

File& File::operator=(File&& other) noexcept {
    std::swap(fd_, other.fd_);
    std::swap(path_, other.path_);
    return *this;
}

File::~File() {
    if (is_open()) ::close(fd_);
}

void File::write(std::span<const std::byte> bytes) {
    while (!bytes.empty()) {
        const ssize_t n = allowed({Call::write, fd_, bytes}) ? ::write(fd_, bytes.data(), bytes.size()) : -1;
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) fail("write", path_, errno);
        bytes = bytes.subspan(static_cast<std::size_t>(n));
    }
}

void File::sync() {
    while (!(allowed({Call::sync, fd_, {}}) && ::fsync(fd_) == 0)) {
        if (errno != EINTR) fail("sync", path_, errno);
    }
}

void remove(const std::filesystem::path& path) {
    const bool done = allowed({Call::remove, -1, {}}) && ::unlink(path.c_str()) == 0;
    if (!done && errno != ENOENT) fail("remove", path, errno);
}

void replace(const std::filesystem::path& path, std::span<const std::byte> contents) {
    auto aside = path;
    aside += ".tmp";
    try {
        File file(aside, O_WRONLY | O_CREAT | O_TRUNC);
        file.write(contents);
        file.sync();
        if (!allowed({Call::rename, -1, {}}) || ::rename(aside.c_str(), path.c_str()) != 0)
            fail("replace", path, errno);
    } catch (...) {
        ::unlink(aside.c_str());  // free the space; an error here matters less than the one being thrown
        throw;
    }
    sync_directory(path.has_parent_path() ? path.parent_path() : ".");
}

}  // namespace tubule::durable
