// Scans of equilibria: kinds of cells, nodes of several starts, where energies are equal. Energies are made up.
#include "tools/scan/starts.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "axisym/curve/vesicle_families.hpp"
#include "common/case/read.hpp"
#include "tests/support/message_of.hpp"
#include "tools/scan/dispatcher.hpp"

namespace tubule::starts_test {

using test::message_of;

const std::string text =
    "tier = \"axisym\"\n[energy]\nk20 = 1.0\n[shape]\nkind = \"sphere\"\nradius = 1.0\n[accuracy]\nenergy = 1e-8\n"
    "[equilibrium]\narea = 12.566370614359172\nreduced_volume = 0.6\n";

Scan scan_over(const std::vector<std::string>& over, const std::string& case_text = text) {
    Scan scan;
    scan.path = scan.case_path = "case.toml";
    scan.case_text = case_text;
    for (const std::string& one : over) scan.axes.push_back(parse_axis(one));
    check_scan(scan);
    return scan;
}

const std::string families = "equilibrium.family=\"prolate\",\"oblate\"",
                  volumes = "equilibrium.reduced_volume=0.6:0.9:4", curvatures = "energy.H0=-1,0,1";

// r = 1 + a cos 2t + b cos t + c cos 3t in the direction t from the south pole; the reduced volume is not that of it.
Outcome kind(double a, double b, double c, double reduced_volume = 0.7) {
    Curve cell;
    cell.at = [=](double s) {
        const double t = pi * s, d = 1 + a * std::cos(2 * t) + b * std::cos(t) + c * std::cos(3 * t),
                     slope = -2 * a * std::sin(2 * t) - b * std::sin(t) - 3 * c * std::sin(3 * t);
        return std::array{d * std::sin(t), pi * (slope * std::sin(t) + d * std::cos(t)), -d * std::cos(t),
                          pi * (d * std::sin(t) - slope * std::cos(t))};
    };
    return cell_at_rest(axisym::family_of(cell, reduced_volume));
}

TEST(Starts, KindsOfCells) {
    EXPECT_EQ(kind(0.3, 0, 0), Outcome::prolate);
    EXPECT_EQ(kind(-0.3, 0, 0), Outcome::oblate);
    EXPECT_EQ(kind(-0.6, 0, 0), Outcome::oblate);  // dented on both sides alike
    EXPECT_EQ(kind(-0.3, 0.5, 0.1), Outcome::stomatocyte);
    EXPECT_EQ(kind(0.3, 0.2, 0), Outcome::pear);
    EXPECT_EQ(kind(0.3, 0, 0, 0.9995), Outcome::sphere);
}

TEST(Starts, WhichAxisIsOfStarts) {
    EXPECT_EQ(start_axis(scan_over({volumes, families})), 1u);
    EXPECT_EQ(start_axis(scan_over({volumes})), std::nullopt);
    EXPECT_EQ(start_axis(scan_over({"shape.radius=1,1.1", volumes})), 0u);  // of given area and volume
    EXPECT_EQ(start_axis(scan_over({"shape.radius=1,1.1", families})), std::nullopt);
    // The start gives the area: shapes of different area have energies that say nothing of each other.
    const std::string without = text.substr(0, text.find("area")) + "reduced_volume = 0.6\n";
    EXPECT_EQ(start_axis(scan_over({"shape.radius=1,1.1", volumes}, without)), std::nullopt);
}

TEST(Starts, NodesNumberTheOtherAxes) {
    for (const auto& over : {std::vector{families, volumes, curvatures}, std::vector{volumes, families, curvatures},
                             std::vector{volumes, curvatures, families}}) {
        const Scan scan = scan_over(over);
        const Nodes nodes(scan);
        std::vector<int> seen(scan.size());
        for (std::size_t node = 0; node < 12; ++node)
            for (std::size_t start = 0; start < 2; ++start) {
                const std::size_t point = nodes.point_of(node, start);
                EXPECT_EQ(nodes.node_of(point), node);
                EXPECT_EQ(scan.place(point)[start_axis(scan).value()], start);
                ++seen.at(point);
            }
        EXPECT_EQ(seen, std::vector<int>(scan.size(), 1));
    }
}

TEST(Starts, NumbersOfCrossings) {
    const Scan scan = scan_over({families, volumes, curvatures});
    const EnergyCrossing crossing{.node = 7, .axis = 1, .kinds = {Outcome::prolate, Outcome::oblate}};
    const EnergyCrossing again = crossing_of(scan, number_of(scan, crossing));
    EXPECT_GE(number_of(scan, crossing), scan.size());
    EXPECT_EQ(again.node, 7u);
    EXPECT_EQ(again.axis, 1u);
    EXPECT_EQ(again.kinds, crossing.kinds);
}

// Prolates have the energy 1, oblates that of `oblate(v)`, at reduced volumes 0.6, 0.7, 0.8, 0.9.
template <class Energy>
std::vector<Work> works_of(const Scan& scan, Outcome second, const Energy& oblate) {
    ScanPlan plan(scan);
    std::vector<Work> crossings;
    while (const auto work = plan.next()) {
        PointResult p = unknown_point(work->number);
        if (work->crossing) {
            crossings.push_back(*work);
            p.outcome = Outcome::prolate;
        } else {
            const Case c = scan.case_of(work->number);
            const bool is_prolate = c.equilibrium->family == Family::prolate;
            p.outcome = is_prolate ? Outcome::prolate : second;
            p[Measure::free_energy] = is_prolate ? 1 : oblate(*c.equilibrium->reduced_volume);
        }
        plan.done(p);
    }
    EXPECT_EQ(plan.known(), plan.wanted());
    return crossings;
}

TEST(Starts, ACrossingIsAskedForWhereEnergiesChangeOrder) {
    const Scan scan = scan_over({families, volumes});
    const auto found = works_of(scan, Outcome::oblate, [](double v) { return v + 0.25; });
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].crossing->node, 1u);  // between 0.7 and 0.8
    EXPECT_EQ(found[0].crossing->starts, (std::array<std::size_t, 2>{0, 1}));
    EXPECT_NEAR(found[0].crossing->differences[0], 0.05, 1e-12);
    EXPECT_NEAR(found[0].crossing->differences[1], -0.05, 1e-12);
    // Both starts lead to the same kind, or one to none.
    EXPECT_TRUE(works_of(scan, Outcome::prolate, [](double v) { return v + 0.25; }).empty());
    EXPECT_TRUE(works_of(scan, Outcome::failed, [](double v) { return v + 0.25; }).empty());
}

