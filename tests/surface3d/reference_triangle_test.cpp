// Quadrature and Lagrange functions on the reference triangle.
#include "surface3d/mesh/reference_triangle.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace tubule::surface3d::reference_triangle_test {

double integral(int degree, int i, int j) {
    double sum = 0;
    for (const auto& [xi, eta, weight] : quadrature(degree)) sum += weight * std::pow(xi, i) * std::pow(eta, j);
    return sum;
}

// INT xi^i eta^j = i! j! / (i + j + 2)!
double exact(int i, int j) {
    return std::exp(std::lgamma(i + 1) + std::lgamma(j + 1) - std::lgamma(i + j + 3));
}

TEST(Quadrature, IntegratesMonomialsOfItsDegree) {
    for (int degree = 0; degree <= 18; ++degree)
        for (int i = 0; i <= degree; ++i)
            for (int j = 0; i + j <= degree; ++j)
                EXPECT_NEAR(integral(degree, i, j) / exact(i, j), 1, 1e-13) << degree << ": xi^" << i << " eta^" << j;
}

TEST(Quadrature, IsNoBetterThanItClaims) {
    for (int degree : {4, 6, 8, 10, 12}) {  // the tabulated ones: else the degrees above prove nothing
        double worst = 0;
        for (int i = 0; i <= degree + 1; ++i)
            worst = std::max(worst, std::abs(integral(degree, i, degree + 1 - i) / exact(i, degree + 1 - i) - 1));
        EXPECT_GT(worst, 1e-8) << degree;
    }
}

TEST(Quadrature, KeepsTheSymmetryOfTheTriangle) {
    for (int degree = 1; degree <= 12; ++degree)
        for (const auto& [xi, eta, weight] : quadrature(degree)) {
            EXPECT_GT(weight, 0);
            EXPECT_GT(std::min({xi, eta, 1 - xi - eta}), 0);
            bool found = false;  // corners turned by one
            for (const auto& p : quadrature(degree))
                found |= std::abs(p.xi - eta) + std::abs(p.eta - (1 - xi - eta)) < 1e-14 && p.weight == weight;
            EXPECT_TRUE(found) << degree << " " << xi << " " << eta;
        }
}

TEST(Lattice, FollowsVtksOrder) {
    // VTK file formats, VTK_LAGRANGE_TRIANGLE; P3 as in docs: vertices, (210)(120), (021)(012), (102)(201), centre.
    const std::vector<std::array<int, 3>> p3{{3, 0, 0}, {0, 3, 0}, {0, 0, 3}, {2, 1, 0}, {1, 2, 0},
                                             {0, 2, 1}, {0, 1, 2}, {1, 0, 2}, {2, 0, 1}, {1, 1, 1}};
    EXPECT_EQ(lattice(3), p3);
    const auto p4 = lattice(4);
    EXPECT_EQ(p4.size(), 15u);
    EXPECT_EQ(p4[12], (std::array<int, 3>{2, 1, 1}));
    EXPECT_EQ(p4[13], (std::array<int, 3>{1, 2, 1}));
    EXPECT_EQ(p4[14], (std::array<int, 3>{1, 1, 2}));
}

TEST(Tabulation, FunctionsBelongToTheirNodes) {
    for (int k = 1; k <= 4; ++k) {
        const auto nodes = lattice(k);
        std::vector<QuadraturePoint> at;
        for (const auto& n : nodes) at.push_back({n[1] / double(k), n[2] / double(k), 1});
        const Tabulation table(k, at);
        EXPECT_LT((table.value - Eigen::MatrixXd::Identity(nodes.size(), nodes.size())).cwiseAbs().maxCoeff(), 1e-14);
    }
}

TEST(Tabulation, DifferentiatesPolynomialsExactly) {
    // xi^i eta^j of degree k through its nodal values.
    const double x = 0.3, y = 0.45;
    const auto power = [](double base, int n) { return n < 0 ? 0.0 : std::pow(base, n); };
    for (int k = 1; k <= 4; ++k) {
        const Tabulation table(k, {{x, y, 1}});
        const auto nodes = lattice(k);
        for (int i = 0; i <= k; ++i)
            for (int j = 0; i + j <= k; ++j) {
                Eigen::VectorXd f(nodes.size());
                for (std::size_t a = 0; a < nodes.size(); ++a)
                    f[a] = power(nodes[a][1] / double(k), i) * power(nodes[a][2] / double(k), j);
                const auto of = [&](const Eigen::MatrixXd& m) { return f.dot(m.col(0)); };
                EXPECT_NEAR(of(table.value), power(x, i) * power(y, j), 1e-13);
                EXPECT_NEAR(of(table.d[0]), i * power(x, i - 1) * power(y, j), 1e-12);
                EXPECT_NEAR(of(table.d[1]), j * power(x, i) * power(y, j - 1), 1e-12);
                EXPECT_NEAR(of(table.dd[0]), i * (i - 1) * power(x, i - 2) * power(y, j), 1e-11);
                EXPECT_NEAR(of(table.dd[1]), i * j * power(x, i - 1) * power(y, j - 1), 1e-11);
                EXPECT_NEAR(of(table.dd[2]), j * (j - 1) * power(x, i) * power(y, j - 2), 1e-11);
            }
    }
}

}  // namespace tubule::surface3d::reference_triangle_test
