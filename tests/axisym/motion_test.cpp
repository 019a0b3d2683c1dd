// The laws of motion of a profile curve: derivatives, consistent starts, inf-sup stability.
#include "axisym/curve_motion.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <Eigen/Eigenvalues>
#include <random>

#include "axisym/curve_start.hpp"
#include "common/geometry/profile_point.hpp"

namespace tubule::axisym {
namespace {

using Vector = Eigen::VectorXd;

Vector random_vector(int n, double size, unsigned seed = 1) {
    std::mt19937 engine(seed);
    std::normal_distribution<double> normal;
    Vector x(n);
    for (double& c : x) c = size * normal(engine);
    return x;
}

const Bending stiff{{0.2, 0.03, 0.1}, -0.7};
const MotionLaw gradient_flow{.flows = false, .keeps_volume = false};
const MotionLaw gradient_flow_volume{.flows = false};
const MotionLaw overdamped{.friction = 1};
const MotionLaw stokes{.viscosity = 0.5};
const MotionLaw fluid{.inertia = 1, .viscosity = 0.5, .friction = 0.1};
const MotionLaw swirling{.inertia = 1, .viscosity = 0.5, .friction = 0.1, .swirls = true};
const MotionLaw lagrangian{.inertia = 1, .viscosity = 0.5, .friction = 0.1, .lagrangian = true, .swirls = true};
const std::vector<MotionLaw> laws{gradient_flow, gradient_flow_volume, overdamped, stokes, fluid, swirling, lagrangian};

Vector some_curve(const CurveSpace& space) {
    const Meridian whole = space.closed()       ? meridian(Ellipsoid{1, 1, 1.5})
                           : space.length() > 0 ? meridian(Tube{1, space.length(), {{0.2, 1, 0, 0}}})
                                                : meridian(Torus{2, 0.7});
    return fit(space, space.images() == 2 ? half(whole) : whole);
}

TEST(CurveMotion, jacobianIsTheDerivative) {
    for (const Topology topology : {Topology::cell, Topology::half_cell, Topology::tube, Topology::half_tube})
        for (const MotionLaw& law : laws) {
            const bool tube = topology == Topology::tube || topology == Topology::half_tube;
            const CurveSpace space(topology, equal_breaks(6), 5, 4, tube ? 3 : 0);
            const CurveMotion motion(space, stiff, law, 0.3, 5, 2);
            const int n = motion.layout().size;
            Vector y = random_vector(n, 0.3);
            y.head(space.size()) = some_curve(space) + random_vector(space.size(), 0.01, 2);
            const Vector rate = random_vector(n, 0.3, 3), v = random_vector(n, 1, 4);
            const double cj = 1.7;
            Eigen::SparseMatrix<double> J = motion.pattern();
            motion.jacobian(y.data(), rate.data(), cj, J.valuePtr());
            const auto F = [&](double h) {
                const Vector at = y + h * v, of = rate + cj * h * v;
                Vector out(n);
                EXPECT_TRUE(motion.residual(at.data(), of.data(), out.data()));
                return out;
            };
            // Central differences with one extrapolation: their own error is of order h^4.
            const double h = 1e-3;
            const Vector slope = (8 * (F(h / 2) - F(-h / 2)) - (F(h) - F(-h))) / (6 * h), expected = J * v;
            EXPECT_LE((slope - expected).lpNorm<Eigen::Infinity>(), 1e-7 * expected.lpNorm<Eigen::Infinity>())
                << static_cast<int>(topology) << " " << law.flows << law.inertia << law.swirls;
        }
}

}  // namespace
}  // namespace tubule::axisym
