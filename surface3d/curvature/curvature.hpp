// Recovery of normal, shape operator and curvatures as continuous P_k fields from the nodes of a curved mesh: several
// ways side by side. docs/curvature.md compares them.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "common/case/surface_choices.hpp"
#include "surface3d/curvature/polynomial_graph.hpp"
#include "surface3d/fem/surface_space.hpp"

namespace tubule::surface3d {

class Projection;

// Nodal values.
struct CurvatureField {
    VectorField normal;    // unit, outward
    TensorField B;         // shape operator
    Eigen::VectorXd H, K;  // not in general those of the interpolated B
};

// All but `patch_nodal` solve with the mass matrix: SolveError if the mesh is degenerate. std::invalid_argument for
// `exact`, which nodes do not determine (exact_curvature.hpp).
CurvatureField recover(const SurfaceSpace& space, const CurvedMesh& mesh, Recovery recovery = Recovery::patch);

// The paper's smoothing, one implicit step of length eps >= 0 of heat flow on the surface: H and K are replaced by
// theirs, and so are the components of the gradients that H and K had before, from element to element. Normal and B
// stay. std::invalid_argument when eps is negative.
struct CurvatureGradients {
    VectorField H, K;
};
CurvatureGradients smooth(const SurfaceSpace& space, const CurvedMesh& mesh, double eps, CurvatureField& field);

// Recovery::patch and patch_nodal, with the neighbourhoods kept for as long as the triangles stay.
//
// Nodes lie on the surface to the order k+1 of the elements; derivatives across their boundaries do not. So second
// derivatives are taken from node positions alone: around each vertex, the graph of a polynomial of degree 2k over the
// tangent plane is fitted to the nodes of the triangles around it (and of their neighbours, where those are too few),
// by least squares. At a point of a triangle, curvatures are the means of those of the graphs of its corners, weighted
// by its barycentric coordinates: continuous, and of order 2k-1 or better, even where P_k is not.
class PatchRecovery {
public:
    explicit PatchRecovery(const CurvedMesh& mesh);

    // `mesh` has the triangles of the constructor's; its nodes may have moved. The projection keeps integrals: energies
    // are free of the error of interpolation, which has a sign. An existing projection of this mesh can be passed.
    CurvatureField nodal(const CurvedMesh& mesh) const;
    CurvatureField projected(const SurfaceSpace& space, const CurvedMesh& mesh) const;
    CurvatureField projected(const SurfaceSpace& space, const CurvedMesh& mesh, const Projection& project) const;

    // The graph about each vertex, and the surface that they make: at a point (xi, eta) of a cell, which is at x, the
    // mean of the graphs' points above or below x, weighted as above. Nearer to the surface than P_k by some orders.
    std::vector<PolynomialGraph> fit(const CurvedMesh& mesh) const;
    Eigen::Vector3d position(const std::vector<PolynomialGraph>& graphs, const CurvedMesh& mesh, int cell,
                             const Eigen::Vector2d& at, const Eigen::Vector3d& x) const;

private:
    struct Member {
        int node, shift;  // as the vertex sees it
    };
    struct Patch {
        int vertex;
        std::vector<std::array<int, 2>> corners;  // (cell, corner) of the triangles around
        std::vector<Member> members;
    };
    struct Share {
        int patch, shift;  // of the node, as the patch sees it
        double weight;
    };

    int shift(const CurvedMesh& mesh, int cell, int a) const {
        return mesh.period > 0 ? mesh.shifts[cell * mesh.nodes_per_cell() + a] : 0;
    }

    int degree_, most_members_ = 0;
    Tabulation corner_table_;
    std::vector<int> patch_of_;  // of each node that is a vertex
    std::vector<Patch> patches_;
    std::vector<std::vector<Share>> shares_;  // of each node
};

}  // namespace tubule::surface3d
