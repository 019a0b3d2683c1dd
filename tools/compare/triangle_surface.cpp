#include "tools/compare/triangle_surface.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <stdexcept>
#include <string>

#include "surface3d/mesh/reference_triangle.hpp"

namespace tubule::compare {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using surface3d::CurvedMesh;

const CurvedMesh& checked(const CurvedMesh& mesh) {
    if (mesh.order < 1 || mesh.order > surface3d::max_order)
        throw std::invalid_argument("triangles must be of order 1 to 4, not " + std::to_string(mesh.order));
    if (mesh.cells.empty() || mesh.cells.size() % mesh.nodes_per_cell() != 0 ||
        (mesh.period > 0 && mesh.shifts.size() != mesh.cells.size()))
        throw std::invalid_argument("the points of the surface do not fit its triangles");
    for (const int node : mesh.cells)
        if (node < 0 || node >= mesh.size()) throw std::invalid_argument("a triangle has a node that is not there");
    return mesh;
}

}  // namespace

TriangleSurface::TriangleSurface(const CurvedMesh& mesh)
    : order_(checked(mesh).order), triangles_(mesh.triangles()), period_(mesh.period), nearest_(mesh) {
    double area = 0;
    for (int cell = 0; cell < triangles_; ++cell) {
        const Vector3d corner = mesh.position(cell, 0);
        area += (mesh.position(cell, 1) - corner).cross(mesh.position(cell, 2) - corner).norm() / 2;
    }
    grain_ = std::sqrt(area / triangles_);
}

Foot TriangleSurface::foot(const Vector3d& x) const {
    const surface3d::MeshPoint found = nearest_(x);
    return {found.x, found.normal, found.distance};
}

Vector3d TriangleSurface::at(const Place& place) const {
    return nearest_.evaluate(place.piece, place.at).x;
}

void TriangleSurface::confine(Place& place) const {
    Vector2d& at = place.at;
    at = at.cwiseMax(0).cwiseMin(1);
    const double beyond = at.sum() - 1;
    if (beyond > 0) at -= Vector2d::Constant(beyond / 2);
}

std::vector<Sample> TriangleSurface::samples(double) const {
    // The distance from a smooth surface is nearly a polynomial of degree k + 1 on each triangle.
    const auto rule = surface3d::quadrature(2 * order_ + 2);
    const auto nodes = surface3d::lattice(order_);
    const Vector2d reach = Vector2d::Constant(0.5 / order_);
    std::vector<Sample> out;
    for (int cell = 0; cell < triangles_; ++cell) {
        for (const auto& [xi, eta, weight] : rule) {
            const auto p = nearest_.evaluate(cell, {xi, eta});
            out.push_back({{cell, {xi, eta}}, reach, p.x, weight * p.u.cross(p.v).norm()});
        }
        for (const auto& [i, j, l] : nodes) {
            const Vector2d at = Vector2d(j, l) / order_;
            out.push_back({{cell, at}, reach, nearest_.evaluate(cell, at).x, 0});
        }
    }
    return out;
}

}  // namespace tubule::compare
