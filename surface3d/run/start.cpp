#include "surface3d/run/start.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <stdexcept>

#include "common/case/read.hpp"
#include "common/geometry/profile_point.hpp"
#include "common/result/frame_profile.hpp"
#include "common/result/start_frame.hpp"
#include "common/solve/memory.hpp"
#include "surface3d/curvature/curvature.hpp"
#include "surface3d/curvature/exact_curvature.hpp"
#include "surface3d/import/import_cgal.hpp"
#include "surface3d/import/import_fit.hpp"
#include "surface3d/mesh/mapped_mesh.hpp"
#include "surface3d/meshing/graded_mesh.hpp"
#include "surface3d/motion/surface_law.hpp"
#include "surface3d/run/mesh_record.hpp"
#include "surface3d/run/remeshed_start.hpp"

namespace tubule::surface3d {

namespace {

// Irregular meshes: how far points move, of their shortest edge; any seed would do.
constexpr double jitter = 0.2;
constexpr unsigned seed = 1;

// Tubes of as many triangles as the accuracy needs: points in a circle from which their width follows, and the largest
// width over that of equal sides. Values as small as rounding count as 0.
constexpr int samples = 32, most_rings = 256;
constexpr double widest = 2.5, axisymmetric = 1e-9, rounding = 1e-13;

// For each entry of the matrix of a cell, in what is made of a mesh. Measured: docs/decisions/time_and_memory.md.
constexpr double bytes_per_cell_entry = 45;

// What a step solves for: velocity, H and K, and a pressure.
int fields_of(const SurfaceLaw& law) {
    return law.components() + 2 + law.inextensible;
}

int even(double n, int least, int most) {
    return std::max(2 * static_cast<int>(std::lround(std::min(n, most - 1.0) / 2)), least);
}

// About `triangles` equal triangles on a base surface.
TriangleMesh divided(const UnitSphere&, int triangles) {
    return icosphere(std::max(static_cast<int>(std::lround(std::sqrt(triangles / 20.0))), 1));
}
TriangleMesh divided(const Torus& torus, int triangles) {
    const double aspect = torus.radius / torus.tube_radius;
    return torus_grid(torus, even(std::sqrt(triangles / 2.0 * aspect), 4, triangles),
                      even(std::sqrt(triangles / 2.0 / aspect), 4, triangles));
}
// Rings half a spacing out of step make equilateral triangles where the height of a row is sqrt(3)/2 of the spacing;
// `wider`: by how much triangles are wider than that.
TriangleMesh divided(const Cylinder& tube, int triangles, double wider = 1) {
    const double around = 2 * pi * tube.radius, side = std::sqrt(around * tube.length / triangles * 4 / std::sqrt(3.0)),
                 stretch = std::sqrt(wider);
    return tube_rings(tube.radius, tube.length, even(tube.length * stretch / (std::sqrt(0.75) * side), 2, triangles),
                      std::clamp(static_cast<int>(std::lround(around / (stretch * side))), 3, std::max(triangles, 3)));
}

// The best ratio of width to height of triangles of this order, with which interpolation is as accurate along a tube as
// around it: by its differences of degree order + 1 in both directions. 1 for non-axisymmetric tubes, whose azimuthal
// waves add to the axial ones. Measured: docs/decisions/surface_motion.md.
template <class Map>
double best_width(const Cylinder& tube, const Map& map, int order) {
    const auto at = [&](double theta, double z) {
        const double periods = std::floor(z / tube.length);
        const Eigen::Vector3d p(tube.radius * std::cos(theta), tube.radius * std::sin(theta),
                                z - periods * tube.length);
        return Eigen::Vector3d(map(p) + periods * tube.length * Eigen::Vector3d::UnitZ());
    };
    const auto seen = [&](double theta, double z) {
        return Eigen::AngleAxisd(-theta, Eigen::Vector3d::UnitZ()) * at(theta, z);
    };
    const double spacing = std::min(2 * pi * tube.radius, tube.length) / samples, degree = order + 1;
    const int rings = static_cast<int>(std::min(std::ceil(tube.length / spacing), 1.0 * most_rings));
    double along = 0, around = 0;
    for (int ring = 0; ring < rings; ++ring) {
        const double z = ring * tube.length / rings;
        for (int i = 1; i < samples; ++i)
            if ((seen(2 * pi * i / samples, z) - seen(0, z)).norm() > axisymmetric * tube.radius) return 1;
        Eigen::Vector3d of_z = Eigen::Vector3d::Zero(), of_theta = of_z;
        double binomial = 1;
        for (int m = 0; m <= degree; ++m) {
            of_z += binomial * at(0, z + m * spacing);
            of_theta += binomial * at(m * spacing / tube.radius, z);
            binomial *= -(degree - m) / (m + 1);
        }
        along += of_z.squaredNorm();
        around += of_theta.squaredNorm() + std::pow(rounding * (tube.radius + tube.length), 2);
    }
    return std::clamp(std::pow(along / around, 0.5 / degree), 1.0, widest);
}

// A surface of revolution with modes, as a map from a base; it may move.
struct CurveMap {
    PerturbedCurve curve;
    Torus base;
    template <class S>
    Vector3<S> operator()(const Vector3<S>& p) const {
        return position(curve, base, p);
    }
    VectorField velocities(const TriangleMesh& triangles, int order) const {
        if (!curve.velocity) return {};
        const CurvedMesh nodes =
            mapped_mesh(triangles, order, [&](const Eigen::Vector3d& p) { return velocity(curve, base, p); });
        return node_positions(nodes);
    }
};

// The same with a spontaneous curvature of the area below.
struct ProfileMap : CurveMap {
    CurveFunctions area_below;  // as tubule::area_below() has it
    std::shared_ptr<const Formula> H0_of_area;

