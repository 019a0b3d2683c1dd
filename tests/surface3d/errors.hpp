// Errors of recovered curvatures against the exact surface that a mesh interpolates.
#pragma once

#include <cmath>

#include "common/shapes/sphere.hpp"
#include "surface3d/curvature/curvature.hpp"
#include "surface3d/mesh/mapped_mesh.hpp"

namespace tubule::surface3d {

// The perturbed sphere 1 + 0.5 Re Y_5^3 and its integrals: theory.md (7.10).
inline Sphere perturbed_sphere() {
    return {.radius = 1, .modes = {{0.5, 5, 3}}};
}
inline constexpr double perturbed_area = 14.401304433294, perturbed_volume = 4.313790204786;
inline constexpr double perturbed_H2 = 135.8066231985, perturbed_K2 = 160.529992807;

template <class Shape>
auto map_of(const Shape& shape) {
    return [shape](const auto& p) { return position(shape, p); };
}

// INT f(point) dS over the exact surface map(base).
template <class Map, class F>
double integrate_exactly(const TriangleMesh& base, const Map& map, F&& f) {
    double sum = 0;
    for (int t = 0; t < static_cast<int>(base.triangles.size()); ++t) {
        const Eigen::Vector3d a = base.corner(t, 0), e1 = base.corner(t, 1) - a, e2 = base.corner(t, 2) - a;
        for (const auto& [xi, eta, weight] : quadrature(12)) {
            const auto p = point_of_map<double>(map, a + xi * e1 + eta * e2, e1, e2);
            sum += weight * p.area * f(p);
        }
    }
    return sum;
}

// L2 norms of the errors over those of the exact fields.
struct FieldErrors {
    double normal = 0, H = 0, K = 0, grad_H = 0, grad_K = 0;
};

// The exact surface at a quadrature point of its mesh.
struct ExactSample {
    Eigen::Vector3d normal, grad_H, grad_K;
    double H, K;
};

// At the quadrature points of all cells, those of a cell next to each other.
template <class Map>
std::vector<ExactSample> sample_exactly(const TriangleMesh& base, const SurfaceSpace& space, const Map& map) {
    using Scalar = Jet<double, 2, 1>;
    const auto value = [](const Vector3<Scalar>& v) { return Eigen::Vector3d(v[0].v, v[1].v, v[2].v); };
    const Tabulation& table = space.tabulation();
    std::vector<ExactSample> samples(static_cast<std::size_t>(space.cells()) * table.points());
    space.for_each_cell([&](int cell) {
        const Eigen::Vector3d a = base.corner(cell, 0), e1 = base.corner(cell, 1) - a, e2 = base.corner(cell, 2) - a;
        for (int q = 0; q < table.points(); ++q) {
            const Eigen::Vector2d at = table.point.col(q);
            const auto p = point_of_map<Scalar>(map, a + at[0] * e1 + at[1] * e2, e1, e2);
            const auto gradient = [&](const Scalar& f) {
                return Eigen::Vector3d(f.d[0] * value(p.dual[0]) + f.d[1] * value(p.dual[1]));
            };
            samples[static_cast<std::size_t>(cell) * table.points() + q] = {value(p.normal), gradient(p.H),
                                                                            gradient(p.K), p.H.v, p.K.v};
        }
    });
    return samples;
}

// A point of the mesh is compared with that of the same parameters on the surface; gradients are those of the fields
// unless given.
inline FieldErrors field_errors(const std::vector<ExactSample>& samples, const SurfaceSpace& space,
                                const CurvedMesh& mesh, const CurvatureField& field,
                                const CurvatureGradients* gradients_of_field = nullptr) {
    const Tabulation& table = space.tabulation();
    FieldErrors error, size;
    for (int cell = 0; cell < space.cells(); ++cell) {
        const CellColumns<3> X = cell_nodes(mesh, cell), normal = space.gather(field.normal, cell);
        const auto H = space.gather(field.H, cell), K = space.gather(field.K, cell);
        for (int q = 0; q < table.points(); ++q) {
            const SurfacePoint<double> p = tangent_point(X, table, q);
            const ExactSample& exact = samples[static_cast<std::size_t>(cell) * table.points() + q];
            const CellColumns<3> grad = gradients(p, table, q);
            const auto phi = table.value.col(q);
            const Eigen::Vector3d grad_H =
                gradients_of_field ? Eigen::Vector3d(space.gather(gradients_of_field->H, cell) * phi) : grad * H;
            const Eigen::Vector3d grad_K =
                gradients_of_field ? Eigen::Vector3d(space.gather(gradients_of_field->K, cell) * phi) : grad * K;
            const double dS = table.weight[q] * p.area;
            const auto add = [&](double FieldErrors::*which, double difference2, double norm2) {
                error.*which += dS * difference2;
                size.*which += dS * norm2;
            };
            add(&FieldErrors::normal, (normal * phi - exact.normal).squaredNorm(), 1);
            add(&FieldErrors::H, std::pow(H.dot(phi) - exact.H, 2), exact.H * exact.H);
            add(&FieldErrors::K, std::pow(K.dot(phi) - exact.K, 2), exact.K * exact.K);
            add(&FieldErrors::grad_H, (grad_H - exact.grad_H).squaredNorm(), exact.grad_H.squaredNorm());
            add(&FieldErrors::grad_K, (grad_K - exact.grad_K).squaredNorm(), exact.grad_K.squaredNorm());
        }
    }
    for (auto which :
         {&FieldErrors::normal, &FieldErrors::H, &FieldErrors::K, &FieldErrors::grad_H, &FieldErrors::grad_K})
        error.*which = std::sqrt(error.*which / size.*which);
    return error;
}

template <class Map>
FieldErrors field_errors(const TriangleMesh& base, const CurvedMesh& mesh, const CurvatureField& field,
                         const Map& map) {
    const SurfaceSpace space(mesh);
    return field_errors(sample_exactly(base, space, map), space, mesh, field);
}

}  // namespace tubule::surface3d
