#include "surface3d/run/start.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <stdexcept>

#include "common/case/read.hpp"
#include "common/geometry/profile_point.hpp"
#include "common/result/result.hpp"
#include "common/shapes/profile_curve.hpp"
#include "common/shapes/revolution.hpp"
#include "surface3d/curvature/exact_curvature.hpp"
#include "surface3d/import/import_fit.hpp"
#include "surface3d/mesh/mapped_mesh.hpp"
#include "surface3d/meshing/graded_mesh.hpp"
#include "surface3d/run/motion_frame.hpp"

namespace tubule::surface3d {
namespace {

// Irregular meshes: how far points move, of their shortest edge; any seed would do.
constexpr double jitter = 0.2;
constexpr unsigned seed = 1;

int even(double n, int least) {
    return std::max(2 * static_cast<int>(std::lround(n / 2)), least);
}

// About so many equal triangles on the shape's base surface.
TriangleMesh uniform_sphere(int triangles) {
    return icosphere(std::max(static_cast<int>(std::lround(std::sqrt(triangles / 20.0))), 1));
}
TriangleMesh uniform_torus(const Torus& torus, int triangles) {
    const double aspect = torus.radius / torus.tube_radius;
    return torus_grid(torus, even(std::sqrt(triangles / 2.0 * aspect), 4),
                      even(std::sqrt(triangles / 2.0 / aspect), 4));
}
// Rings half a spacing out of step make equilateral triangles where the height of a row is sqrt(3)/2 of the spacing.
TriangleMesh uniform_tube(double radius, double length, int triangles) {
    const double around = 2 * pi * radius, side = std::sqrt(around * length / triangles * 4 / std::sqrt(3.0));
    return tube_rings(radius, length, even(length / (std::sqrt(0.75) * side), 2),
                      std::max(static_cast<int>(std::lround(around / side)), 3));
}

// A surface of revolution with waves, as a map from a base; it may move.
struct WavedMap {
    const WavedProfile& surface;
    const Torus& base;
    template <class S>
    Vector3<S> operator()(const Vector3<S>& p) const {
        return position(surface, base, p);
    }
    VectorField velocities(const TriangleMesh& triangles, int order) const {
        if (!surface.velocity) return {};
        const CurvedMesh nodes =
            mapped_mesh(triangles, order, [&](const Eigen::Vector3d& p) { return velocity(surface, base, p); });
        VectorField out(3, nodes.size());
        for (int i = 0; i < out.cols(); ++i) out.col(i) = nodes.nodes[i];
        return out;
    }
};

// The shape map(base), with its curvatures where the case wants the exact ones, and its velocity if it has one.
template <class Map>
StartMesh mapped(const Case& c, const TriangleMesh& base, const Map& map) {
    const int order = element_order(c);
    StartMesh start{mapped_mesh(base, order, map), true, {}, {}};
    if constexpr (requires { map.velocities(base, order); }) start.velocity = map.velocities(base, order);
    if (c.surface.recovery == Recovery::exact) start.exact = exact_curvature(start.mesh, exact_nodes(base, order, map));
    return start;
}

// The shape `map` over the profile's surface, in the kind of mesh that the case asks for.
template <class Map, class Uniform>
StartMesh meshed(const Case& c, int triangles, const Map& map, const Profile& profile, const Uniform& uniform) {
    const auto base = [&] {
        switch (c.surface.mesh) {
            case MeshKind::graded:
                return graded_rings(resolution_of(map, profile, element_order(c)), profile, triangles);
            case MeshKind::irregular:
                return jittered(uniform(), jitter, seed);
            default:
                return uniform();
        }
    };
    return mapped(c, base(), map);
}

// The same where equal triangles need rings that follow the surface.
template <class Map>
StartMesh meshed_in_rings(const Case& c, int triangles, const Map& map, const Profile& profile) {
    return meshed(c, triangles, map, profile,
                  [&] { return uniform_rings(resolution_of(map, profile, element_order(c)), profile, triangles); });
}

std::filesystem::path beside(const Case& c, const std::string& path) {
    return std::filesystem::path(c.path).parent_path() / path;
}

[[noreturn]] void refuse(const Case& c, const std::string& what) {
    throw CaseError(fmt::format("{}: {}", c.path, what));
}

Record frame_of(const Case& c, const ResultFrame& from, Result& result) {
    try {
        result = read_result(beside(c, from.path));
    } catch (const std::runtime_error& error) {
        refuse(c, fmt::format("shape.path: {}", error.what()));
    }
    const int count = static_cast<int>(result.frames.size()), number = from.frame < 0 ? count + from.frame : from.frame;
    if (number < 0 || number >= count)
        refuse(c, fmt::format("shape.frame must be one of the {} frames of {}, not {}", count, from.path, from.frame));
    return result.frames[number];
}

const Array* find_array(const Record& record, const std::string& name) {
    for (const Array& array : record.arrays)
        if (array.name == name) return &array;
    return nullptr;
}

double number(const Record& record, const std::string& name) {
    for (const auto& [key, value] : record.numbers)
        if (key == name) return value;
    return 0;
}

struct MakeStart {
    const Case& c;
    int triangles;