    double H0_at(const Eigen::Vector3d& p) const {
        const double along = place_of(curve, base, p).along;
        const double rise = curve.is_cell() ? 0 : along;
        const double area = value_at(area_below, along)[1] + rise;
        return evaluate(*H0_of_area, &area);
    }
    Eigen::VectorXd H0(const TriangleMesh& triangles, int order) const {
        const CurvedMesh nodes =
            mapped_mesh(triangles, order, [&](const Eigen::Vector3d& p) { return Eigen::Vector3d(H0_at(p), 0, 0); });
        return node_positions(nodes).row(0).transpose();
    }
};

// What is needed for every order of elements is made once for each.
template <class T>
using ByOrder = std::shared_ptr<std::map<int, T>>;
template <class T, class MakeOne>
const T& once(const ByOrder<T>& made, int order, const MakeOne& make) {
    const auto found = made->find(order);
    return found != made->end() ? found->second : made->emplace(order, make()).first->second;
}

// Meshes of the shape map(base), of the kind that the case asks for, with exact curvatures where it asks for them, and
// the velocity and H0 of the map if it has these.
template <class Base, class Map>
Start::Make meshes_of(const Problem& c, const Base& base, const Map& map) {
    const ByOrder<Resolution> resolutions = std::make_shared<std::map<int, Resolution>>();
    const auto triangulation = [=, kind = c.surface.mesh, by_accuracy = !c.surface.elements](int triangles, int order) {
        if constexpr (std::is_same_v<Base, Cylinder>)
            if (kind == MeshKind::uniform && by_accuracy) return divided(base, triangles, best_width(base, map, order));
        if constexpr (!std::is_same_v<Base, Torus>) {
            const auto resolution = [&]() -> const Resolution& {
                return once(resolutions, order, [&] { return resolution_of(map, meridian(base), order); });
            };
            if (kind == MeshKind::graded) return graded_rings(resolution(), meridian(base), triangles);
            if constexpr (std::is_same_v<Base, Curve>) {
                TriangleMesh rings = uniform_rings(resolution(), base, triangles);
                return kind == MeshKind::irregular ? jittered(rings, jitter, seed) : rings;
            }
        }
        if constexpr (!std::is_same_v<Base, Curve>)
            return kind == MeshKind::irregular ? jittered(divided(base, triangles), jitter, seed)
                                               : divided(base, triangles);
    };
    return [=, exact = c.surface.recovery == Recovery::exact](int triangles, int order) {
        const TriangleMesh flat = triangulation(triangles, order);
        StartMesh start{mapped_mesh(flat, order, map), {}, {}};
        if constexpr (requires { map.velocities(flat, order); }) start.velocity = map.velocities(flat, order);
        if constexpr (requires { map.H0(flat, order); }) start.H0 = map.H0(flat, order);
        if (exact) start.exact = exact_curvature(start.mesh, exact_nodes(flat, order, map));
        return start;
    };
}

// Calls `make` with a mesh of the case; if that turns out to be unusable, the complaint begins with `blame`.
template <class MakeOne>
auto usable(const std::string& blame, const MakeOne& make) {
    try {
        return make();
    } catch (const MeshError& error) {
        throw CaseError(fmt::format("{}: {}", blame, error.what()));
    }
}

const std::string* given_bytes(const Problem& c) {
    return c.input && !c.input->bytes.empty() ? &c.input->bytes : nullptr;
}

// The meshes of an initial shape, and notes about them for the user.
struct Prepared {
    Start::Make make;
    bool resizable = true;
    std::vector<std::string> notes = {};
};

// The same, scaled and then disturbed.
Prepared as_asked(Prepared given, const MeshFile& file, int order) {
    const double factor =
        file.area ? std::sqrt(*file.area / area_of(given.make(0, order).mesh)) : file.scale.value_or(1);
    if (factor == 1 && file.modes.empty()) return given;
    given.make = [make = given.make, factor, modes = file.modes](int triangles, int order) {
        StartMesh start = make(triangles, order);
        start.mesh = scaled(start.mesh, factor);
        const double radius = std::sqrt(area_of(start.mesh) / (4 * pi));
        if (!modes.empty()) start.mesh = displaced(start.mesh, Sphere{radius, modes});
        return start;
    };
    return given;
}

// Users of a mesh may not know how large it is. Bending forces change it in R^4/kappa times the friction, as far as
// viscosity or inertia do not take longer.
std::string far_off(const Problem& c, double area) {
    constexpr double latest = 100, earliest = 1e-4;
    const double kappa = 2 * c.energy.k[term_number("k20")], radius = std::sqrt(area / (4 * pi));
    if (!(kappa > 0)) return {};
    const MotionLaw& law = c.law;
    const double size = radius * radius, time = std::max({law.friction * size * size, law.viscosity * size,
                                                          std::sqrt(law.inertia * kappa) * size}) /
                                                kappa;
    if (!(time > 0) || (c.time.end <= latest * time && c.time.end >= earliest * time)) return {};
    return fmt::format(
        "time.end = {:.4g} is {:.2g} times the {:.2g} in which bending moves a surface of this size (R^4/kappa at a "
        "friction of 1: kappa = 2 k20, R = {:.3g} from the area); set time.end to {:.1g} or so, or give the surface "
        "another size by shape.area or shape.scale",
        c.time.end, c.time.end / time, time, radius, time);
}

struct Prepare {
    const Problem& c;

