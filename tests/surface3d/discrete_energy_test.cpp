// The discrete energy of surfaces in three dimensions: exact derivatives, and convergence to known energies.
#include "surface3d/equilibrium/discrete_energy.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "common/geometry/profile_point.hpp"
#include "surface3d/equilibrium/surface_system.hpp"
#include "surface3d/mesh/base_meshes.hpp"
#include "surface3d/mesh/mapped_mesh.hpp"
#include "tests/support/random_vector.hpp"

namespace tubule::surface3d::discrete_energy_test {

CurvedMesh sphere(int n, int order) {
    return mapped_mesh(icosphere(n), order, [](const Eigen::Vector3d& p) { return Eigen::Vector3d(p.normalized()); });
}

// A shape without symmetry.
CurvedMesh potato(int order) {
    return mapped_mesh(icosphere(2), order, [](const Eigen::Vector3d& p) {
        const Eigen::Vector3d q = p.normalized();
        return Eigen::Vector3d(1.3 * q.x() + 0.1 * q.y() * q.z(), q.y() + 0.05 * q.x() * q.x(), 0.8 * q.z());
    });
}

CurvedMesh wavy_tube(int order) {
    const double length = 4;
    return mapped_mesh(tube_rings(1, length, 6, 6), order, [&](const Eigen::Vector3d& p) {
        const double theta = std::atan2(p.y(), p.x()), q = 2 * pi / length * p.z();
        const double r = 1 + 0.1 * std::cos(q) * std::cos(theta) + 0.05 * std::sin(2 * theta + q);
        return Eigen::Vector3d(r * std::cos(theta), r * std::sin(theta), p.z());
    });
}

Bending all_terms() {
    Bending out{.k = {0.5, 0.02, 0.06}, .H0 = -0.7};
    out.terms.push_back({.modulus = 0.03, .H = 1, .K = 1});
    out.mu = 0.2;
    return out;
}

// Largest relative difference of first and second derivatives along a random displacement to central differences.
struct Errors {
    double first, second;
};
Errors taylor(const CurvedMesh& mesh, bool stretch, double step, const Eigen::VectorXd& H0 = {}) {
    const Bending bending = all_terms();
    const DiscreteEnergy E(mesh, bending);
    const double sigma = 0.3, lambda = -0.2;
    Directions d{node_normals(E.space(), mesh), stretch};
    for (int i = 0; i < mesh.size(); ++i) d.normal.col(i) += 0.1 * Eigen::Vector3d(std::sin(i), std::cos(2 * i), 0.3);
    Eigen::VectorXd w = 0.002 * test::random_vector(mesh.size() + stretch, 7);
    const auto moved = [&](double t) {
        CurvedMesh out = mesh;
        for (int i = 0; i < mesh.size(); ++i) {
            out.nodes[i] += t * w[i] * d.normal.col(i);
            if (stretch) out.nodes[i].z() += t * w[mesh.size()] * mesh.nodes[i].z();
        }
        if (stretch) out.period *= 1 + t * w[mesh.size()];
        return out;
    };
    const auto sum = [&](const EnergyValues& v) { return v.energy + sigma * v.area + lambda * v.volume; };
    const auto slope = [&](const EnergyDerivatives& g) -> Eigen::VectorXd {
        return g.energy + sigma * g.area + lambda * g.volume;
    };
    const EnergyDerivatives at = E.derivatives(mesh, d, bending, sigma, lambda, H0);
    const EnergyDerivatives alone = E.derivatives(mesh, d, bending, sigma, lambda, H0, false);
    EXPECT_LT((slope(alone) - slope(at)).norm(), 1e-12 * slope(at).norm());
    EXPECT_LT((alone.M - at.M).norm(), 1e-12 * at.M.norm());
    const EnergyValues values = E.values(mesh, bending, H0);
    for (const EnergyValues& v : {alone.values, values}) {
        EXPECT_NEAR(sum(v), sum(at.values), 1e-12 * std::abs(sum(v)));
        EXPECT_NEAR(v.kinks, at.values.kinks, 1e-12 * v.kinks);
    }
    const EnergyValues after = E.values(moved(step), bending, H0), before = E.values(moved(-step), bending, H0);
    const double first = slope(at).dot(w), differences = (sum(after) - sum(before)) / (2 * step);
    EXPECT_NEAR(at.M.dot(w), (after.M - before.M) / (2 * step), 2e-3 * std::abs(at.M.dot(w)) + 1e-9);
    // The stretch moves each point by its z at the beginning, so that directions stay those of `mesh`.
    Eigen::VectorXd second = Eigen::VectorXd::Zero(w.size());
    second.head(mesh.size()) = at.hessian * w.head(mesh.size());
    if (stretch) {
        second.head(mesh.size()) += at.with_stretch * w[mesh.size()];
        second[mesh.size()] = at.with_stretch.dot(w.head(mesh.size())) + at.stretch_twice * w[mesh.size()];
    }
    double curvature = w.dot(second);
    const double twice = (sum(after) - 2 * sum(at.values) + sum(before)) / (step * step);
    Errors out{std::abs(first - differences) / std::abs(first), std::abs(curvature - twice) / std::abs(curvature)};
    if (stretch) return out;
    const Eigen::VectorXd change = (slope(E.derivatives(moved(step), d, bending, sigma, lambda, H0)) -
                                    slope(E.derivatives(moved(-step), d, bending, sigma, lambda, H0))) /
                                   (2 * step);
    out.second = (change - second).norm() / second.norm();
    return out;
}

// Central differences have an error of second order.
void expect_taylor(const CurvedMesh& mesh, bool stretch, const Eigen::VectorXd& H0 = {}) {
    const Errors coarse = taylor(mesh, stretch, 1e-2, H0), fine = taylor(mesh, stretch, 1e-3, H0);
    EXPECT_LT(fine.first, 1e-3);
    EXPECT_LT(fine.second, 1e-4);
    EXPECT_LT(fine.first, coarse.first / 50);
    EXPECT_LT(fine.second, coarse.second / 50);
}

TEST(DiscreteEnergy, derivativesAreThoseOfTheEnergy) {
    for (int order : {2, 3, 4}) {
        SCOPED_TRACE(order);
        expect_taylor(potato(order), false);
    }
}

TEST(DiscreteEnergy, derivativesInTheStretchOfATube) {
    expect_taylor(wavy_tube(3), true);
}

TEST(DiscreteEnergy, derivativesWhereH0Varies) {
    const CurvedMesh mesh = potato(3);
    Eigen::VectorXd H0(mesh.size());
    for (int i = 0; i < mesh.size(); ++i) H0[i] = -0.5 + 0.3 * mesh.nodes[i].z();
    expect_taylor(mesh, false, H0);
}

// A surface of area 4 pi R^2 with H = -2/R and K = 1/R^2; the interpolated sphere is off by the mesh alone.
struct SphereErrors {
    double energy, M, K;
};
SphereErrors errors_of_sphere(int n, int order) {
    const CurvedMesh mesh = sphere(n, order);
    const Bending bending{.k = {0.5, 0.02, 0.06}, .H0 = -0.7};
    const EnergyValues v = DiscreteEnergy(mesh, bending).values(mesh, bending);
    const double x = -2 + 0.7, exact = 4 * pi * (0.5 * x * x + 0.02 * x * x * x * x + 0.06);
    Bending gauss;
    gauss.terms.push_back({.modulus = 1, .H = 0, .K = 1});
    const DiscreteEnergy K(mesh, gauss);
    return {std::abs(v.energy / exact - 1), std::abs(v.M / (-8 * pi) - 1),
            std::abs(K.values(mesh, gauss).energy / (4 * pi) - 1)};
}

// h^(2k-2) at least; interpolated spheres do better for even k. Gauss and Bonnet hold to the square of the angles.
TEST(DiscreteEnergy, convergesOnSpheres) {
    for (const auto& [order, rate, most] : {std::tuple{3, 3.7, 5e-3}, {4, 5.7, 6e-6}}) {
        SCOPED_TRACE(order);
        const SphereErrors coarse = errors_of_sphere(2, order), fine = errors_of_sphere(4, order);
        EXPECT_GT(std::log2(coarse.energy / fine.energy), rate);
        EXPECT_LT(fine.energy, most);
        EXPECT_GT(std::log2(coarse.M / fine.M), rate);
        EXPECT_LT(fine.K, most);
    }
}

}  // namespace tubule::surface3d::discrete_energy_test
