// The targets of coverage-guided fuzzing over their seeds, and over seeds with a few changed bytes: no reader of a file
// may do anything but read it or refuse it as it documents.
#include "tests/studies/fuzz/targets.hpp"

#include <gtest/gtest.h>

#include <random>
#include <span>

namespace tubule::fuzz::targets_test {

class Readers : public testing::TestWithParam<Target> {};

TEST_P(Readers, ReadOrRefuse) {
    const Target& target = GetParam();
    std::mt19937 engine(1);
    const auto below = [&](std::size_t n) { return engine() % n; };
    const std::vector<std::string> seeds = target.seeds();
    for (std::size_t i = 0; i < seeds.size() + 100; ++i) {
        std::string input = seeds[i < seeds.size() ? i : below(seeds.size())];
        if (i >= seeds.size())
            for (int change = 0; change < 3 && !input.empty(); ++change)
                input[below(input.size())] = static_cast<char>(engine());
        EXPECT_NO_THROW(target.run(std::as_bytes(std::span(input)))) << testing::PrintToString(input);
    }
}

INSTANTIATE_TEST_SUITE_P(Fuzz, Readers, testing::ValuesIn(targets()),
                         [](const auto& target) { return std::string(target.param.name); });

}  // namespace tubule::fuzz::targets_test
