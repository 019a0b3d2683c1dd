// What a scan is asked to do: ranges, lists, tables, and what is refused.
#include "tools/scan/description.hpp"

#include <gtest/gtest.h>

#include "common/case/read.hpp"
#include "tests/support/message_of.hpp"

namespace tubule::description_test {

using test::message_of;

std::vector<std::string> values(const std::string& over) {
    std::vector<std::string> all;
    for (const auto& setting : parse_axis(over).values) all.push_back(setting.at(0));
    return all;
}

TEST(Axis, Range) {
    EXPECT_EQ(values("energy.k42=0:1:5"), (std::vector<std::string>{"0", "0.25", "0.5", "0.75", "1"}));
    EXPECT_EQ(values("shape.mode.0.n=1:3:3"), (std::vector<std::string>{"1", "2", "3"}));
    EXPECT_EQ(values("energy.H0=-1:1:2"), (std::vector<std::string>{"-1", "1"}));
    const Axis axis = parse_axis("energy.k42=1e-2:1:3:log");
    EXPECT_TRUE(axis.logarithmic);
    EXPECT_NEAR(std::stod(axis.values[1][0]), 0.1, 1e-15);  // the geometric mean
    EXPECT_EQ(axis.values[2][0], "1");
}

TEST(Axis, List) {
    EXPECT_EQ(values("model.kind=stokes, \"fluid\""), (std::vector<std::string>{"stokes", "\"fluid\""}));
    EXPECT_EQ(values("time.output=[0.1,0.2],[0.3]"), (std::vector<std::string>{"[0.1,0.2]", "[0.3]"}));
    EXPECT_EQ(values("about.title=\"a,b\",c"), (std::vector<std::string>{"\"a,b\"", "c"}));
}

TEST(Axis, Refusals) {
    const auto refusal = [](const std::string& over) { return message_of<CaseError>([&] { parse_axis(over); }); };
    EXPECT_CONTAINS(refusal("energy.k42"), "must have the form key=values");
    EXPECT_CONTAINS(refusal("energy.k42="), "no values");
    EXPECT_CONTAINS(refusal("energy.k42=0,,1"), "a value is missing");
    EXPECT_CONTAINS(refusal("energy.k42=1:0:5"), "the range is empty: 0 is not above 1");
    EXPECT_CONTAINS(refusal("energy.k42=0:1:1"), "1 values");
    EXPECT_CONTAINS(refusal("energy.k42=0:1:2.5"), "2.5 values");
    EXPECT_CONTAINS(refusal("energy.k42=0:1"), "not a range");
    EXPECT_CONTAINS(refusal("energy.k42=0:x:3"), "not a number");
    EXPECT_CONTAINS(refusal("energy.k42=0:1:3:log"), "must begin above 0");
    EXPECT_CONTAINS(refusal("energy.k42=1:2:3:lin"), "'lin' is not 'log'");
    EXPECT_CONTAINS(refusal("energy.k42=0:1:1e9"), "more than");
}

TEST(Axis, Table) {
    const Axis axis = parse_table("energy.k42, shape.length\n\n# comment\n0.1, 2.0\n0.2,3.0\n", "t.csv");
    EXPECT_EQ(axis.keys, (std::vector<std::string>{"energy.k42", "shape.length"}));
    EXPECT_EQ(axis.values, (std::vector<std::vector<std::string>>{{"0.1", "2.0"}, {"0.2", "3.0"}}));
    const auto refusal = [](const std::string& text) {
        return message_of<CaseError>([&] { parse_table(text, "t.csv"); });
    };
    EXPECT_CONTAINS(refusal("energy.k42,energy.H0\n1\n"), "t.csv:2: 1 values for 2 keys");
    EXPECT_CONTAINS(refusal("energy.k42\n"), "t.csv: no points");
    EXPECT_CONTAINS(refusal("energy.k42,\n1,2\n"), "t.csv:1: an empty cell");
}

TEST(Scan, NumbersPointsRowByRow) {
    Scan scan;
    scan.sets = {"time.end=1.0"};
    scan.axes = {parse_axis("a=1,2"), parse_table("b,c\n3,4\n5,6\n7,8", "t")};
    EXPECT_EQ(scan.size(), 6u);
    EXPECT_EQ(scan.place(5), (std::vector<std::size_t>{1, 2}));
    EXPECT_EQ(scan.sets_of(4), (std::vector<std::string>{"time.end=1.0", "a=2", "b=5", "c=6"}));
}

}  // namespace tubule::description_test
