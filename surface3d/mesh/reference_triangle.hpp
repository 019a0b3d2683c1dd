// The reference triangle (0,0), (1,0), (0,1): Lagrange functions P_k and quadrature.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace tubule::surface3d {

inline constexpr int max_order = 4;
inline constexpr int max_cell_nodes = (max_order + 1) * (max_order + 2) / 2;

// Lattice position of each node of P_k in VTK's order (curved_mesh.hpp): i + j + l = k, the node being at the
// barycentric coordinates (i, j, l)/k.
std::vector<std::array<int, 3>> lattice(int order);

struct QuadraturePoint {
    double xi, eta, weight;
};

// Gauss points on [0, 1], ascending, and their weights: exact up to degree 2n - 1.
std::vector<std::array<double, 2>> gauss_points(int n);

// Integrates polynomials of this degree, and those below, exactly over the reference triangle (weights sum up to 1/2).
// Up to degree 12 the points keep the triangle's symmetry and lie inside: the numbering of a triangle's corners does
// not matter. Beyond: collapsed Gauss.
std::vector<QuadraturePoint> quadrature(int degree);

// The functions of P_k at the points of a rule: one column a point, one row a function.
struct Tabulation {
    Eigen::VectorXd weight;
    Eigen::Matrix2Xd point;  // xi, eta
    Eigen::MatrixXd value;
    std::array<Eigen::MatrixXd, 2> d;   // d/dxi, d/deta
    std::array<Eigen::MatrixXd, 3> dd;  // d2/dxi2, d2/dxi deta, d2/deta2

    Tabulation(int order, const std::vector<QuadraturePoint>& points);
    int points() const { return static_cast<int>(weight.size()); }
    int functions() const { return static_cast<int>(value.rows()); }
};

}  // namespace tubule::surface3d
