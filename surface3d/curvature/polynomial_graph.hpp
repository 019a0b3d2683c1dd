// The surface near a point as a polynomial graph over a plane, fitted to points of it by least squares.
#pragma once

#include <Eigen/Core>

#include "common/geometry/surface_point.hpp"
#include "surface3d/mesh/reference_triangle.hpp"

namespace tubule::surface3d {

inline constexpr int max_graph_degree = 2 * max_order;

constexpr int graph_coefficients(int degree) {
    return (degree + 1) * (degree + 2) / 2;
}

// height(x, y) over the plane through `origin` spanned by e1, e2, all lengths in units of `scale`; e1 x e2 = normal.
struct PolynomialGraph {
    int degree = 0;
    Eigen::Vector3d origin, e1, e2, normal;
    double scale = 1;
    Eigen::Matrix<double, graph_coefficients(max_graph_degree), 1> coefficient;

    // The point of the graph below or above `position`, with its curvatures.
    SurfacePoint<double> at(const Eigen::Vector3d& position) const;
};

// Fits graphs of one degree, in memory that it keeps. One thread at a time.
class GraphFit {
public:
    // No fit will have more points than this.
    GraphFit(int degree, int max_points);

    // To the points, one column each, over the plane through `origin` with this unit normal. If they do not determine
    // all coefficients, those that are left over are zero.
    PolynomialGraph operator()(const Eigen::Vector3d& origin, const Eigen::Vector3d& normal,
                               const Eigen::Ref<const Eigen::Matrix3Xd>& points);

private:
    int degree_;
    Eigen::MatrixXd storage_;
    Eigen::VectorXd heights_, workspace_;
};

}  // namespace tubule::surface3d
