#include "common/case/input_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>
#include <vector>

#include "common/case/read.hpp"
#include "common/case/text.hpp"

namespace tubule {

std::string why_missing(const std::filesystem::path& path) {
    const std::string name = path.filename().string();
    if (path.string().find("~/") == 0 || path.string().find("/~/") != std::string::npos)
        return "; ~ does not stand for the home directory here: write the whole path";
    if (name.starts_with("\u2013") || name.starts_with("\u2014"))
        return "; an option begins with the hyphen of the keyboard, -";
    const auto its_case = std::filesystem::path(path).replace_extension(".toml");
    if (std::error_code none; path.extension() == ".hdf" && std::filesystem::exists(its_case, none))
        return fmt::format("; tubule run {} makes it", its_case.filename().string());
    std::vector<std::string> others;
    std::error_code error;
    const auto folder = path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
    for (const auto& entry : std::filesystem::directory_iterator(folder, error))
        if (entry.path().extension() == path.extension() && others.size() < 1000)
            others.push_back(entry.path().filename().string());
    const auto near = near_miss(name, others);
    return near ? fmt::format("; did you mean {}?", *near) : "";
}

std::string read_input(const std::filesystem::path& path, std::size_t most) {
    const auto refuse = [&](const std::string& why) { throw CaseError(fmt::format("{}: {}", path.string(), why)); };
    // Without O_NONBLOCK, opening a pipe would wait for somebody who writes into it.
    const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (fd < 0)
        refuse(fmt::format("cannot be opened: {}{}", std::strerror(errno), errno == ENOENT ? why_missing(path) : ""));
    const std::unique_ptr<const int, void (*)(const int*)> closer(&fd, [](const int* open) { ::close(*open); });
    struct stat info {};
    if (::fstat(fd, &info) != 0) refuse(fmt::format("cannot be read: {}", std::strerror(errno)));
    if (S_ISDIR(info.st_mode)) refuse("is a directory: give a file in it");
    if (!S_ISREG(info.st_mode)) refuse("is a pipe or a device, not a file: save its contents to a file first");

    const auto expected = static_cast<std::size_t>(info.st_size);
    const std::string too_large = fmt::format("is larger than {} MB, the most that is read", most / megabyte);
    if (expected > most) refuse(too_large);

    std::string text;
    for (std::size_t size = 0;;) {  // until the end: it may have grown since, and some file systems state no size
        text.resize(std::max(expected, size) + 4096);
        const ssize_t n = ::read(fd, text.data() + size, text.size() - size);
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) refuse(fmt::format("cannot be read: {}", std::strerror(errno)));
        size += static_cast<std::size_t>(n);
        if (size > most) refuse(too_large);
        if (n > 0) continue;
        text.resize(size);
        break;
    }
    return text;
}

}  // namespace tubule
