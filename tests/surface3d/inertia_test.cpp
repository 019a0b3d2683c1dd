// How many eigenvalues lie below a shift by the pivots of L D L^T, against dense eigenvalues, at random shifts.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <random>

#include "common/geometry/profile_point.hpp"
#include "common/solve/dense.hpp"
#include "surface3d/equilibrium/surface_flow.hpp"
#include "surface3d/equilibrium/surface_system.hpp"
#include "surface3d/mesh/base_meshes.hpp"
#include "surface3d/mesh/mapped_mesh.hpp"

namespace tubule::surface3d::inertia_test {

using Random = std::mt19937_64;

double uniform(Random& random, double from, double to) {
    return std::uniform_real_distribution(from, to)(random);
}

// A bumpy ellipsoid or tube.
CurvedMesh random_surface(Random& random, int divisions) {
    const bool tube = random() % 3 == 0;
    double stretch[3], wave[3], phase[3];
    for (int i = 0; i < 3; ++i)
        stretch[i] = uniform(random, 0.5, 1.6), wave[i] = uniform(random, 1, 4), phase[i] = uniform(random, 0, 6);
    const double bump = uniform(random, 0, 0.1);
    const double length = 3;
    const auto place = [&](const Eigen::Vector3d& p) -> Eigen::Vector3d {
        if (tube) {
            const double around = std::atan2(p.y(), p.x()), along = 2 * pi * p.z() / length;
            const double r = 1 + bump * (std::sin(along + phase[0]) + std::cos(2 * around + phase[1]));
            return {r * std::cos(around), r * std::sin(around), p.z()};
        }
        const Eigen::Vector3d q = p.normalized();
        double r = 1;
        for (int i = 0; i < 3; ++i) r += bump * std::sin(wave[i] * q[i] + phase[i]);
        return {r * stretch[0] * q.x(), r * stretch[1] * q.y(), r * stretch[2] * q.z()};
    };
    return tube ? mapped_mesh(tube_rings(1, length, 4 * divisions, 3 * divisions), 4, place)
                : mapped_mesh(icosphere(divisions), 4, place);
}

// The second variation of a random energy, with random multipliers and whatever is held.
struct Variation {
    CurvedMesh mesh;
    Bending bending;
    DiscreteEnergy energy;
    VectorField normal;
    ConstrainedForm A;
    double scale;

    Variation(Random& random, int divisions)
        : mesh(random_surface(random, divisions)),
          bending{.k = {uniform(random, 0.3, 1), random() % 2 * 0.03, random() % 2 * 0.05},
                  .H0 = uniform(random, -3, 1)},
          energy(mesh, bending),
          normal(node_normals(energy.space(), mesh)) {
        const double sigma = uniform(random, -8, 8), lambda = uniform(random, -8, 8);
        const EnergyDerivatives d = energy.derivatives(mesh, {normal, false}, bending, sigma, lambda);
        A.form = d.hessian, A.mass = energy.mass(mesh, {normal, false});
        A.constraints.resize(mesh.size(), static_cast<Eigen::Index>(random() % 3));
        for (Eigen::Index i = 0; i < A.constraints.cols(); ++i) A.constraints.col(i) = i == 0 ? d.area : d.volume;
        A.low_rank.resize(mesh.size(), static_cast<Eigen::Index>(random() % 2));
        A.weights = Eigen::VectorXd::Constant(A.low_rank.cols(), uniform(random, -1, 1));
        if (A.low_rank.cols() > 0) A.low_rank.col(0) = d.M;
        scale = std::abs(d.values.energy) / std::pow(d.values.area, 2);
    }
};

// Counts the shifts, those without factors, and those where the pivots say something else than `exact(shift)`.
struct Tally {
    int shifts = 0, failed = 0, wrong = 0;

