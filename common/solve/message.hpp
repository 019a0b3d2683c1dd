// Words for people who watch: messages, progress, reports. Where they cannot be written, because a disk is full, a pipe
// has no reader or a stream was closed, work continues without them.
#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <string_view>
#include <utility>

namespace tubule {

inline void put_words(std::FILE* out, std::string_view words) noexcept {
    std::fwrite(words.data(), 1, words.size(), out);
    std::fflush(out);
}

// To stderr or stdout, at once.
template <class... Args>
void say(std::FILE* out, fmt::format_string<Args...> format, Args&&... args) noexcept {
    try {
        put_words(out, fmt::format(format, std::forward<Args>(args)...));
    } catch (...) {  // no memory for a message
    }
}

}  // namespace tubule
