// The system calls by which a result reaches the disk, all of them, so that the tests can make any of
// them fail or be the last thing the process does.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <span>
#include <stdexcept>

namespace tubule::durable {

enum class Call { open, write, sync, rename, remove };

struct Operation {
    Call call;
    int fd = -1;                       // of write and sync
    std::span<const std::byte> bytes;  // that write is about to write
};

// For tests: called before every operation. Returns 0 to let it happen, or an errno value to make it fail.
inline std::function<int(const Operation&)> fault;

// A file cannot be read or written. All of these throw it, with the path and the system's words.
struct Error : std::runtime_error {
    using std::runtime_error::runtime_error;
};

// An owned file descriptor.
class File {
public:
    File() = default;
    File(const std::filesystem::path& path, int flags);  // as open(2), close-on-exec
    File(File&& other) noexcept;
    File& operator=(File&& other) noexcept;
    ~File();

    bool is_open() const { return fd_ >= 0; }
    int descriptor() const { return fd_; }
    const std::filesystem::path& path() const { return path_; }

    void write(std::span<const std::byte> bytes);  // all of them, in one write(2) where the system can
    void sync();

private:
    int fd_ = -1;
    std::filesystem::path path_;
};

void remove(const std::filesystem::path& path);

// Replaces the contents of `path`, or leaves it unchanged: writes PATH.tmp, then renames. After this
// returns, the new contents survive a loss of power, too.
void replace(const std::filesystem::path& path, std::span<const std::byte> contents);

[[noreturn]] void fail(const char* verb, const std::filesystem::path& path, int error);

}  // namespace tubule::durable
