// Profile curves: parities at poles and planes of symmetry, functionals and their derivatives, starts.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "axisym/curve/curve_forms.hpp"
#include "axisym/graph/graph_forms.hpp"
#include "axisym/graph/graph_mesh.hpp"
#include "axisym/splines/arc_length.hpp"
#include "axisym/splines/breaks.hpp"
#include "common/geometry/profile_point.hpp"
#include "common/solve/derivative_check.hpp"
#include "tests/axisym/runs.hpp"
#include "tests/support/message_of.hpp"
#include "tests/support/random_vector.hpp"

namespace tubule::axisym::curve_test {

using Vector = Eigen::VectorXd;

using test::random_vector;

std::vector<double> uneven_breaks(int n) {
    std::vector<double> breaks = equal_breaks(n);
    for (double& s : breaks) s += 0.1 * std::sin(2 * pi * s) / (2 * pi);
    breaks.back() = 1;
    return breaks;
}

// A closed curve, half of one, or a period, disturbed beyond symmetry and smoothness.
Vector rough(const CurveSpace& space, double size = 0.02) {
    const Curve whole = space.closed()       ? meridian(Ellipsoid{1, 1, 1.5})
                        : space.length() > 0 ? meridian(Tube{1, space.length(), {{0.2, 1, 0, 0}}})
                                             : meridian(Torus{2, 0.7});
    return fit(space, space.images() == 2 ? half(whole) : whole) + random_vector(space.size(), size);
}

using test::message_of;

TEST(SplineSpace, parityAtTheEnds) {
    // Definition: an odd function and its second derivative vanish, an even one's first derivative does. Sizes for odd
    // degrees and simple knots: n + 1 even ones, one less for each odd end; even degrees have n, whatever the parity.
    for (int degree = 2; degree <= 7; ++degree)
        for (int smoothness = 1; smoothness < degree; ++smoothness)
            for (const Parity parity : {Parity{1, 1}, Parity{1, -1}, Parity{-1, 1}, Parity{-1, -1}}) {
                const int n = 6, m = degree - smoothness;
                const SplineSpace field({0, 1, true, 1}, uneven_breaks(n), degree, smoothness, parity);
                if (m == 1) {
                    const int absent = (parity.start < 0) + (parity.end < 0);
                    EXPECT_EQ(field.size(), n + (degree % 2 == 1 ? 1 - absent : 0));
                }
                const Vector c = random_vector(field.size(), 1);
                for (int end = 0; end < 2; ++end) {
                    const double s = end, scale = std::pow(n, 2);
                    const auto [f, f1, f2] = field.evaluate(c.data(), s);
                    const bool odd = (end == 0 ? parity.start : parity.end) < 0;
                    EXPECT_NEAR(odd ? f : f1, 0, 1e-12 * scale) << degree << smoothness;
                    EXPECT_NEAR(odd && smoothness > 1 ? f2 : 0, 0, 1e-10 * scale) << degree << smoothness;
                }
                // Every coefficient matters, and none acts twice: projection finds them again.
                const Vector again = field.project([&](double s) { return field.evaluate(c.data(), s)[0]; });
                EXPECT_LT((again - c).norm(), 1e-9 * c.norm()) << degree << smoothness;
            }
}

TEST(CurveSpace, refusesWhatMakesNoCurve) {
    EXPECT_EQ(message_of<std::invalid_argument>([] { CurveSpace(Topology::cell, equal_breaks(4), 4, 3); }),
              "spline degree must be 3, 5 or 7");
    EXPECT_EQ(message_of<std::invalid_argument>([] {
                  CurveSpace(Topology::cell, {0, 1, 2}, 5, 4);
              }),
              "breaks must run from 0 to 1");
    EXPECT_EQ(message_of<std::invalid_argument>([] { CurveSpace(Topology::cell, equal_breaks(4), 5, 4, 1.0); }),
              "the length must be positive for a tube, 0 for a torus, a closed cell or a patch");
    EXPECT_EQ(message_of<std::invalid_argument>([] {
                  const CurveSpace a(Topology::cell, equal_breaks(4), 5, 4),
                      b(Topology::tube, equal_breaks(4), 5, 4, 1);
                  a.prolong(b, Vector::Zero(b.size()));
              }),
              "curves of different topology or period cannot be prolonged to each other");
}

TEST(CurveSpace, prolongationIsTheSameCurve) {
    // Theorem: splines on a mesh are splines on any mesh with more knots.
    for (const Topology topology : {Topology::cell, Topology::half_cell, Topology::tube, Topology::half_tube}) {
        const double length = topology == Topology::tube || topology == Topology::half_tube ? 2.5 : 0;
        const CurveSpace coarse(topology, equal_breaks(5), 5, 4, length),
            fine(topology, equal_breaks(10), 5, 4, length);
        const Vector x = rough(coarse), y = fine.prolong(coarse, x);
        for (double s : {0.0, 0.13, 0.5, 0.77, 1.0}) {
            const CurveSample a = coarse.evaluate(x, s), b = fine.evaluate(y, s);
            EXPECT_NEAR(a.r, b.r, 1e-12);
            EXPECT_NEAR(a.z, b.z, 1e-12);
            EXPECT_NEAR(a.z1, b.z1, 1e-10);
        }
    }
}

TEST(CurveForms, derivativesOfEveryFunctional) {
    // Theorem: Taylor remainders fall with the second power of the step (common/solve/derivative_check.hpp).
    const Bending law = bending(0.2, -2, 0.03, 0.06);
    for (const Weights& weights : {Weights{.energy = 1}, Weights{.area = 1}, Weights{.volume = 1}, Weights{.gauge = 1},
                                   Weights{1, -0.7, 1.3, 0.4}})
        for (int degree : {3, 5, 7})
            for (const Topology topology : {Topology::cell, Topology::half_cell, Topology::tube, Topology::half_tube}) {
                const double length = topology == Topology::tube || topology == Topology::half_tube ? 2.5 : 0;
                const CurveSpace space(topology, uneven_breaks(7), degree, degree - 1, length);
                const CurveForms forms(space, law);
                const Vector x = rough(space);
                ASSERT_TRUE(forms.admissible(x));
                const auto check = check_derivatives(
                    [&](const Vector& y) { return forms.value(weights, y); },
                    [&](const Vector& y) { return forms.gradient(weights, y); },
                    [&](const Vector& y, const Vector& w) -> Vector { return forms.hessian(weights, y) * w; }, x);
                EXPECT_TRUE(check.pass()) << degree << "\n" << check.text();
                EXPECT_FALSE(std::isnan(check.gradient.slope));
            }
}

TEST(CurveForms, mass) {
    // Exact: INT |dX|^2 dS is the area for a shift along the axis, and INT r^2 dS = 8 pi/3 R^4 for dX = r e_r.
    for (const Topology topology : {Topology::cell, Topology::half_cell}) {
        const Curve m = topology == Topology::cell ? meridian(Sphere{}) : half(meridian(Sphere{}));
        const CurveSpace space(topology, equal_breaks(20), 7, 6);
        const CurveForms forms(space, bending(1));
        const Vector x = fit(space, m);
        const int n = space.r().size();
        Vector radial = x, axial = Vector::Zero(x.size());
        radial.tail(space.z().size()).setZero();
        const auto mass = forms.mass(x);
        EXPECT_NEAR(radial.dot(mass * radial), 8 * pi / 3, 1e-10);
        if (topology == Topology::cell) {
            axial.tail(x.size() - n).setOnes();
            EXPECT_NEAR(axial.dot(mass * axial), 4 * pi, 1e-10);
            EXPECT_NEAR(radial.dot(mass * axial), 0, 1e-12);
        }
    }
}

TEST(CurveForms, tellsWhatIsInadmissible) {
    const CurveSpace space(Topology::cell, equal_breaks(6), 5, 4);
    const CurveForms forms(space, bending(1));
    Vector x = fit(space, meridian(Sphere{}));
    EXPECT_TRUE(forms.admissible(x));
    x.head(space.r().size()) *= -1;
    EXPECT_FALSE(forms.admissible(x));
    Vector gradient = Vector::Zero(space.size());
    EXPECT_FALSE(forms.add_gradient({.energy = 1}, x.data(), gradient.data()));
}

CurveObservation observe(const Curve& m, const Bending& law, std::vector<double> breaks, int degree, int smoothness) {
    const CurveSpace space(m.topology, std::move(breaks), degree, smoothness, m.length);
    return CurveForms(space, law).observe(fit(space, m));
}
CurveObservation observe(const Curve& m, const Bending& law, int elements = 40, int degree = 7) {
    return observe(m, law, equal_breaks(elements), degree, degree - 1);
}

TEST(CurveForms, sphere) {
    // Exact: H = -2/R, K = 1/R^2.
    const double R = 1.3, h = -2 / R + 0.4;
    const auto o = observe(meridian(Sphere{R, {}}), bending(0.2, -0.4, 0.03, 0.06));
    EXPECT_NEAR(o.area, 4 * pi * R * R, 1e-11);
    EXPECT_NEAR(o.volume, 4 * pi / 3 * R * R * R, 1e-11);
    EXPECT_NEAR(o.energy_term[0], 0.2 * h * h * 4 * pi * R * R, 1e-11);
    EXPECT_NEAR(o.energy_term[1], 0.03 * std::pow(h, 4) * 4 * pi * R * R, 1e-11);
    EXPECT_NEAR(o.energy_term[2], 0.06 * 4 * pi / (R * R), 1e-11);
    EXPECT_NEAR(o.length, pi * R, 1e-11);
    EXPECT_NEAR(o.gauge, 0, 1e-14);
    EXPECT_NEAR(o.r_max, R, 1e-3);
    EXPECT_NEAR(o.curvature, 1 / R, 1e-6);
    EXPECT_NEAR(o.symbol, 0.4 + 12 * 0.03 * h * h + 2 * 0.06 / (R * R), 1e-6);  // theory.md (2.14), x = -1/R
    EXPECT_NEAR(o.symbol_3d, o.symbol, 1e-6);
}

TEST(CurveForms, closedShapesWithExactValues) {
    // Exact: theory.md (7.1), (7.3), (7.4).
    const double a = 1, c = 1.5;
    const auto spheroid = observe(meridian(Ellipsoid{a, a, c}), bending(1, 0, 0, 1), 80);
    const double H2 = 4 * pi *
                      (7.0 / 3 + 2 * a * a / (3 * c * c) +
                       c * c / a * std::asin(std::sqrt(1 - a * a / (c * c))) / std::sqrt(c * c - a * a));
    EXPECT_NEAR(spheroid.volume, volume(Ellipsoid{a, a, c}), 1e-11);
    EXPECT_NEAR(spheroid.energy_term[0], H2, 1e-9);
    EXPECT_NEAR(spheroid.energy_term[2], integral_K2(Ellipsoid{a, a, c}), 1e-9);

    const auto dumbbell = observe(meridian(Dumbbell{}), bending(1), 80);
    EXPECT_NEAR(dumbbell.area, Dumbbell::exact_area, 2e-12);
    EXPECT_NEAR(dumbbell.volume, Dumbbell::exact_volume, 2e-12);

    const Torus ring{2, 0.7};
    const auto torus = observe(meridian(ring), bending(1, 0, 0, 1), 60);
    EXPECT_NEAR(torus.area, area(ring), 1e-10);
    EXPECT_NEAR(torus.volume, volume(ring), 1e-10);
    EXPECT_NEAR(torus.energy_term[0], integral_H2(ring), 1e-9);
    EXPECT_NEAR(torus.energy_term[2], integral_K2(ring), 1e-9);

    // Exact: volume of (1 + a Y_20) x is INT (1 + a Y)^3/3 = 4 pi/3 + a^2 + a^3/21 sqrt(5/pi).
    const double amplitude = 0.3;
    const auto mode = observe(meridian(Sphere{1, {{amplitude, 2, 0}}}), bending(1));
    EXPECT_NEAR(mode.volume, 4 * pi / 3 + amplitude * amplitude + std::pow(amplitude, 3) / 21 * std::sqrt(5 / pi),
                1e-10);
    EXPECT_GT(mode.energy, 16 * pi);  // Willmore
}

TEST(CurveForms, capsule) {
    // Exact: theory.md (7.7), (7.8). Curvature jumps at the seams, so knots of the least smoothness there.
    const Capsule capsule{0.5, 2};
    const ArcLength arc(meridian(capsule));
    ASSERT_EQ(arc.seams().size(), 2u);
    const auto o =
        observe(meridian(capsule), bending(0.125, -2, 0, 0.06), graded_breaks(arc.seams(), 0.05, 0.05), 7, 1);
    EXPECT_NEAR(o.area, area(capsule), 1e-11);
    EXPECT_NEAR(o.volume, volume(capsule), 1e-11);
    EXPECT_NEAR(o.energy, 4 * pi * (0.125 + 0.06 / 0.25), 1e-9);
    EXPECT_NEAR(o.length, pi * 0.5 + 2, 1e-12);
    // Smooth splines on graded elements come near.
    const auto smooth =
        observe(meridian(capsule), bending(0.125, -2, 0, 0.06), graded_breaks(arc.seams(), 0.08, 1e-5), 5, 4);
    EXPECT_NEAR(smooth.energy, o.energy, 2e-4);
    EXPECT_NEAR(smooth.area, o.area, 1e-7);
}

TEST(CurveForms, ordersOfConvergence) {
    // Theorem: a best approximation of degree p loses energy of order 2 (p - 1); a projection of an exact curve is as
    // good, since first variations are integrated against a smooth force.
    struct Expected {
        int degree, elements;
        double order, error;
    };
    const double exact = integral_K2(Ellipsoid{1, 1, 1.5});
    for (const auto& [degree, elements, order, error] :
         {Expected{3, 28, 3.6, 5e-6}, Expected{5, 28, 7.5, 1e-9}, Expected{7, 19, 9.0, 3e-9}}) {
        double e[2];
        for (int i = 0; i < 2; ++i)
            e[i] = std::abs(observe(meridian(Ellipsoid{1, 1, 1.5}), bending(0, 0, 0, 1), elements << i, degree).energy -
                            exact);
        EXPECT_GT(std::log2(e[0] / e[1]), order) << degree << ", errors " << e[0] << " " << e[1];
        EXPECT_LT(e[1], error) << degree;
    }
}

TEST(CurveForms, halvesAreWorthTheirWhole) {
    // Exact: symmetry.
    const Bending law = bending(0.2, -2, 0.03, 0.06);
    for (const Curve& whole : {meridian(Dumbbell{}), meridian(Tube{1, 2.5, {{0.2, 1, 0, 0}}})}) {
        const auto a = observe(whole, law, 40), b = observe(half(whole), law, 20);
        EXPECT_NEAR(a.energy, b.energy, 1e-9 * a.energy);
        EXPECT_NEAR(a.area, b.area, 1e-10);
        EXPECT_NEAR(a.volume, b.volume, 1e-10);
        EXPECT_NEAR(a.length, b.length, 1e-10);
    }
    EXPECT_EQ(message_of<std::invalid_argument>([] {
                  half(meridian(Sphere{1, {{0.2, 3, 0}}}));
              }),
              "the curve is not symmetric about the middle of its parameter range");
    EXPECT_EQ(message_of<std::invalid_argument>([] { half(half(meridian(Sphere{}))); }),
              "the curve is already one half");
}

TEST(CurveForms, tubesAgreeWithTheirGraphs) {
    // Expected: the same integrals of the graph r(z), by Forms.
    const Tube tube{1, 2, {{0.3, 1, 0, 0.4}, {0.05, 3, 0, 0}}};
    const Bending law = bending(0.2, -2, 0.03, 0.06);
    const Cell cell{0, 2, false, 1};
    const SplineSpace space(cell, equal_breaks(80, cell), 7, 6);
    const Vector x = space.project([&](double z) { return radius_at(tube, z); }), rest = Vector::Zero(x.size());
    const Observation graph = Forms(space, law).observe(x.data(), rest.data());
    const auto curve = observe(meridian(tube), law, 160);
    EXPECT_NEAR(curve.energy, graph.energy, 1e-8 * graph.energy);
    EXPECT_NEAR(curve.area, graph.area, 1e-10);
    EXPECT_NEAR(curve.volume, graph.volume, 1e-10);
    EXPECT_NEAR(curve.symbol_3d, graph.symbol_3d, 2e-3 * graph.symbol_3d);
}

TEST(CurveForms, defectMeasuresTheEnergyLost) {
    // Theorem: of the size of the error, up to the first variation, which is of higher order for low degrees only.
    // (Where it vanishes: EquilibriumTest.)
    for (int degree : {3, 5})
        for (const Topology topology : {Topology::cell, Topology::half_cell}) {
            const Curve whole = meridian(Ellipsoid{1, 1, 1.5});
            const CurveSpace space(topology,
                                   equal_breaks((degree == 3 ? 20 : 40) / (topology == Topology::cell ? 1 : 2)), degree,
                                   degree - 1);
            const CurveForms forms(space, bending(0, 0, 0, 1));
            std::vector<double> defect;
            const auto o = forms.observe(fit(space, topology == Topology::cell ? whole : half(whole)), &defect);
            double sum = 0;
            for (double d : defect) sum += d;
            const double error = std::abs(o.energy - integral_K2(Ellipsoid{1, 1, 1.5}));
            EXPECT_LT(error, 20 * sum) << degree << " " << error << " " << sum;
            EXPECT_GT(error, sum / 20) << degree << " " << error << " " << sum;
        }
}

TEST(CurveStart, meridiansFromPointsAndCurves) {
    // Exact: points of a known curve give that curve, to the order of their polynomials of degree 6.
    const auto through = [](const Curve& m, int n) {
        std::vector<double> r, z;
        for (int i = 0; i <= n; ++i) {
            const double t = (i + 0.3 * std::sin(2 * pi * i / n)) / n;
            r.push_back(m.at(t)[0]), z.push_back(m.at(t)[2]);
        }
        return meridian(curve_through(r, z, m.length));
    };
    const Bending law = bending(0.2, -2, 0.03, 0.06);
    for (const Curve& m :
         {meridian(Ellipsoid{1, 1, 1.5}), meridian(Torus{2, 0.7}), meridian(Tube{1, 2.5, {{0.2, 1, 0, 0}}})}) {
        const auto exact = observe(m, law, 60);
        const auto found = observe(through(m, 120), law, 60);
        EXPECT_NEAR(found.energy, exact.energy, 1e-6 * exact.energy);
        EXPECT_NEAR(found.volume, exact.volume, 1e-7 * exact.volume);
        const CurveSpace space(m.topology, equal_breaks(60), 7, 6, m.length);
        const auto again = observe(meridian(space, fit(space, m)), law, 60);
        EXPECT_NEAR(again.energy, exact.energy, 1e-9 * exact.energy);
    }
}

TEST(CurveStart, refusals) {
    EXPECT_EQ(message_of<std::invalid_argument>([] {
                  meridian(Sphere{1, {{0.2, 3, 2}}});
              }),
              "shape.mode.0.m must be 0, not 2: tier \"axisym\" is axisymmetric and has no modes m > 0");
    EXPECT_EQ(message_of<std::invalid_argument>([] {
                  meridian(Tube{1, 2, {{0.2, 3, 1, 0}}});
              }),
              "shape.mode.0.m must be 0, not 1: tier \"axisym\" is axisymmetric and has no modes m > 0");
    EXPECT_EQ(message_of<std::invalid_argument>([] {
                  meridian(Ellipsoid{1, 2, 1});
              }),
              "shape.b must be a = 1, not 2: tier \"axisym\" is axisymmetric about z");
    const CurveSpace space(Topology::cell, equal_breaks(6), 5, 4);
    EXPECT_EQ(message_of<std::invalid_argument>([&] { fit(space, meridian(Torus{})); }),
              "the curve does not have the topology or the period of its space");
}

}  // namespace tubule::axisym::curve_test