    template <class Exact>
    void add(const ConstrainedForm& A, const Ordering& ordering, double shift, const Exact& exact) {
        ++shifts;
        try {
            const int found = count_below(A, ordering, shift), expected = exact(shift);
            if (found == expected) return;
            ++wrong;
            ADD_FAILURE() << found << " below " << shift << ", not " << expected;
        } catch (const SolveError&) {
            ++failed;
        }
    }
    void report(const char* of, double most) const {
        fmt::print("{}: {} shifts, {} without factors, {} wrong\n", of, shifts, failed, wrong);
        EXPECT_LE(failed, most * shifts);
    }
};

TEST(InertiaStudy, OfSecondVariations) {
    Random random(1);
    Tally low, all;
    for (int surface = 0; surface < 30; ++surface) {
        const Variation v(random, 2);
        const Ordering ordering = nested_dissection(v.energy.pattern());
        Eigen::MatrixXd Z = Eigen::MatrixXd::Identity(v.mesh.size(), v.mesh.size());
        if (v.A.constraints.cols() > 0) Z = orthogonal_complement(v.A.constraints, 1e-12);
        const Eigen::MatrixXd full =
            Eigen::MatrixXd(v.A.form) + v.A.low_rank * v.A.weights.asDiagonal() * v.A.low_rank.transpose();
        const Eigen::VectorXd values = eigenpairs(Z.transpose() * full * Z, Z.transpose() * v.A.mass * Z)->values;
        const auto exact = [&](double shift) { return static_cast<int>((values.array() < shift).count()); };
        for (int k = 0; k < 50; ++k) {
            low.add(v.A, ordering, uniform(random, values[0] - v.scale, values[40]), exact);
            all.add(v.A, ordering, values[0] + std::pow(uniform(random, 0, 1), 4) * (values.tail(1)[0] - values[0]),
                    exact);
        }
    }
    low.report("among the lowest 40 eigenvalues", 0.01);
    all.report("among all, which nothing asks for", 0.1);
}

// The matrix [A - shift D, -shift B^T; -shift B, 0], with what is held, for the shifts below all rates, and others.
TEST(InertiaStudy, OfFlows) {
    Random random(2);
    Tally below, among;
    for (int surface = 0; surface < 12; ++surface) {
        const Variation v(random, 1);
        const MotionLaw laws[]{{.friction = 0.8}, {.viscosity = 0.5, .friction = 0.3}, {.viscosity = 0.5}};
        const Eigen::MatrixXd none(3 * v.mesh.size(), 0);
        const FlowForm flow = flow_form(v.A, v.energy.space(), v.mesh, v.normal, laws[surface % 3], none, v.scale);
        const ConstrainedForm& F = flow.form;
        const Eigen::Index n = F.form.rows(), c = F.constraints.cols();
        const auto exact = [&](double shift) {
            Eigen::MatrixXd K = Eigen::MatrixXd::Zero(n + c, n + c);
            K.topLeftCorner(n, n) = Eigen::MatrixXd(F.form) - shift * Eigen::MatrixXd(F.mass) +
                                    F.low_rank * F.weights.asDiagonal() * F.low_rank.transpose();
            K.topRightCorner(n, c) = F.constraints, K.bottomLeftCorner(c, n) = F.constraints.transpose();
            const Eigen::VectorXd size = K.colwise().norm().cwiseSqrt().cwiseInverse();  // pressures are far larger
            const Eigen::MatrixXd even = size.asDiagonal() * K * size.asDiagonal();
            return static_cast<int>((eigenpairs(even, false).values.array() < 0).count() - c);
        };
        for (int k = 0; k < 8; ++k) {
            below.add(F, flow.ordering, -v.scale * std::pow(10, uniform(random, 1, 5)), exact);
            among.add(F, flow.ordering, v.scale * std::pow(10, uniform(random, -1, 3)), exact);
        }
    }
    below.report("flows, below zero", 0.01);
    among.report("flows, above zero", 0.01);
}

}  // namespace tubule::surface3d::inertia_test
