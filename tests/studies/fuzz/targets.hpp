// What reads files, as functions of bytes that nobody checked: for coverage-guided fuzzing (entry.cpp) and for a test
// that runs them over a few inputs (targets_test.cpp). Checksums are right or left out, so that what is behind them is
// reached.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace tubule::fuzz {

using Input = std::span<const std::byte>;

struct Target {
    const char* name;
    void (*run)(Input input);  // throws where the reader is at fault: anything but the refusals that it documents
    std::vector<std::string> (*seeds)();  // inputs to begin with
};

const std::vector<Target>& targets();

// Those of result_targets.cpp.
void result_parts(Input input);
std::vector<std::string> result_seeds();

// A file with these bytes, for readers that want one; the same path for every input.
std::filesystem::path file_of(Input input, const std::string& ending);

}  // namespace tubule::fuzz
