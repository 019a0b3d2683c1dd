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

// Keeps what it needs of the mesh. Its functions may be called by several threads at once. The nearest point is exact
// to rounding: boxes of Bernstein coefficients, which contain the curved triangles, select the few candidates; Newton's
// method finds the point on each and on its edges.
class ClosestPoint {
public:
    explicit ClosestPoint(const CurvedMesh& mesh);

    // Among all points whose outward normal makes an angle below 90 degrees with `normal`, the one nearest to x: of two
    // sheets close to each other the one that faces the right way. Cell -1 if there is none.
    MeshPoint operator()(const Eigen::Vector3d& x, const Eigen::Vector3d& normal) const { return nearest(x, &normal); }
    // Among all points, whichever way they face.
    MeshPoint operator()(const Eigen::Vector3d& x) const { return nearest(x, nullptr); }

    // Position and derivatives in xi, eta.
    struct CellPoint {
        Eigen::Vector3d x, u, v, uu, uv, vv;
    };
    CellPoint evaluate(int cell, const Eigen::Vector2d& at) const;

private:
    // Bernstein coefficients, that of l0^i l1^j l2^m at number (j+m)(j+m+1)/2 + m; l0 = 1 - xi - eta, l1 = xi, l2 =
    // eta. Their convex hull holds the cell.
    using Coefficients = std::array<Eigen::Vector3d, max_cell_nodes>;
    // A part of a cell that is nearly flat, and by how much at most it is not.
    struct Part {
        int cell;
        std::array<Eigen::Vector2d, 3> corner;  // (xi, eta)
        std::array<Eigen::Vector3d, 3> x;
        double bulge;
    };
    struct Search;

    MeshPoint nearest(const Eigen::Vector3d& x, const Eigen::Vector3d* normal) const;
    void add_parts(int cell, const std::array<Eigen::Vector2d, 3>& corner, int depth,
                   std::vector<BoxTree<3>::Box>& boxes);
    void search_part(const Part& part, Search& search) const;
    void search_cell(int cell, Eigen::Vector2d at, Search& search) const;
    void search_edge(int cell, int edge, const Eigen::Vector2d& from, Search& search) const;

    int order_;
    double period_;
    std::vector<Coefficients> cell_;
    Eigen::MatrixXd to_bernstein_;             // from nodes in VTK's order
    std::vector<Eigen::Vector2d> node_place_;  // (xi, eta) of those nodes
    std::vector<Part> part_;
    BoxTree<3> tree_;
};

}  // namespace tubule::surface3d