    void refuse_what_needs_a_shape() const {
        if (c.surface.mesh != MeshKind::uniform || c.surface.elements)
            refuse(c, "discretisation.mesh and .elements must be absent: the triangles come from shape.path");
        if (c.surface.recovery == Recovery::exact)
            refuse(
                c,
                "discretisation.recovery must not be \"exact\": of a surface made of triangles only points are known");
    }
    void refuse_grading(const char* shape) const {
        if (c.surface.mesh == MeshKind::graded)
            refuse(c, fmt::format("discretisation.mesh must be \"uniform\" or \"irregular\" for {}, not \"graded\"",
                                  shape));
    }
    template <class Map>
    StartMesh on_torus(const Torus& base, const Map& map) const {
        refuse_grading("a torus");
        const TriangleMesh grid = uniform_torus(base, triangles);
        return mapped(c, c.surface.mesh == MeshKind::irregular ? jittered(grid, jitter, seed) : grid, map);
    }

    template <class SphereLike>
    StartMesh operator()(const SphereLike& shape) const {
        return meshed(
            c, triangles, [&](const auto& p) { return position(shape, p); }, sphere_profile(),
            [&] { return uniform_sphere(triangles); });
    }
    StartMesh operator()(const Tube& tube) const {
        return meshed(
            c, triangles, [&](const auto& p) { return position(tube, p); }, tube_profile(tube.radius, tube.length),
            [&] { return uniform_tube(tube.radius, tube.length, triangles); });
    }
    StartMesh operator()(const Capsule& capsule) const {
        return meshed_in_rings(
            c, triangles, [&](const auto& p) { return position(capsule, p); }, capsule_profile(capsule));
    }
    StartMesh operator()(const Torus& torus) const {
        return on_torus(torus, [&](const auto& p) { return position(torus, p); });
    }
    StartMesh operator()(const WavedProfile& surface) const {
        const ProfileCurve& curve = surface.curve;
        // Where the torus is only a base, its grid must be one of cells about as long as wide.
        const Torus base{curve.mean_radius, std::min(curve.arc_length / (2 * pi), 0.9 * curve.mean_radius)};
        const WavedMap map{surface, base};
        if (curve.kind == ProfileCurve::Kind::ring) return on_torus(base, map);
        const bool tube = curve.kind == ProfileCurve::Kind::tube;
        return meshed_in_rings(c, triangles, map,
                               tube ? tube_profile(curve.mean_radius, curve.length) : sphere_profile());
    }
    StartMesh operator()(const MeshFile& file) const {
        refuse_what_needs_a_shape();
        try {
            ImportedMesh imported = read_mesh(beside(c, file.path), file.weld);
            close_mesh(imported);
            Fit fit = fit_surface(imported, {.order = element_order(c), .smoothing = file.smoothing});
            std::vector<std::string> notes = imported.notes;
            notes.insert(notes.end(), fit.report.notes.begin(), fit.report.notes.end());
            return {std::move(fit.surface), false, notes, {}};
        } catch (const MeshError& error) {
            refuse(c, fmt::format("shape.path: {}", error.what()));
        }
    }
    StartMesh operator()(const ResultFrame& from) const {
        Result result;
        const Record frame = frame_of(c, from, result);
        if (frame.mesh) {
            refuse_what_needs_a_shape();
            const CurvedMesh mesh = curved_mesh(result.meshes.at(*frame.mesh), *find_array(frame, "points"));
            return {mesh.order == element_order(c) ? mesh : with_order(mesh, element_order(c)), false, {}, {}};
        }
        if (find_array(frame, "knots") && find_array(frame, "coefficients")) return of_graph(frame);
        const Array *r = find_array(frame, "r"), *z = find_array(frame, "z");
        if (!r || !z) refuse(c, fmt::format("shape.path: {} holds no surface and no profile of one", from.path));
        try {
            return (*this)(WavedProfile{profile_curve(r->data, z->data, number(frame, "length")), {}, {}});
        } catch (const std::invalid_argument& error) {
            refuse(c, fmt::format("shape.path: {}: {}", from.path, error.what()));
        }
    }
    StartMesh of_graph(const Record& frame) const {
        const Revolution tube{static_cast<int>(number(frame, "degree")), number(frame, "length"),
                              find_array(frame, "knots")->data, find_array(frame, "coefficients")->data};
        if (tube.degree < 1 || tube.degree > 7 || tube.length <= 0 || tube.coefficients.empty() ||
            tube.knots.size() != tube.coefficients.size() + tube.degree + 1)
            refuse(c, "shape.path: the spline of the frame is damaged");
        double radius = 0;
        for (const double r : tube.coefficients) radius += r / tube.coefficients.size();
        return meshed(
            c, triangles, [&](const auto& p) { return position(tube, p); }, tube_profile(radius, tube.length),
            [&] { return uniform_tube(radius, tube.length, triangles); });
    }
};

}  // namespace

StartMesh start_mesh(const Case& c, int triangles) {
    const MakeStart make{c, triangles};
    return c.handover ? make(c.handover->surface) : std::visit(make, c.shape);
}

}  // namespace tubule::surface3d
