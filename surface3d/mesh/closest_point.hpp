// The point of a curved mesh that is nearest to a point of space.
#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>
#include <vector>

#include "surface3d/mesh/box_tree.hpp"
#include "surface3d/mesh/curved_mesh.hpp"
#include "surface3d/mesh/reference_triangle.hpp"

namespace tubule::surface3d {

// On a tube it may lie on another period than the mesh: x is `periods` periods above the point (cell, at) of the mesh.
struct MeshPoint {
    int cell = -1;
    Eigen::Vector2d at;         // xi, eta
    Eigen::Vector3d x, normal;  // the normal is that of the cell
    int periods = 0;
    double distance = std::numeric_limits<double>::infinity();
};

// Keeps what it needs of the mesh. Its functions may be called by several threads at once.
class ClosestPoint {
public:
    explicit ClosestPoint(const CurvedMesh& mesh);

    // The point nearest to x of those whose outward normal makes an angle below 90 degrees with `normal`: of two close
    // sheets, on the one that faces the right way. Boxes around the cells select the candidates; there Newton's method
    // finds it to rounding, if x is nearer than the radii of curvature. Cell -1 if there is none.
    MeshPoint operator()(const Eigen::Vector3d& x, const Eigen::Vector3d& normal) const;

private:
    // Bernstein coefficients, that of l0^i l1^j l2^m at number (j+m)(j+m+1)/2 + m; l0 = 1 - xi - eta, l1 = xi, l2 =
    // eta. Their convex hull holds the cell.
    using Coefficients = std::array<Eigen::Vector3d, max_cell_nodes>;
    struct Point {
        Eigen::Vector3d x, u, v, uu, uv, vv;  // position and derivatives
    };
    struct Query {
        Eigen::Vector3d x, normal;
        int periods;
    };

    Point evaluate(int cell, const Eigen::Vector2d& at) const;
    void look_at(int cell, const Query& query, MeshPoint& best) const;
    Eigen::Vector2d approach(int cell, Eigen::Vector2d at, const Eigen::Vector2d* line, const Eigen::Vector3d& x) const;
    void accept(int cell, const Eigen::Vector2d& at, const Query& query, MeshPoint& best) const;

    int order_;
    double period_;
    std::vector<Coefficients> cell_;
    std::vector<Eigen::Vector2d> start_;  // (xi, eta) of the nodes
    BoxTree<3> tree_;
};

}  // namespace tubule::surface3d
