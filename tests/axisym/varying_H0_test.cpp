// A spontaneous curvature that varies along a profile: derivatives, forces, motions and equilibria.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "axisym/curve/curve_forms.hpp"
#include "axisym/equilibrium/equilibrium_run.hpp"
#include "axisym/splines/arc_length.hpp"
#include "axisym/splines/breaks.hpp"
#include "common/case/read.hpp"
#include "common/energy/H0_variables.hpp"
#include "common/solve/derivative_check.hpp"
#include "tests/axisym/runs.hpp"
#include "tests/support/message_of.hpp"
#include "tests/support/profile_points.hpp"
#include "tests/support/random_vector.hpp"

#define EXPECT_SAYS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

namespace tubule::axisym::varying_H0_test {

using Vector = Eigen::VectorXd;
using test::message_of, test::ProfilePoints, test::random_vector;

std::vector<double> uneven_breaks(int n) {
    std::vector<double> breaks = equal_breaks(n);
    for (double& s : breaks) s += 0.1 * std::sin(2 * pi * s) / (2 * pi);
    breaks.back() = 1;
    return breaks;
}

// A closed curve, half of one, or a period, disturbed beyond symmetry and smoothness.
Vector rough(const CurveSpace& space) {
    const Curve whole =
        space.closed() ? meridian(Ellipsoid{1, 1, 1.5}) : meridian(Tube{1, space.length(), {{0.2, 1, 0, 0}}});
    return fit(space, space.images() == 2 ? half(whole) : whole) + random_vector(space.size(), 0.02);
}

Bending varying(const Bending& base, const std::string& H0) {
    Bending out = base;
    out.H0_formula = std::make_shared<const Formula>(parse_formula(H0, H0_of_profile));
    return out;
}

TEST(VaryingH0, derivativesWhereH0IsAFunctionOfTheAreaBelow) {
    // Theorem: Taylor remainders fall with the second power of the step, with the full Hessian, too.
    const Bending law = varying(with_terms(bending(0.2, 0, 0.03, 0.06), {powers(0.02, 1, 1), formula(0.1, "H*H0^2")}),
                                "-1 + 0.7*tanh((area - 0.4)/0.2)");
    for (const Weights& weights : {Weights{.energy = 1}, Weights{1, -0.7, 1.3, 0.4}})
        for (int degree : {3, 5, 7})
            for (const Topology topology : {Topology::cell, Topology::half_cell, Topology::tube, Topology::half_tube}) {
                const double length = topology == Topology::tube || topology == Topology::half_tube ? 2.5 : 0;
                const CurveSpace space(topology, uneven_breaks(7), degree, degree - 1, length);
                const CurveForms forms(space, law);
                const auto check = check_derivatives(
                    [&](const Vector& y) { return forms.value(weights, y); },
                    [&](const Vector& y) { return forms.gradient(weights, y); },
                    [&](const Vector& y, const Vector& w) -> Vector { return forms.hessian(weights, y) * w; },
                    rough(space));
                EXPECT_TRUE(check.pass()) << degree << "\n" << check.text();
            }
}

TEST(VaryingH0, derivativesWhereH0IsFixedToTheParameter) {
    // Theorem: as above. The force along the curve, no gradient, has derivatives, too: those of the vector of its rows.
    const Bending law = varying(with_terms(bending(0.2, 0, 0.03, 0.06), {powers(0.02, 1, 1), formula(0.1, "H*H0^2")}),
                                "-1 + 0.7*sin(2*pi*area + r) + 0.1*cos(pi*z/1.25)");
    for (const Topology topology : {Topology::cell, Topology::tube}) {
        const CurveSpace space(topology, uneven_breaks(7), 5, 4, topology == Topology::tube ? 2.5 : 0);
        CurveForms forms(space, law);
        forms.fix_H0(rough(space));
        const Vector x = rough(space);
        const auto check = check_derivatives(
            [&](const Vector& y) { return forms.value({.energy = 1}, y); },
            [&](const Vector& y) { return forms.gradient({.energy = 1}, y); },
            [&](const Vector& y, const Vector& w) -> Vector { return forms.hessian({.energy = 1}, y) * w; }, x);
        EXPECT_TRUE(check.pass()) << check.text();

        const auto sliding = [&](const Vector& y) {
            Vector out = Vector::Zero(space.size());
            forms.add_sliding(y.data(), out.data());
            return out;
        };
        const Vector test = random_vector(space.size(), 1);
        const auto rows = check_derivatives([&](const Vector& y) { return test.dot(sliding(y)); },
                                            [&](const Vector& y) -> Vector {
                                                Eigen::SparseMatrix<double> slopes = forms.pattern();
                                                forms.add_sliding_slopes(y.data(), slopes.valuePtr());
                                                return slopes.transpose() * test;
                                            },
                                            [](const Vector& y, const Vector&) { return Vector(0 * y); }, x);
        EXPECT_TRUE(rows.gradient.pass) << rows.text();
    }
}

TEST(VaryingH0, aFixedH0PushesAlongTheCurve) {
    // Theorem: moving points along a curve changes E by that power, theory.md (4.15), since the shape stays the same.
    const CurveSpace space(Topology::cell, equal_breaks(30), 7, 6);
    CurveForms forms(space, varying(bending(0.2, 0, 0.03, 0.06), "-1 + 0.7*sin(3*area)"));
    const Vector x = fit(space, meridian(Ellipsoid{1, 1, 1.5}));
    forms.fix_H0(x);
    const auto slide = [](double s) { return std::sin(pi * s) * std::cos(2 * pi * s); };
    const Vector along = space.project([&](double s) {
        const CurveSample p = space.evaluate(x, s);
        return std::array{slide(s) * p.r1, slide(s) * p.z1};
    });
    Vector power = Vector::Zero(space.size());
    forms.add_sliding(x.data(), power.data());
    const double slope = forms.gradient({.energy = 1}, x).dot(along);
    EXPECT_GT(std::abs(slope), 0.1);
    EXPECT_NEAR(slope + power.dot(along), 0, 1e-7 * std::abs(slope));
}

// Cases as text, run to their end.
struct Outcome {
    Case c;
    Recorder log;
    tubule::RunSummary summary;
    double last(const std::string& name) const { return log.rows.back()[column(name)]; }
    double first(const std::string& name) const { return log.rows.front()[column(name)]; }
    const std::vector<double>& array(const std::string& name) const {
        return find_array(log.frames.back(), name)->data;
    }
    std::size_t column(const std::string& name) const {
        const std::vector<std::string> names = c.equilibrium ? equilibrium_series_names(c) : series_names(c);
        return std::find(names.begin(), names.end(), name) - names.begin();
    }
};
Outcome run_text(const std::string& text, const std::vector<std::string>& sets = {}) {
    Outcome out{parse_case("tier = \"axisym\"\n" + text, sets, "case.toml"), {}, {}};
    out.summary = out.c.equilibrium ? run_equilibrium(out.c, out.log) : run_profile(out.c, out.log);
    return out;
}

// The last frame, a tube with E = 0, has this largest |H - H0| and these largest differences of theory.md (4.17) where
// H0 is constant to 1e-6, in either half.
struct Delaunay {
    double curvature = 0, low = 0, high = 0, rounder = 0;
    explicit Delaunay(const Outcome& o) {
        const auto &r = o.array("r"), &z = o.array("z"), &H = o.array("H"), &H0 = o.array("H0");
        const auto [least, most] = std::ranges::minmax(H0);
        std::vector<double> lows, highs;
        for (std::size_t i = 0; i < r.size(); ++i) {
            curvature = std::max(curvature, std::abs(H[i] - H0[i]));
            if (i < 2 || i + 2 >= r.size()) continue;
            // The slope of the profile from four points beside: of fourth order in their distance.
            const auto slope = [&](const std::vector<double>& x) {
                return 8 * (x[i + 1] - x[i - 1]) - (x[i + 2] - x[i - 2]);
            };
            const double dr = slope(r), dz = slope(z), sum = r[i] * dz / std::hypot(dr, dz) + H0[i] * r[i] * r[i] / 2;
            if (H0[i] - least < 1e-6) lows.push_back(sum);
            if (most - H0[i] < 1e-6) highs.push_back(sum);
        }
        const auto spread = [](const std::vector<double>& values) {
            const auto [from, to] = std::ranges::minmax(values);
            return to - from;
        };
        low = spread(lows), high = spread(highs);
        rounder = std::ranges::max(r) - std::ranges::min(r);
    }
};

const std::string two_halves =
    "[energy]\nk20 = 0.5\nH0 = \"-1 + 0.1*(tanh((z - 2)/0.15) - tanh((z - 6)/0.15) - 1)\"\n"
    "[shape]\nkind = \"tube\"\nradius = 1.0\nlength = 8.0\n";

TEST(VaryingH0, aTubeOfTwoHalvesFlowsToDelaunaySurfaces) {
    // Exact: the flow ends where E = 0, and there theory.md (4.17) holds in each half.
    const Outcome o = run_text(two_halves + "[time]\nend = 60\n[accuracy]\nenergy = 1e-6\n");
    ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
    EXPECT_LT(o.last("energy"), 1e-6 * o.first("energy"));
    EXPECT_LT(std::abs(o.last("identity_defect")), 1e-6 * o.summary.reference_energy);
    const Delaunay found(o);
    EXPECT_LT(found.curvature, 2e-4);
    EXPECT_LT(std::max(found.low, found.high), 2e-4);
    EXPECT_GT(found.rounder, 0.2);
}

TEST(VaryingH0, aTubeOfTwoHalvesRestsAsDelaunaySurfaces) {
    // Exact: as above, with H0 of the area from the middle of a half.
    const Outcome o = run_text(
        "[energy]\nk20 = 0.5\nH0 = \"-1 + 0.1*(tanh((area - 0.25)/0.02) - tanh((area - 0.75)/0.02) - 1)\"\n"
        "[shape]\nkind = \"tube\"\nradius = 1.0\nlength = 8.0\n[model]\nvolume = \"free\"\narea = \"free\"\n"
        "[equilibrium]\n[accuracy]\nenergy = 1e-10\n");
    ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
    EXPECT_LT(o.last("energy"), 1e-9);
    const Delaunay found(o);
    EXPECT_LT(found.curvature, 1e-5);
    EXPECT_LT(std::max(found.low, found.high), 5e-5);  // where H0 changes the mesh is finer than here
    EXPECT_GT(found.rounder, 0.1);
}

const std::string two_domains =
    "[energy]\nk20 = 0.5\nH0 = \"-2 - tanh((area - 0.6)/0.1)\"\n[shape]\nkind = \"sphere\"\nradius = 1.0\n";

TEST(VaryingH0, aCellOfTwoDomainsRests) {
    // Independent computation: the shape equations with H0 of the area below, whose slope is 2 pi r, as a boundary
    // value problem in the tangent angle, r and their momenta, by collocation with a tolerance of 1e-9 (scipy's
    // solve_bvp); energy 4.3320484329, height 2.1703008982, largest radius 0.93862710.
    const Outcome o = run_text(two_domains + "[model]\nvolume = \"free\"\n[equilibrium]\n[accuracy]\nenergy = 1e-9\n");
    ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
    EXPECT_NEAR(o.last("energy"), 4.3320484329, 1e-7);
    EXPECT_NEAR(o.last("height"), 2.1703008982, 1e-5);
    EXPECT_NEAR(o.last("r_max"), 0.93862710, 1e-5);
    EXPECT_NEAR(o.last("area"), 4 * pi, 1e-9);
    EXPECT_EQ(o.last("negative_directions"), 0);
}

TEST(VaryingH0, motionsLoseWhatTheyDissipateAndEndAtRest) {
    // Theorems: the dissipation identities (3.12) to (3.14); and every model that keeps the area locally comes to rest
    // at the shape above, from wherever it starts with that area.
    for (const char* model : {"gradient-flow", "overdamped", "stokes", "fluid"}) {
        const bool flows = std::string(model) != "gradient-flow";
        const Outcome o =
            run_text(two_domains + "mode = [{amplitude = 0.1, l = 2}]\n[time]\nend = 0.1\n[accuracy]\nenergy = 1e-5\n",
                     {std::string("model.kind=") + model, "model.volume=free"});
        SCOPED_TRACE(model);
        ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
        for (const auto& row : o.log.rows)
            EXPECT_LT(std::abs(row[o.column("identity_defect")]), 3e-5 * o.summary.reference_energy);
        EXPECT_LT(o.last("energy"), 0.98 * o.first("energy"));
        if (flows) {
            EXPECT_NEAR(o.last("area") / o.first("area"), 1, 1e-7);
        }
    }
    const Outcome rest = run_text(two_domains + "[time]\nend = 20\n[accuracy]\nenergy = 1e-7\n",
                                  {"model.kind=overdamped", "model.volume=free"});
    ASSERT_EQ(rest.summary.stop.reason, Stop::finished) << rest.summary.stop.message;
    EXPECT_NEAR(rest.last("energy"), 4.3320484329, 1e-6 * rest.summary.reference_energy);
}

// A sphere of fixed area and volume is the only shape that has both.
TEST(VaryingH0, aSphereOfFixedAreaAndVolumeIsRefused) {
    for (const char* model : {"kind = \"overdamped\"", "area = \"fixed\"\nvolume = \"fixed\""}) {
        const std::string text = fmt::format(
            "tier = \"axisym\"\n[energy]\nk20 = 0.5\nH0 = \"-1 + 3*sin(6*area)\"\n[model]\n{}\n"
            "[shape]\nkind = \"sphere\"\nradius = 1\n[time]\nend = 0.1\n",
            model);
        EXPECT_CONTAINS(test::message_of<CaseError>([&] { run_case(parse_case(text, {}, "case.toml")); }),
                        "no other shape has these");
    }
}

TEST(VaryingH0, aConstantFormulaIsTheNumber) {
    // Definition; the parametrisation of a gradient flow differs, and with it the error of the mesh.
    for (const char* model : {"gradient-flow", "overdamped", "fluid"}) {
        const std::string text =
            "[energy]\nk20 = 0.5\nk42 = 0.05\nH0 = -1.0\n[shape]\nkind = \"ellipsoid\"\na = 0.8\nb = 0.8\nc = "
            "1.3\n[time]\nend = 0.05\n[accuracy]\nenergy = 1e-6\n";
        const std::vector<std::string> sets{std::string("model.kind=") + model};
        const Outcome number = run_text(text, sets), formula = run_text(text, {sets[0], "energy.H0=\"-1 + 0*area\""});
        EXPECT_NEAR(formula.last("energy"), number.last("energy"), 2e-6 * number.summary.reference_energy) << model;
    }
}

// The unit sphere, on which (1 + z)/2 is the part of the area below, with the domains of the tests above.
ProfilePoints domains_by_points() {
    return {
        200, [](double t) {
            const double z = -std::cos(pi * t);
            return std::array{t == 0 || t == 1 ? 0 : std::sin(pi * t), z, -2 - std::tanh(((1 + z) / 2 - 0.6) / 0.1)};
        }};
}

TEST(VaryingH0, ofThePointsOfAProfileIsThatOfTheFormula) {
    // Definition: both say the same, to the tolerances of the fit, 1e-8 and 1e-7; the energy of a run is asked to 1e-6.
    const ProfilePoints points = domains_by_points();
    const std::string energy = "[energy]\nk20 = 0.5\n";
    for (const char* model : {"gradient-flow", "overdamped"}) {
        SCOPED_TRACE(model);
        const std::string more = "[time]\nend = 0.1\n[accuracy]\nenergy = 1e-6\n";
        const std::vector<std::string> sets{std::string("model.kind=") + model, "model.volume=free"};
        const Outcome formula = run_text(two_domains + more, sets),
                      column = run_text(energy + points.shape(more), sets);
        ASSERT_EQ(column.summary.stop.reason, Stop::finished) << column.summary.stop.message;
        EXPECT_NEAR(column.first("energy"), formula.first("energy"), 1e-6 * formula.summary.reference_energy);
        EXPECT_NEAR(column.last("energy"), formula.last("energy"), 2e-6 * formula.summary.reference_energy);
        EXPECT_LT(column.last("energy"), 0.98 * column.first("energy"));
        for (const auto& row : column.log.rows)
            EXPECT_LT(std::abs(row[column.column("identity_defect")]), 3e-6 * column.summary.reference_energy);
        const auto [low, high] = std::ranges::minmax(column.array("H0"));
        EXPECT_NEAR(low, -2 - std::tanh(4), 1e-6);
        EXPECT_NEAR(high, -2 + std::tanh(6), 1e-6);
    }
    // Independent computation: as aCellOfTwoDomainsRests.
    const Outcome rest =
        run_text(energy + points.shape("[model]\nvolume = \"free\"\n[equilibrium]\n[accuracy]\nenergy = 1e-8\n"));
    ASSERT_EQ(rest.summary.stop.reason, Stop::finished) << rest.summary.stop.message;
    EXPECT_NEAR(rest.last("energy"), 4.3320484329, 1e-6);
    EXPECT_NEAR(rest.last("height"), 2.1703008982, 1e-5);
}

TEST(VaryingH0, ofThePointsOfATubeIsThatOfTheFormula) {
    // Definition: as above; the area of the wavy tube up to z, by integration along it.
    const auto radius = [](double z) { return 1 + 0.1 * std::cos(pi * z / 4); };
    const auto area_below = [&](double z) {
        double sum = 0;
        const int n = 2000;
        for (int i = 0; i < n; ++i) {
            const double at = z * (i + 0.5) / n, slope = -0.1 * pi / 4 * std::sin(pi * at / 4);
            sum += radius(at) * std::hypot(1, slope) * z / n;
        }
        return sum;
    };
    const double whole = area_below(8);
    const ProfilePoints points(160, [&](double t) {
        return std::array{radius(8 * t), 8 * t, -1 + 0.2 * std::cos(2 * pi * area_below(8 * t) / whole)};
    });
    const std::string energy = "[energy]\nk20 = 0.5\n", more = "[time]\nend = 1.0\n[accuracy]\nenergy = 1e-6\n";
    const Outcome formula =
        run_text(energy + "H0 = \"-1 + 0.2*cos(2*pi*area)\"\n[shape]\nkind = \"tube\"\nradius = 1.0\nlength = 8.0\n" +
                 "mode = [{amplitude = 0.1, n = 1}]\n" + more);
    const Outcome column = run_text(energy + points.shape("length = 8.0\n" + more));
    ASSERT_EQ(column.summary.stop.reason, Stop::finished) << column.summary.stop.message;
    EXPECT_NEAR(column.first("energy"), formula.first("energy"), 1e-6 * formula.summary.reference_energy);
    EXPECT_NEAR(column.last("energy"), formula.last("energy"), 2e-6 * formula.summary.reference_energy);
    EXPECT_LT(column.last("energy"), 0.9 * column.first("energy"));
    // In equilibria, half of a tube: the column must have its symmetry.
    EXPECT_SAYS(message_of<CaseError>([&] {
                    const ProfilePoints slanted(160, [&](double t) {
                        return std::array{1.0, 8 * t, -1 + 0.2 * std::sin(2 * pi * t)};
                    });
                    run_text(energy + slanted.shape("length = 8.0\n[equilibrium]\n"));
                }),
                "shape.path has a column H0, but H0 must be mirror-symmetric");
}

TEST(VaryingH0, isWrittenAsItIsRead) {
    const Case c = parse_case("tier = \"axisym\"\n" + two_halves + "[time]\nend = 1.0\n", {}, "case.toml");
    const Case again = parse_case(effective_toml(c), {}, "case.toml");
    ASSERT_TRUE(again.energy.H0_varies());
    EXPECT_EQ(again.energy.H0_formula->text, c.energy.H0_formula->text);
}

std::string refused(const std::string& text, const std::vector<std::string>& sets = {}) {
    return message_of<CaseError>([&] { run_text(text, sets); });
}

TEST(VaryingH0, refusals) {
    const std::string tube = two_halves + "[time]\nend = 1.0\n";
    EXPECT_SAYS(refused(tube, {"energy.H0=\"-1 + x\""}), "there is no 'x'; allowed are area, r, z");
    EXPECT_SAYS(refused(tube, {"energy.H0=[1]"}), "energy.H0 must be a number, or a formula of area, r, z");
    EXPECT_SAYS(refused(tube, {"energy.H0=\"log(z - 1)\""}), "energy.H0 is no number where");
    EXPECT_SAYS(refused(tube, {"energy.H0=\"-1 - 0.1*area\""}),
                "energy.H0 must be the same at both ends of the period");
    EXPECT_SAYS(refused("[energy]\nk20 = 0.5\nH0 = \"-1 + 0.1*sin(2*pi*area)\"\n[shape]\nkind = \"tube\"\nradius = "
                        "1.0\nlength = 8.0\n[equilibrium]\n"),
                "energy.H0 must be mirror-symmetric");
}

}  // namespace tubule::axisym::varying_H0_test
