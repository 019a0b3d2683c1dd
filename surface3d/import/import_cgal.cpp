#include "surface3d/import/import_cgal.hpp"

#include <CGAL/Eigen_matrix.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/remesh.h>
#include <CGAL/Polygon_mesh_processing/repair_degeneracies.h>
#include <CGAL/Polygon_mesh_processing/triangulate_hole.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/alpha_wrap_3.h>

#include <iterator>
#include <memory>
#include <stdexcept>
#include <vector>

#include "common/solve/sparse.hpp"

namespace tubule::surface3d::cgal {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Mesh = CGAL::Surface_mesh<Point>;
namespace pmp = CGAL::Polygon_mesh_processing;

Point point(const Eigen::Vector3d& x) {
    return {x[0], x[1], x[2]};
}
Eigen::Vector3d vector(const Point& p) {
    return {p.x(), p.y(), p.z()};
}

Mesh from(const TriangleMesh& in) {
    Mesh out;
    std::vector<Mesh::Vertex_index> vertex;
    for (const Eigen::Vector3d& x : in.points) vertex.push_back(out.add_vertex(point(x)));
    for (const auto& [a, b, c] : in.triangles)
        if (out.add_face(vertex[a], vertex[b], vertex[c]) == Mesh::null_face())
            throw std::invalid_argument("the mesh is no oriented manifold");
    return out;
}

TriangleMesh to(const Mesh& in) {
    TriangleMesh out;
    std::vector<int> number(in.number_of_vertices() + in.number_of_removed_vertices(), -1);
    for (const auto face : in.faces()) {
        std::array<int, 3>& triangle = out.triangles.emplace_back();
        int corner = 0;
        for (const auto v : in.vertices_around_face(in.halfedge(face))) {
            if (number[v] < 0) {
                number[v] = int(out.points.size());
                out.points.push_back(vector(in.point(v)));
            }
            triangle[corner++] = number[v];
        }
    }
    return out;
}

// Solves the systems of fairing by KLU: Eigen's SparseLU, CGAL's default, takes longer to compile.
struct FairingSolver {
    using Matrix = CGAL::Eigen_sparse_matrix<double>;
    using Vector = CGAL::Eigen_vector<double>;
    using NT = double;
    std::shared_ptr<SparseLu> lu = std::make_shared<SparseLu>();  // CGAL copies the solver

    bool factor(const Matrix& A, double& scale) try {
        scale = 1;
        lu->factor(A.eigen_object());
        return true;
    } catch (const SolveError&) {
        return false;
    }
    bool linear_solver(const Vector& B, Vector& X) try {
        X = lu->solve(B);
        return true;
    } catch (const SolveError&) {
        return false;
    }
};

double boundary_length(const Mesh& mesh, Mesh::Halfedge_index of) {
    double length = 0;
    for (const auto h : CGAL::halfedges_around_face(of, mesh))
        length += std::sqrt(CGAL::squared_distance(mesh.point(mesh.source(h)), mesh.point(mesh.target(h))));
    return length;
}

}  // namespace

bool available() {
    return true;
}

TriangleMesh isotropic(const TriangleMesh& in, double edge) {
    Mesh mesh = from(in);
    pmp::remove_degenerate_faces(mesh);
    pmp::isotropic_remeshing(mesh.faces(), edge, mesh,
                             CGAL::parameters::number_of_iterations(5).number_of_relaxation_steps(3));
    return to(mesh);
}

FilledHoles fill_holes(const TriangleMesh& in) {
    Mesh mesh = from(in);
    FilledHoles out;
    std::vector<Mesh::Halfedge_index> borders;
    pmp::extract_boundary_cycles(mesh, std::back_inserter(borders));
    for (const auto border : borders) {
        const double length = boundary_length(mesh, border);
        if (length > out.longest) out.longest = length, out.at = vector(mesh.point(mesh.target(border)));
        std::vector<Mesh::Face_index> faces;
        std::vector<Mesh::Vertex_index> vertices;
        pmp::triangulate_refine_and_fair_hole(mesh, border, std::back_inserter(faces), std::back_inserter(vertices),
                                              CGAL::parameters::sparse_linear_solver(FairingSolver()));
        faces.empty() ? ++out.left : ++out.holes;
    }
    out.mesh = to(mesh);
    return out;
}

TriangleMesh wrap(const TriangleMesh& in, double alpha, double offset) {
    std::vector<Point> points;
    for (const Eigen::Vector3d& x : in.points) points.push_back(point(x));
    std::vector<std::array<std::size_t, 3>> faces;
    for (const auto& [a, b, c] : in.triangles) faces.push_back({std::size_t(a), std::size_t(b), std::size_t(c)});
    Mesh out;
    CGAL::alpha_wrap_3(points, faces, alpha, offset, out);
    return to(out);
}

}  // namespace tubule::surface3d::cgal
