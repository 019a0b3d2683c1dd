// What is listed once in the code stands in the docs as well.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "common/case/case.hpp"
#include "common/series/catalogue.hpp"
#include "tests/support/paths.hpp"

namespace tubule {
namespace {

std::string page(const std::string& name) {
    std::ifstream file(test::sources + "/" + name);
    return {std::istreambuf_iterator<char>(file), {}};
}

bool has(const std::string& text, const std::string& row) {
    return text.find(row) != std::string::npos;
}

TEST(Docs, TellEveryStopItsExitStatusAndWhenItIsGiven) {
    const std::string results = page("docs/results.md");
    for (const StopKind& stop : stop_kinds) {
        const std::string row = fmt::format("\n| `{}` | {} | {} |\n", stop.name, stop.exit_code, stop.meaning);
        EXPECT_TRUE(has(results, row)) << "docs/results.md lacks the row" << row;
    }
}

TEST(Docs, TellEverySeries) {
    const std::string results = page("docs/results.md");
    for (const SeriesEntry& series : series_catalogue) {
        const std::string row = fmt::format("\n| `{}` | {} | {} |\n", series.name, series.unit, series.meaning);
        EXPECT_TRUE(has(results, row)) << "docs/results.md lacks the row" << row;
    }
    const std::string keys = page("docs/case_files.md");
    for (const SeriesEntry& series : series_catalogue) {
        if (series.use != SeriesUse::effort) continue;
        EXPECT_TRUE(has(keys, fmt::format("`{}`", series.name))) << "docs/case_files.md lacks " << series.name;
    }
}

template <class... Shapes>
void expect_rows(const std::variant<Shapes...>&) {
    const std::string keys = page("docs/case_files.md");
    for (const char* kind : {Shapes::kind...})
        EXPECT_TRUE(has(keys, fmt::format("\n| `\"{}\"` | ", kind))) << "docs/case_files.md lacks the shape " << kind;
}
TEST(Docs, TellEveryShape) {
    expect_rows(Shape{});
}

TEST(Docs, TellEveryEnergyTerm) {
    const std::string keys = page("docs/case_files.md"), results = page("docs/results.md");
    for_each_bending_term([&](std::size_t, const auto& term) {
        EXPECT_TRUE(has(keys, fmt::format("`{}`", term.key))) << "docs/case_files.md lacks " << term.key;
        EXPECT_TRUE(has(results, fmt::format("`energy_{}`", term.name))) << "docs/results.md lacks " << term.name;
    });
}

}  // namespace
}  // namespace tubule
