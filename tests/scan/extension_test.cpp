// Scans that grow: which axes they get, and where the points that are known go.
#include "tools/scan/extension.hpp"

#include <gtest/gtest.h>

#include "common/case/read.hpp"
#include "tests/support/message_of.hpp"

namespace tubule::extension_test {

using test::message_of;

const std::string text =
    "tier = \"axisym\"\n[energy]\nk20 = 1.0\nk42 = 0.5\n[shape]\nkind = \"tube\"\nradius = 1.0\nlength = 2.0\n"
    "mode = [{amplitude = 0.1, n = 1}]\n[time]\nend = 1.0\n";

// A scan all of whose points are known, by made-up energies: 10 k42 + H0.
ScanResult made_up(const std::vector<std::string>& over, const std::vector<std::string>& sets = {}) {
    ScanResult result;
    result.scan.path = result.scan.case_path = "case.toml";
    result.scan.case_text = text;
    result.scan.sets = sets;
    for (const std::string& one : over) result.scan.axes.push_back(parse_axis(one));
    for (std::size_t i = 0; i < result.scan.size(); ++i) {
        const Case c = result.scan.case_of(i);
        PointResult p = unknown_point(i);
        p.outcome = Outcome::unduloid;
        p[Measure::energy] = 10 * c.energy.k[2] + c.energy.H0;
        result.points.push_back(p);
    }
    return result;
}

// Every known point is where its case is; how many there are.
std::size_t known_and_in_place(const ScanResult& e) {
    std::size_t known = 0;
    for (const PointResult& p : e.points) {
        if (p.outcome == Outcome::not_run) continue;
        ++known;
        const Case c = e.scan.case_of(p.point);
        EXPECT_EQ(p[Measure::energy], 10 * c.energy.k[2] + c.energy.H0) << p.point;
    }
    return known;
}

TEST(Extension, ValuesJoinInOrder) {
    const ScanResult e = extended(made_up({"energy.k42=0,1", "energy.H0=-1,0"}), {"energy.k42=0.5,1.0,2"});
    ASSERT_EQ(e.scan.axes.size(), 2u);
    EXPECT_EQ(e.scan.axes[0].values, (std::vector<std::vector<std::string>>{{"0"}, {"0.5"}, {"1"}, {"2"}}));
    EXPECT_EQ(known_and_in_place(e), 4u);
}

TEST(Extension, WordsJoinBehind) {
    const std::vector<std::string> kinds{"model.kind=\"stokes\",\"gradient-flow\""};
    const ScanResult e = extended(made_up(kinds), {"model.kind=\"fluid\",\"stokes\""});
    EXPECT_EQ(e.scan.axes[0].values,
              (std::vector<std::vector<std::string>>{{"\"stokes\""}, {"\"gradient-flow\""}, {"\"fluid\""}}));
}

TEST(Extension, ANewAxisHasTheValueOfThePoints) {
    // The value of the case, of an override, and the default.
    ScanResult e = extended(made_up({"energy.H0=-1,0"}), {"energy.k42=1"});
    EXPECT_EQ(e.scan.axes[1].values, (std::vector<std::vector<std::string>>{{"0.5"}, {"1"}}));
    EXPECT_EQ(known_and_in_place(e), 2u);
    e = extended(made_up({"energy.H0=-1,0"}, {"energy.k42=3"}), {"energy.k42=1"});
    EXPECT_EQ(e.scan.axes[1].values, (std::vector<std::vector<std::string>>{{"1"}, {"3"}}));
    EXPECT_TRUE(e.scan.sets.empty());
    EXPECT_EQ(known_and_in_place(e), 2u);
    e = extended(made_up({"energy.k42=1,2"}), {"energy.H0=-1"});
    EXPECT_EQ(e.scan.axes[1].values, (std::vector<std::vector<std::string>>{{"-1"}, {"0"}}));
    EXPECT_EQ(known_and_in_place(e), 2u);
}

TEST(Extension, MergedByAxesAndOverrides) {
    ScanResult e = merged(made_up({"energy.k42=0,1"}, {"energy.H0=-1"}), made_up({"energy.k42=1,2"}, {"energy.H0=-2"}));
    ASSERT_EQ(e.scan.axes.size(), 2u);
    EXPECT_EQ(e.scan.size(), 6u);
    EXPECT_EQ(known_and_in_place(e), 4u);
    // The same axes in another order.
    e = merged(made_up({"energy.k42=0,1", "energy.H0=-1,0"}), made_up({"energy.H0=-1,0", "energy.k42=2,3"}));
    EXPECT_EQ(e.scan.size(), 8u);
    EXPECT_EQ(known_and_in_place(e), 8u);
}

TEST(Extension, Refuses) {
    const ScanResult a = made_up({"energy.k42=0,1"});
    EXPECT_EQ(message_of([&] { extended(a, {"energy.k43=1"}); }).substr(0, 44),
              "--set energy.k43=1: unknown key energy.k43; ");
    EXPECT_EQ(message_of([&] { extended(a, {"discretisation.elements=40"}); }),
              "case.toml: its points have no value of discretisation.elements, so it cannot become an axis");
    ScanResult b = a;
    b.scan.case_text += "\n";
    EXPECT_CONTAINS(message_of([&] { merged(a, b); }), "cannot be merged: they are scans of different cases: line ");
    b = a, b.scan.axes = {parse_table("energy.k42,energy.H0\n0,1\n", "table.csv")};
    EXPECT_EQ(message_of([&] { merged(a, b); }),
              "case.toml: a table of other keys cannot be merged: energy.k42, energy.H0");
    b = a, b.scan.to_the_end = true;
    EXPECT_EQ(message_of([&] { merged(a, b); }),
              "case.toml and case.toml cannot be merged: only one of them runs its points to the end (--to-the-end)");
    b = a, b.scan.boundary.emplace();
    EXPECT_EQ(message_of([&] { merged(a, b); }),
              "case.toml and case.toml cannot be merged: they differ in --boundary, --seeds or --refine");
}

}  // namespace tubule::extension_test
