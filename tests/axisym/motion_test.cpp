// The laws of motion of a profile curve: derivatives, consistent starts, inf-sup stability.
#include <gtest/gtest.h>

#include "axisym/curve/curve_motion.hpp"
#include "axisym/splines/arc_length.hpp"
#include "axisym/splines/breaks.hpp"
#include "common/geometry/profile_point.hpp"
#include "common/shapes/torus.hpp"
#include "common/shapes/tube.hpp"
#include "common/solve/dense.hpp"
#include "common/solve/derivative_check.hpp"
#include "tests/support/random_vector.hpp"

namespace tubule::axisym::motion_test {

using Vector = Eigen::VectorXd;

using test::random_vector;

const Bending stiff{{0.2, 0.03, 0.1}, -0.7};
Bending with_alpha(Bending energy) {
    energy.alpha = 0.4, energy.M0 = -9;
    return energy;
}
const MotionLaw gradient_flow{.inextensible = false, .keeps_volume = false};
const MotionLaw gradient_flow_volume{.inextensible = false};
const MotionLaw overdamped{.friction = 1};
const MotionLaw stokes{.viscosity = 0.5};
const MotionLaw fluid{.inertia = 1, .viscosity = 0.5, .friction = 0.1};
CurveLaw curve_law(const MotionLaw& law, bool lagrangian, bool swirls) {
    CurveLaw out = law;
    out.lagrangian = lagrangian, out.swirls = swirls;
    return out;
}
const CurveLaw swirling = curve_law(fluid, false, true), lagrangian = curve_law(fluid, true, true);
const std::vector<CurveLaw> laws{gradient_flow, gradient_flow_volume, overdamped, stokes, fluid, swirling, lagrangian};

// What is kept and what acts on the rest, of extensible and inextensible laws; free periods of tubes alone.
std::vector<CurveLaw> ensembles(bool tube) {
    const std::string_view V[]{"V"};
    MotionLaw osmosis = gradient_flow, osmosis_of_flow = stokes;
    osmosis.pressure_of_volume = osmosis_of_flow.pressure_of_volume =
        std::make_shared<const Formula>(parse_formula("0.7*(2/V - 1)", V));
    osmosis_of_flow.keeps_volume = false;
    MotionLaw loaded = gradient_flow, held = gradient_flow_volume, fed = stokes, swelling = fluid;
    loaded.tension = 0.3, loaded.pressure = 0.2;
    held.keeps_area = true;
    fed.reservoir = true, fed.tension = 0.3;
    swelling.reservoir = true, swelling.keeps_volume = false, swelling.tension = 0.3, swelling.pressure = 0.2;
    std::vector<CurveLaw> out{loaded, held, fed, swelling, osmosis, osmosis_of_flow};
    for (const CurveLaw& law : {CurveLaw(fed), CurveLaw(swelling)})
        out.push_back(law), out.back().holds_area = false, out.back().lagrangian = true;
    if (!tube) return out;
    for (MotionLaw pulled : {gradient_flow_volume, held, overdamped, fluid, fed, osmosis_of_flow}) {
        pulled.free_period = true, pulled.force = 0.7;
        out.push_back(pulled);
    }
    out.push_back(curve_law(out.back(), true, false));
    out.push_back(curve_law(fluid, false, true)), out.back().free_period = true, out.back().force = 0.7;
    return out;
}

Vector some_curve(const CurveSpace& space) {
    const Curve whole = space.closed()       ? meridian(Ellipsoid{1, 1, 1.5})
                        : space.length() > 0 ? meridian(Tube{1, space.length(), {{0.2, 1, 0, 0}}})
                                             : meridian(Torus{2, 0.7});
    return fit(space, space.images() == 2 ? half(whole) : whole);
}

TEST(CurveMotion, jacobianIsTheDerivative) {
    for (const Topology topology : {Topology::cell, Topology::half_cell, Topology::tube, Topology::half_tube})
        for (const bool plain : {true, false}) {
            const bool tube = topology == Topology::tube || topology == Topology::half_tube;
            for (const CurveLaw& law : plain ? laws : ensembles(tube)) {
                const CurveSpace space(topology, equal_breaks(6), 5, 4, tube ? 3 : 0, law.free_period);
                const bool whole = topology == Topology::cell || topology == Topology::tube;
                const CurveMotion motion(space, whole ? stiff : with_alpha(stiff), law, 0.3, 5, 2);
                const int n = motion.layout().size;
                Vector y = random_vector(n, 0.3);
                y.head(space.size()) = some_curve(space) + random_vector(space.size(), 0.01, 2);
                const Vector rate = random_vector(n, 0.3, 3), v = random_vector(n, 1, 4);
                const double cj = 1.7;
                Eigen::SparseMatrix<double> J = motion.pattern();
                motion.jacobian(0, y.data(), rate.data(), cj, J.valuePtr());
                const auto F = [&](double h) {
                    const Vector at = y + h * v, of = rate + cj * h * v;
                    Vector out(n);
                    EXPECT_TRUE(motion.residual(0, at.data(), of.data(), out.data()));
                    return out;
                };
                // Central differences with one extrapolation: their own error is of order h^4.
                const double h = 1e-3;
                const Vector slope = (8 * (F(h / 2) - F(-h / 2)) - (F(h) - F(-h))) / (6 * h), expected = J * v;
                EXPECT_LE((slope - expected).lpNorm<Eigen::Infinity>(), 1e-7 * expected.lpNorm<Eigen::Infinity>())
                    << static_cast<int>(topology) << " " << law.inextensible << law.inertia << law.swirls
                    << law.keeps_area << law.reservoir << law.free_period;
            }
        }
}

// The derivative along z e_z is that of the functional on curves that are stretched along the axis.
TEST(CurveForms, stretchSlopeIsTheDerivative) {
    for (const Topology topology : {Topology::tube, Topology::half_tube, Topology::cell}) {
        const bool tube = topology != Topology::cell;
        const CurveSpace space(topology, equal_breaks(6), 5, 4, tube ? 3 : 0, tube);
        const CurveForms forms(space, stiff);
        const Weights weights{.energy = 1, .area = 0.3, .volume = -0.2, .M = 0.4};
        const Vector x = some_curve(space) + random_vector(space.size(), 0.01, 2);
        const auto F = [&](double h) {
            Vector at = x;
            at.tail(space.size() - space.r().size()) *= 1 + h;
            return forms.value(weights, at);
        };
        const double h = 1e-3, slope = (8 * (F(h / 2) - F(-h / 2)) - (F(h) - F(-h))) / (6 * h);
        EXPECT_NEAR(forms.stretch_slope(weights, x), slope, 1e-9 * std::abs(F(0))) << static_cast<int>(topology);
    }
}

// Gradient and Hessian in the rise, too.
TEST(CurveForms, haveTheDerivativesOfAFreePeriod) {
    const CurveSpace space(Topology::half_tube, equal_breaks(6), 5, 4, 3, true);
    const CurveForms forms(space, stiff);
    const Weights weights{.energy = 1, .area = 0.3, .volume = -0.2, .gauge = 0.1, .M = 0.4};
    const auto check = check_derivatives(
        [&](const Vector& x) { return forms.value(weights, x); },
        [&](const Vector& x) { return forms.gradient(weights, x); },
        [&](const Vector& x, const Vector& w) -> Vector { return forms.hessian(weights, x) * w; }, some_curve(space));
    EXPECT_TRUE(check.pass());
}

// theory.md (3.18): membrane from a reservoir enters with the velocity of the membrane, so that a cell which swells
// while it moves differs from one at rest by this velocity alone.
TEST(CurveMotion, aSupplyKeepsAUniformTranslation) {
    MotionLaw swelling{.inertia = 1, .viscosity = 0.5, .friction = 0, .keeps_volume = false, .reservoir = true};
    swelling.tension = -3, swelling.pressure = 2;
    const double U = 1.5, h = 0.01;
    const CurveSpace space(Topology::cell, equal_breaks(8), 5, 4);
    CurveLaw law = swelling;
    law.holds_area = law.holds_volume = false;
    const CurveMotion motion(space, stiff, law, 0.3, 0, 0);
    const Vector curve = some_curve(space);
    Vector resting = Vector::Zero(motion.layout().size);
    resting.head(space.size()) = curve;
    Curve shifted = meridian(Ellipsoid{1, 1, 1.5});
    shifted.at = [at = shifted.at](double t) {
        std::array<double, 4> p = at(t);
        p[2] += 1;
        return p;
    };
    const Vector along = fit(space, shifted) - curve;  // e_z, as a displacement
    Vector moving = resting;
    moving.segment(motion.layout().u_r, space.size()) = U * along;
    const double start = motion.forms().observe(curve).area;
    for (int i = 0; i < 5; ++i) resting = motion.consistent(resting, h).y, moving = motion.consistent(moving, h).y;
    EXPECT_GT(motion.forms().observe(resting.head(space.size())).area, 1.01 * start);
    const Vector difference = (moving - resting).segment(motion.layout().u_r, space.size());
    // A supply at rest would take half of the area's growth from U.
    EXPECT_LT((difference - U * along).lpNorm<Eigen::Infinity>(), 1e-8);
}

// The least beta with sup_u (q, div u)/||u|| >= beta ||q||, where ||u||^2 = INT |u|^2 + |D(u)|^2 dS.
double inf_sup(const CurveSpace& space, const Vector& x) {
    const MotionLaw viscous{.viscosity = 0.5, .friction = 1, .keeps_volume = false};
    const CurveMotion motion(space, {}, curve_law(viscous, true, false), 1, 1, 1);
    const MotionLayout& at = motion.layout();
    Vector y = Vector::Zero(at.size);
    y.head(space.size()) = x;
    Eigen::SparseMatrix<double> J = motion.pattern();
    motion.jacobian(0, y.data(), Vector(Vector::Zero(at.size)).data(), 0, J.valuePtr());
    const Eigen::MatrixXd all = J;
    const int n = space.shape_size(), m = motion.pressures().size();
    const Eigen::MatrixXd norm = all.block(at.u_r, at.u_r, n, n), B = all.block(at.p, at.u_r, m, n);
    const SplineSpace& field = motion.pressures();
    Eigen::MatrixXd mass = Eigen::MatrixXd::Zero(m, m);
    for (int e = 0; e < field.elements(); ++e)
        for (int q = 0; q < SplineSpace::lanes; ++q) {
            const auto& b = field.basis(e, 0);
            const CurveSample p = space.evaluate(x, b.z[q]);
            const double dS = space.images() * b.weight[q] * 2 * pi * p.r * std::hypot(p.r1, p.z1);
            for (int i = 0; i < field.width(); ++i)
                for (int j = 0; j < field.width(); ++j)
                    mass(field.dofs(e)[i], field.dofs(e)[j]) +=
                        dS * field.signs(e)[i] * field.signs(e)[j] * b.by_spline[q][0][i] * b.by_spline[q][0][j];
        }
    const Eigen::MatrixXd schur = B * least_squares(norm, B.transpose());
    return std::sqrt(eigenpairs(schur, mass)->values[0]);
}

TEST(CurveMotion, pressuresAreInfSupStable) {
    // The constant must not fall as elements become smaller: with pressures one degree below the velocities it does
    // not, on a cell, on a tube, on equal and on graded elements.
    for (const Topology topology : {Topology::half_cell, Topology::cell, Topology::tube}) {
        std::vector<double> betas;
        for (const int n : {8, 16, 32, 64}) {
            const CurveSpace space(topology, equal_breaks(n), 5, 4, topology == Topology::tube ? 3 : 0);
            betas.push_back(inf_sup(space, some_curve(space)));
        }
        EXPECT_GT(betas.back(), 0.1);
        EXPECT_GT(betas.back(), 0.9 * betas.front());
    }
    const CurveSpace graded(Topology::half_cell, graded_breaks({0.5}, 0.05, 1e-4), 5, 4);
    EXPECT_GT(inf_sup(graded, some_curve(graded)), 0.1);
}

}  // namespace tubule::axisym::motion_test
