// What tests of moving surfaces share: a motion in steps as given, and waves measured on it.
#pragma once

#include <algorithm>
#include <cmath>

#include "common/shapes/sphere.hpp"
#include "common/shapes/tube.hpp"
#include "surface3d/mesh/base_meshes.hpp"
#include "surface3d/mesh/mapped_mesh.hpp"
#include "surface3d/motion/motion_forms.hpp"
#include "surface3d/motion/motion_measures.hpp"
#include "surface3d/motion/schemes/time_scheme.hpp"

namespace tubule::surface3d {

template <class Shape>
CurvedMesh mesh_of(const Shape& shape, const TriangleMesh& base, int order) {
    return mapped_mesh(base, order, [&](const auto& p) { return position(shape, p); });
}

inline CurvedMesh tube_mesh(const Tube& tube, int n_z, int n_theta, int order) {
    return mesh_of(tube, tube_rings(tube.radius, tube.length, n_z, n_theta), order);
}

// From rest, in steps of one size. Area and volume are held at their initial values, as in a run.
struct Motion {
    Motion(const CurvedMesh& mesh, const Model& model, const Bending& bending, MotionControl control = {},
           Scheme name = scheme_named("bdf2"))
        : bending(bending),
          scheme(make_scheme(name, mesh, motion_law(model), bending, held(mesh, control))),
          surface(scheme->surface()),
          state(surface.start(mesh)) {}

    static MotionControl held(const CurvedMesh& mesh, MotionControl control) {
        const Extent e = extent(SurfaceSpace(mesh), mesh);
        control.area = e.area, control.volume = e.volume;
        return control;
    }
    void steps(double tau, int n) {
        for (int i = 0; i < n; ++i) state = scheme->step(state, tau).state;
    }
    void until(double end, int n) { steps(end / n, n); }
    CurvedMesh mesh() const { return surface.mesh(state); }
    MotionMeasures measures() { return measure(surface, state); }

    Bending bending;
    std::unique_ptr<TimeScheme> scheme;
    MovingSurface& surface;
    MotionState state;
};

// What a step from rest has on this mesh.
inline StepSystem system_at_rest(const CurvedMesh& mesh, const Bending& bending, const MotionLaw& law) {
    const SurfaceSpace space(mesh);
    const MotionUnknowns unknowns(mesh, law, bending);
    StepBase base;
    base.mesh = &mesh, base.te = 1;
    base.fields = motion_fields(space, mesh, Projection(space, mesh), bending.kg);
    base.M = integral(space, mesh, base.fields.H);
    base.displacement = base.mesh_velocity = VectorField::Zero(3, mesh.size());
    base.velocity = base.past = Eigen::VectorXd::Zero(3 * mesh.size());
    StepSystem system;
    assemble(space, unknowns, law, bending, base, system);
    return system;
}

// The fields that a motion has on a mesh, and what is observed with them.
inline MotionFields fields_of(const CurvedMesh& mesh, double kg = 0) {
    const SurfaceSpace space(mesh);
    return motion_fields(space, mesh, Projection(space, mesh), kg);
}
inline Observables observed(const CurvedMesh& mesh, const Bending& bending) {
    const MotionFields f = fields_of(mesh, bending.kg);
    return observe(SurfaceSpace(mesh), mesh, {f.normal, {}, f.H, f.K}, bending);
}

// d/ds of quantity(moved(s)) at s = 0, moved(s) being a mesh; fourth order in the step.
template <class Moved, class Quantity>
auto rate_along(const Moved& moved, const Quantity& quantity) {
    constexpr double step = 1e-3;
    const auto at = [&](double s) { return quantity(moved(s)); };
    using Value = decltype(at(step));
    return Value((8 * (at(step) - at(-step)) - (at(2 * step) - at(-2 * step))) / (12 * step));
}
inline CurvedMesh moved_mesh(CurvedMesh mesh, const VectorField& v, double s) {
    for (int i = 0; i < mesh.size(); ++i) mesh.nodes[i] += s * v.col(i);
    return mesh;
}
template <class Quantity>  // of mesh + s v
auto rate_of(const CurvedMesh& mesh, const VectorField& v, const Quantity& quantity) {
    return rate_along([&](double s) { return moved_mesh(mesh, v, s); }, quantity);
}
inline CurvedMesh stretched_mesh(CurvedMesh mesh, double by) {
    for (Eigen::Vector3d& x : mesh.nodes) x.z() *= 1 + by;
    mesh.period *= 1 + by;
    return mesh;
}

// INT f(x) dS.
template <class F>
double integral(const CurvedMesh& mesh, const F& f) {
    const SurfaceSpace space(mesh);
    const Tabulation& table = space.tabulation();
    double sum = 0;
    for (int cell = 0; cell < space.cells(); ++cell) {
        const CellColumns<3> X = cell_nodes(mesh, cell);
        for (int q = 0; q < table.points(); ++q) {
            const SurfacePoint<double> p = tangent_point(X, table, q);
            sum += table.weight[q] * p.area * f(p.x);
        }
    }
    return sum;
}

// a of r = R + a cos(2 pi n z/length + m theta + phase), small.
inline double tube_wave(const CurvedMesh& mesh, int n, int m, double phase = 0) {
    const auto r = [](const Eigen::Vector3d& x) { return x.head<2>().norm(); };
    const double area = integral(mesh, [](const auto&) { return 1.0; }), mean = integral(mesh, r) / area;
    return 2 / area * integral(mesh, [&](const Eigen::Vector3d& x) {
               return (r(x) - mean) * std::cos(2 * pi * n * x.z() / mesh.period + m * std::atan2(x.y(), x.x()) + phase);
           });
}

// a of r = R + a Re Y_l^m, small. INT (Re Y)^2 over the unit sphere is 1 for m = 0, else 1/2.
inline double sphere_wave(const CurvedMesh& mesh, int l, int m) {
    const double area = integral(mesh, [](const auto&) { return 1.0; });
    const double mean = integral(mesh, [](const Eigen::Vector3d& x) { return x.norm(); }) / area;
    return (m == 0 ? 1 : 2) * 4 * pi / area * integral(mesh, [&](const Eigen::Vector3d& x) {
               return (x.norm() - mean) * real_harmonic<double>(l, m, x.normalized());
           });
}

}  // namespace tubule::surface3d
