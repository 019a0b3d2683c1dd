// Where progress is shown in tests.
#pragma once

#include <cstdio>
#include <string>

#include "common/solve/progress.hpp"

namespace tubule::test {

// A file as a screen, and a clock that the test sets.
struct Screen {
    double now = 100;
    std::FILE* file = std::tmpfile();
    ~Screen() { std::fclose(file); }
    ProgressStyle style(bool terminal, bool quiet = false) {
        return {.quiet = quiet, .out = file, .terminal = terminal, .clock = [this] { return now; }};
    }
    std::string text() const {
        std::fflush(file);
        std::rewind(file);
        std::string all(4096, '\0');
        all.resize(std::fread(all.data(), 1, all.size(), file));
        return all;
    }
};

}  // namespace tubule::test