    void refuse_what_needs_a_shape() const {
        const std::string absent = "must be absent: the triangles come from shape.path";
        if (c.surface.mesh != MeshKind::uniform) throw complaint(c, "discretisation.mesh", absent);
        if (c.surface.elements) throw complaint(c, "discretisation.elements", absent);
        if (c.surface.coarsen) throw complaint(c, "discretisation.coarsen", absent);
        if (c.surface.recovery == Recovery::exact)
            throw complaint(c, "discretisation.recovery",
                            "must not be \"exact\": a surface made of triangles is known only at points");
    }
    template <class Base, class Map>
    Prepared on(const Base& base, const Map& map) const {
        if (std::is_same_v<Base, Torus> && c.surface.mesh == MeshKind::graded)
            throw complaint(c, "discretisation.mesh",
                            "must be \"uniform\" or \"irregular\" for a torus, not \"graded\"");
        return {meshes_of(c, base, map)};
    }

    template <class Shape>
    Prepared operator()(const Shape& shape) const {
        return on(base(shape), [shape](const auto& p) { return position(shape, p); });
    }
    Prepared operator()(const Patch&) const {
        throw complaint(c, "shape.kind",
                        "must not be \"patch\": tier surface3d has closed surfaces and periodic tubes");
    }
    Prepared operator()(const PerturbedCurve& curve) const {
        if (is_patch(curve.topology))
            throw complaint(c, "shape.path",
                            "must not hold a patch: tier surface3d has closed surfaces and periodic tubes");
        return of_profile(curve, [&](const Torus& torus) { return CurveMap{curve, torus}; });
    }
    template <class MapOn>
    Prepared of_profile(const PerturbedCurve& curve, const MapOn& map_on) const {
        // Where the torus is only a base, its grid must be one of cells about as long as wide.
        const Torus torus{curve.mean_radius, std::min(curve.arc_length / (2 * pi), 0.9 * curve.mean_radius)};
        const auto map = map_on(torus);
        if (curve.is_ring()) return on(torus, map);
        if (curve.is_cell()) return on(meridian(UnitSphere{}), map);
        return on(meridian(Cylinder{curve.mean_radius, curve.length}), map);
    }
    Prepared operator()(const FormulaShape& shape) const {
        const auto map = [shape](const auto& p) { return position(shape, p); };
        if (shape.length) return on(Cylinder{mean_radius(shape), *shape.length}, map);
        return on(UnitSphere{}, map);
    }
    Prepared operator()(const ProfileFile& file) const {
        const FittedProfile profile = start_profile(c, file);
        const PerturbedCurve curve = curve_through(profile);
        const auto with_H0 = [&](const Torus& torus) {
            return ProfileMap{{curve, torus}, area_below(profile, curve), profile.H0};
        };
        Prepared out = profile.H0 ? of_profile(curve, with_H0) : (*this)(curve);
        out.notes.push_back(profile.note());
        return out;
    }
    // New triangles of it; of other orders, what interpolates them.
    Prepared remeshed(const MeshFile& file, const std::string& blame) const {
        if (!cgal::available())
            throw complaint(c, "shape.remesh",
                            "needs a build with CGAL: install libcgal-dev (Debian, Ubuntu) or CGAL 5.5 or newer, then "
                            "run cmake --preset release && cmake --build --preset release");
        const RemeshedStart start = usable(blame, [&] {
            return remeshed_start(read_mesh(beside(c, file.path), file.weld, true, given_bytes(c)), file,
                                  c.element_order);
        });
        return {[start](int, int order) { return StartMesh{start.of_order(order), {}, {}}; }, false, start.notes};
    }
    Prepared operator()(const MeshFile& file) const {
        refuse_what_needs_a_shape();
        const std::string blame = complaint(c, "shape.path", "cannot be used").what();
        if (file.remesh) return as_asked(remeshed(file, blame), file, c.element_order);
        const auto imported = std::make_shared<ImportedMesh>(usable(blame, [&] {
            ImportedMesh mesh = read_mesh(beside(c, file.path), file.weld, false, given_bytes(c));
            close_mesh(mesh);
            return mesh;
        }));
        const ByOrder<Fit> fits = std::make_shared<std::map<int, Fit>>();
        const auto fit = [=, smoothing = file.smoothing](int order) -> const Fit& {
            return once(fits, order, [&] {
                return usable(blame, [&] { return fit_surface(*imported, {order, smoothing}); });
            });
        };
        std::vector<std::string> notes = imported->notes;
        const std::vector<std::string>& more = fit(c.element_order).report.notes;
        notes.insert(notes.end(), more.begin(), more.end());
        return as_asked({[=](int, int order) {
                             return StartMesh{fit(order).surface, {}, {}};
                         },
                         false, notes},
                        file, c.element_order);
    }
    Prepared operator()(const ResultFrame& from) const {
        const auto [frame, cells] = start_frame(c);
        if (cells) {
            refuse_what_needs_a_shape();
            const CurvedMesh mesh = along_eigenmodes(disturbed(frame_surface(frame, *cells), from), frame, from);
            return {[mesh, moves = velocities(frame, mesh)](int, int order) {
                        if (mesh.order == order)
                            return StartMesh{mesh, {}, moves ? node_positions(*moves) : VectorField()};
                        return StartMesh{with_order(mesh, order),
                                         {},
                                         moves ? node_positions(with_order(*moves, order)) : VectorField()};
                    },
                    false};
        }
        try {
            PerturbedCurve start = disturbed_curve(c, frame);
            if (asks_for_velocity()) start.velocity = frame_velocity(frame, start);
            if (asks_for_velocity() && !start.velocity) throw without_velocity();
            for (std::size_t i = 0; i < from.eigenmodes.size(); ++i)
                start.modes.push_back(profile_mode(start, frame, from, i));
            return (*this)(start);
        } catch (const std::invalid_argument& error) {
            throw complaint(c, "shape.path", fmt::format("cannot be used: {}: {}", from.path, error.what()));
        }
    }
    CurvedMesh disturbed(CurvedMesh mesh, const ResultFrame& from) const {
        if (from.modes.empty()) return mesh;
        try {
            const bool closed = mesh.period == 0;
            const double radius = std::sqrt(area_of(mesh) / (4 * pi * (closed ? 1 : mesh.period)));
            return displaced(mesh, disturbed_shape(from, closed, radius, mesh.period));
        } catch (const std::invalid_argument& error) {
            throw complaint(c, c.places.contains("shape.mode") ? "shape.mode" : "shape.noise", error.what());
        }
    }
    // The i-th of the frame's modes that the case asks for, its largest value the amplitude asked for.
    std::vector<double> eigenmode(const Record& frame, const ResultFrame& from, std::size_t i, std::size_t size) const {
        const auto& [of, amplitude] = from.eigenmodes[i];
        const Array* found = is_mode(of) ? find_array(frame, of) : nullptr;
        if (!found || found->data.size() != size) {
            std::vector<std::string> there;
            for (const Array& array : frame.arrays)
                if (is_mode(array.name)) there.push_back(array.name);
            throw complaint(c, fmt::format("shape.eigenmode.{}.of", i),
                            fmt::format("must be a mode of the frame, {}, not \"{}\"",
                                        there.empty() ? "which has none (equilibrium.rates or .modes writes them)"
                                                      : fmt::format("{}", fmt::join(there, " or ")),
                                        of));
        }
        double largest = 0;
        for (const double w : found->data) largest = std::max(largest, std::abs(w));
        std::vector<double> out = found->data;
        for (double& w : out) w *= amplitude / largest;
        return out;
    }
    static bool is_mode(const std::string& name) {
        return name.starts_with("mode_") || (name.starts_with("displacement_") && name != "displacement_0");
    }
    CurvedMesh along_eigenmodes(CurvedMesh mesh, const Record& frame, const ResultFrame& from) const {
        if (from.eigenmodes.empty()) return mesh;
        const VectorField normal = PatchRecovery(mesh).nodal(mesh).normal;
        for (std::size_t i = 0; i < from.eigenmodes.size(); ++i) {
            const std::vector<double> w = eigenmode(frame, from, i, mesh.nodes.size());
            for (int a = 0; a < mesh.size(); ++a) mesh.nodes[a] += w[a] * normal.col(a);
        }
        return mesh;
    }
    CurveMode profile_mode(const PerturbedCurve& curve, const Record& frame, const ResultFrame& from,
                           std::size_t i) const {
        const std::string& of = from.eigenmodes[i].of;
        const Array* found = find_array(frame, of);
        const std::vector<double> w = eigenmode(frame, from, i, found ? found->data.size() : 0);
        return normal_mode(curve, std::stoi(of.substr(of.find('_') + 1)), w);
    }
    bool asks_for_velocity() const { return c.velocity.initial == InitialVelocity::result; }
    CaseError without_velocity() const {
        return complaint(c, "velocity.initial", "must not be \"result\": the frame of shape.path has no velocity");
    }
    // Those of a frame at the nodes of its mesh, as positions of nodes of a mesh alike.
    std::optional<CurvedMesh> velocities(const Record& frame, const CurvedMesh& mesh) const {
        if (!asks_for_velocity()) return std::nullopt;
        const Array* u = find_array(frame, "u");
        if (!u || u->data.size() != 3 * mesh.nodes.size()) throw without_velocity();
        CurvedMesh out = mesh;
        out.period = 0;
        for (std::size_t i = 0; i < out.nodes.size(); ++i)
            out.nodes[i] = Eigen::Map<const Eigen::Vector3d>(u->data.data() + 3 * i);
        return out;
    }
};

}  // namespace

Start::Start(const Problem& c) {
    Prepared prepared = c.handover ? Prepare{c}(c.handover->curve) : std::visit(Prepare{c}, c.shape);
    make_ = std::move(prepared.make);
    resizable_ = prepared.resizable;
    notes_ = std::move(prepared.notes);
    if (c.moves() && std::holds_alternative<MeshFile>(c.shape))
        time_scale_ = far_off(c, area_of(make_(0, c.element_order).mesh));
    if (!time_scale_.empty()) notes_.push_back(time_scale_);
    if (c.moves()) fields_ = fields_of(c.law);
}

StartMesh Start::mesh(int triangles, int order) const {
    const double width = fields_ * (order + 1) * (order + 2) / 2;  // of the matrix of a triangle
    if (resizable_)
        require_memory(bytes_per_cell_entry * width * width * triangles,
                       fmt::format("a surface of {} triangles of order {}", triangles, order));
    return make_(triangles, order);
}

namespace {

struct Moments {
    double area = 0;
    Eigen::Vector3d first = Eigen::Vector3d::Zero();  // INT x dS
};
Moments moments(const CurvedMesh& mesh) {
    Moments out;
    for_each_point(mesh, default_degree(mesh.order), [&](int, const SurfacePoint<double>& p, double weight) {
        out.area += weight * p.area, out.first += weight * p.area * p.x;
    });
    return out;
}

}  // namespace

double area_of(const CurvedMesh& mesh) {
    return moments(mesh).area;
}

CurvedMesh scaled(CurvedMesh mesh, double factor) {
    for (Eigen::Vector3d& x : mesh.nodes) x *= factor;
    mesh.period *= factor;
    return mesh;
}

CurvedMesh displaced(CurvedMesh mesh, const DisturbedShape& modes) {
    const Moments m = moments(mesh);
    const Eigen::Vector3d centre =
        std::holds_alternative<Sphere>(modes) ? Eigen::Vector3d(m.first / m.area) : Eigen::Vector3d::Zero();
    const VectorField normal = PatchRecovery(mesh).nodal(mesh).normal;
    for (int i = 0; i < mesh.size(); ++i) {
        const Eigen::Vector3d at = mesh.nodes[i] - centre;
        mesh.nodes[i] += height_at<double>(modes, at) * normal.col(i);
    }
    return mesh;
}

}  // namespace tubule::surface3d
