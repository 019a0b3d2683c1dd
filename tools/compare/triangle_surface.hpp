// A surface of curved triangles P_k as a frame of tier surface3d holds it.
#pragma once

#include <array>

#include "common/result/result.hpp"
#include "surface3d/mesh/box_tree.hpp"
#include "tools/compare/surface.hpp"

namespace tubule::compare {

// Bernstein coefficients of a triangle, that of l0^(n-a-b) l1^a l2^b at number a (2n + 3 - a)/2 + b; (l0, l1, l2) are
// the barycentric coordinates (1 - xi - eta, xi, eta).
inline constexpr int max_coefficients = 15;
using Coefficients = std::array<Eigen::Vector3d, max_coefficients>;

// The nearest point is exact up to rounding: boxes of Bernstein coefficients, which contain the curved triangles,
// select the few candidates; Newton's method finds the point on each and on its edges. A Place is a triangle and (xi,
// eta).
class TriangleSurface final : public Surface {
public:
    // `points`: x, y, z of each node. Throws std::invalid_argument for an order other than 1 ... 4 and lengths that do
    // not fit.
    TriangleSurface(const SurfaceCells& cells, const std::vector<double>& points);

    double period() const override { return period_; }
    double grain() const override { return grain_; }
    Foot foot(const Eigen::Vector3d& x) const override;
    Eigen::Vector3d at(const Place& place) const override;
    void confine(Place& place) const override;
    std::vector<Sample> samples(double grain) const override;

private:
    // A part of a triangle that is nearly flat, and by how much at most it is not.
    struct Part {
        int cell;
        std::array<Eigen::Vector2d, 3> corner;  // (xi, eta)
        std::array<Eigen::Vector3d, 3> x;
        double bulge;
    };
    struct Nearest;

    void add_parts(int cell, const std::array<Eigen::Vector2d, 3>& corner, int depth,
                   std::vector<surface3d::BoxTree<3>::Box>& boxes);
    void look_at(const Part& part, const Eigen::Vector3d& x, Nearest& nearest) const;
    void look_inside(int cell, Eigen::Vector2d at, const Eigen::Vector3d& x, Nearest& nearest) const;
    void look_along(int cell, int edge, const Eigen::Vector2d& from, const Eigen::Vector3d& x, Nearest& nearest) const;

    int order_;
    double period_, grain_ = 0;
    std::vector<Coefficients> cell_;
    Eigen::MatrixXd to_bernstein_;             // from nodes in VTK's order
    std::vector<Eigen::Vector2d> node_place_;  // of those nodes
    std::vector<Part> part_;
    surface3d::BoxTree<3> tree_;
};

}  // namespace tubule::compare