// Independent: Newton's method on the difference of the energies, tests/axisym/equilibrium_test.cpp.
TEST(Starts, ACrossingIsFound) {
    const Scan scan = scan_over({families, "equilibrium.reduced_volume=0.6,0.7"});
    std::vector<PointResult> points;
    for (std::size_t i = 0; i < scan.size(); ++i) points.push_back(run_one(scan, {i, {}}));
    const auto crossings = energy_crossings(Nodes(scan), points, 0);
    ASSERT_EQ(crossings.size(), 1u);
    const PointResult p = find_crossing(scan, crossings[0]);
    EXPECT_NEAR(p.value, 0.65108, 1e-5);
    // Where one of the starts leads to another kind, there is none, and it is said.
    EnergyCrossing other = crossings[0];
    other.kinds[1] = Outcome::stomatocyte;
    const PointResult none = find_crossing(scan, other);
    EXPECT_EQ(none.outcome, Outcome::failed);
    EXPECT_EQ(none.message.find("there is no stomatocyte at equilibrium.reduced_volume = 0.6"), 0u) << none.message;
    EXPECT_TRUE(std::isnan(none.value));
}

TEST(Starts, OtherRanksGetTheSameScan) {
    Scan scan = scan_over({families, "equilibrium.reduced_volume=0.6:0.9:4:log"});
    scan.sets = {"accuracy.energy=1e-6"};
    const Scan copy = scan_from(to_packet(scan));
    EXPECT_EQ(copy.case_text, scan.case_text);
    EXPECT_TRUE(copy.axes[1].logarithmic);
    for (std::size_t i = 0; i < scan.size(); ++i) EXPECT_EQ(copy.sets_of(i), scan.sets_of(i));
    scan = scan_over({"energy.H0=-1,0"});
    scan.boundary = BoundaryChoice{.around = {}, .refine = 3};
    EXPECT_EQ(scan_from(to_packet(scan)).sets_of(3), scan.sets_of(3));  // between points of the grid
}

TEST(Starts, Refusals) {
    Scan scan = scan_over({families, volumes});
    scan.boundary = BoundaryChoice{.around = {}, .refine = 3};
    EXPECT_CONTAINS(message_of([&] { check_scan(scan); }), "refine must be absent");
    const std::string branch = "[equilibrium.branch]\nvary = \"energy.H0\"\nto = 1.0\nstep = 0.5\n";
    EXPECT_CONTAINS(message_of([&] { scan_over({volumes}, text + branch); }), "a point of a scan is one shape");
}

}  // namespace tubule::starts_test
