#include "surface3d/run/remeshed_start.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>
#include <variant>

#include "common/solve/pause.hpp"
#include "surface3d/curvature/curvature.hpp"
#include "surface3d/fem/projection.hpp"
#include "surface3d/import/import_cgal.hpp"
#include "surface3d/import/import_fit.hpp"
#include "surface3d/import/mesh_distance.hpp"
#include "surface3d/import/mesh_smoothing.hpp"
#include "surface3d/mesh/mapped_mesh.hpp"
#include "surface3d/mesh/self_intersection.hpp"
#include "surface3d/meshing/remesh.hpp"
#include "surface3d/meshing/remesh_sizes.hpp"
#include "surface3d/motion/extent.hpp"
#include "surface3d/motion/motion_fields.hpp"
#include "surface3d/run/guards.hpp"

namespace tubule::surface3d {
namespace {

using Eigen::Vector3d;

// Measured: docs/decisions/curvature_and_meshes.md.
constexpr double fine_edges = 3;      // of the mesh that is smoothed, in an edge of the new triangles
constexpr double first_length = 2.5;  // of smoothing, in these edges
constexpr double longer = 1.2;
constexpr int most_lengths = 7;
constexpr int smoothings = 2;
// Angles of the surface that an edge may span.
constexpr double least_angle = 0.4, most_angle = 1.0;
constexpr double sharpest_start = 1;  // radians from node to node
constexpr double wrap_offset = 0.05;  // of the gaps that are closed
// Squares of that side in the area of what is wrapped, and the seconds that each takes.
constexpr double most_gaps = 5e4, seconds_per_gap = 1.2e-3;
constexpr double crease = 45;       // degrees between neighbours
constexpr double folded = 120;      // degrees, too
constexpr double unfolding = 0.33;  // of the length
constexpr double flattest = 1e-3;   // of the volume of a ball of the same area

// A closed mesh, the volume that its surface should bound, and what was done to make it.
struct Body {
    std::string name;
    TriangleMesh mesh;
    double volume = 0;
    std::vector<std::string> notes;
};

TriangleMesh filled(const ImportedMesh& file, std::vector<std::string>& notes) {
    const cgal::FilledHoles filled = cgal::fill_holes(file.mesh);
    if (filled.left > 0)
        throw MeshError(fmt::format("{}: {} of {} holes cannot be filled; shape.wrap = LENGTH may help", file.file,
                                    filled.left, filled.left + filled.holes));
    if (filled.holes > 0)
        notes.push_back(fmt::format("{} holes were filled; the longest border, at {}, measures {:.3g}.", filled.holes,
                                    words_of_place(filled.at), filled.longest));
    return filled.mesh;
}

// Nothing can end the wrapping itself.
void check_effort_of_wrapping(const ImportedMesh& file, double gap) {
    const double area = mesh_area(file.mesh), gaps = area / (gap * gap);
    if (gaps > most_gaps)
        refuse(file, fmt::format("shape.wrap = {:g} is too small for a surface of area {:.3g}: a wrap would have about "
                                 "{:.2g} triangles; try shape.wrap = {:.2g}, or remove vertices that are far away",
                                 gap, area, 8 * gaps, std::sqrt(area / (0.2 * most_gaps))));
    check_pause(seconds_per_gap * gaps);
}

Body body_of(ImportedMesh& file, const MeshFile& shape) {
    Body body{file.file, {}, 0, {}};
    if (shape.wrap) {
        check_effort_of_wrapping(file, *shape.wrap);
        const double offset = wrap_offset * *shape.wrap;
        ImportedMesh around = imported(cgal::wrap(file.mesh, *shape.wrap / 2, offset), file.file);
        around.is_new = true;
        repair_mesh(around, false);
        body.volume = mesh_volume(around.mesh) - offset * mesh_area(around.mesh);
        body.mesh = std::move(around.mesh);
        body.notes = {
            fmt::format("A surface of {} triangles was wrapped around the {} of the file; gaps narrower than "
                        "{:g} are closed.",
                        body.mesh.triangles.size(), file.mesh.triangles.size(), *shape.wrap)};
    } else {
        repair_mesh(file, shape.fill_holes);
        body.notes = file.notes;
        body.mesh = shape.fill_holes ? filled(file, body.notes) : file.mesh;
        if (mesh_volume(body.mesh) < 0)
            for (auto& corner : body.mesh.triangles) std::swap(corner[1], corner[2]);
        body.volume = mesh_volume(body.mesh);
    }
    const double ball = std::pow(mesh_area(body.mesh), 1.5) / (6 * std::sqrt(EIGEN_PI));
    if (!(body.volume > flattest * ball))
        throw MeshError(
            fmt::format("{}: the surface encloses next to nothing: a volume of {:.3g}, where a ball of "
                        "this area has {:.3g}; is it a sheet?",
                        body.name, body.volume, ball));
    return body;
}

// The creased edges of a mesh, as triangles without area.
TriangleMesh creases_of(const TriangleMesh& mesh, double& sharpest) {
    std::map<std::pair<int, int>, std::size_t> left;
    TriangleMesh out;
    out.points = mesh.points;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const auto& c = mesh.triangles[t];
        for (int i = 0; i < 3; ++i) {
            const auto other = left.find({c[(i + 1) % 3], c[i]});
            left[{c[i], c[(i + 1) % 3]}] = t;
            if (other == left.end()) continue;
            const double kink = kink_between(area_vector(mesh, mesh.triangles[other->second]), area_vector(mesh, c));
            sharpest = std::max(sharpest, kink);
            if (kink > crease) out.triangles.push_back({c[i], c[(i + 1) % 3], c[(i + 1) % 3]});
        }
    }
    return out;
}

// Whether neighbours face away from each other.
bool is_folded(const TriangleMesh& mesh) {
    double sharpest = 0;
    creases_of(mesh, sharpest);
    return sharpest > folded;
}

TriangleMesh smooth_mesh(const Body& body, double edge, double length) {
    // The height that several smoothings leave together is half at this wavelength.
    const double each = length * std::pow(std::pow(2, 1.0 / smoothings) - 1, 0.25);
    TriangleMesh mesh = cgal::isotropic(body.mesh, edge);
    if (is_folded(mesh)) mesh = cgal::isotropic(unfolded(mesh, unfolding * length), edge);
    for (int i = 0; i < smoothings; ++i) {
        check_pause();
        mesh = smoothed(i > 0 ? cgal::isotropic(mesh, edge) : mesh, each);
    }
    return with_volume(mesh, body.volume);
}

// Whether a path over at most `neighbours` triangles leads from one triangle to the other.
bool are_near(const TriangleMesh& mesh, std::size_t from, std::size_t to, int neighbours) {
    std::vector<std::vector<std::size_t>> at(mesh.points.size());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (const int v : mesh.triangles[t]) at[v].push_back(t);
    std::vector<bool> seen(mesh.triangles.size());
    std::vector<std::size_t> ring{from};
    seen[from] = true;
    for (int i = 0; i < neighbours && !seen[to]; ++i)
        for (const std::size_t t : std::exchange(ring, {}))
            for (const int v : mesh.triangles[t])
                for (const std::size_t s : at[v])
                    if (!seen[s]) seen[s] = true, ring.push_back(s);
    return seen[to];
}

// Triangles that noise has folded are near each other, and more smoothing parts them. Others belong to parts of the
// surface that cross, which it would move far.
void check_crossing(const Body& body, const TriangleMesh& smooth, double length, int neighbours) {
    const auto pair = first_intersection(smooth);
    if (!pair || are_near(smooth, pair->first, pair->second, neighbours)) return;
    throw MeshError(
        fmt::format("{}: smoothed over {:.3g}, parts of the surface that are far from each other along it "
                    "intersect at {}; move them apart in the file, or shape.wrap = LENGTH joins them",
                    body.name, length, words_of_place(smooth.points[smooth.triangles[pair->first][0]])));
}

// The curved surface through the vertices of a mesh that is not the file's.
CurvedMesh curved(const std::string& name, const TriangleMesh& mesh, int order) {
    ImportedMesh made = imported(mesh, name);
    made.is_new = true;
    close_mesh(made);
    return fit_surface(made, {.order = order}).surface;
}

// The smallest angle of the surface over an edge for which `triangles` are enough.
std::optional<double> angle_for(const CurvedMesh& surface, int triangles) {
    const CurvatureField curvature = PatchRecovery(surface).nodal(surface);
    const auto enough = [&](double angle) {
        const MeshSizes sizes = mesh_sizes(surface, curvature.H, curvature.K, {.triangles = triangles, .angle = angle});
        return !sizes.lost && sizes.triangles < 1.01 * triangles;
    };
    if (!enough(most_angle)) return std::nullopt;
    double low = least_angle, high = most_angle;
    while (high - low > 0.02) {
        const double middle = (low + high) / 2;
        (enough(middle) ? high : low) = middle;
    }
    return high;
}

CurvedMesh with_volume(CurvedMesh mesh, double volume) {
    const SurfaceSpace space(mesh);
    const VectorField normal = PatchRecovery(mesh).nodal(mesh).normal;
    for (int step = 0; step < 4; ++step) {
        const Extent now = extent(space, mesh);
        for (int i = 0; i < mesh.size(); ++i) mesh.nodes[i] += (volume - now.volume) / now.area * normal.col(i);
    }
    return mesh;
}

// Why a run from this surface would stop at once, if its limits were four fifths of what they are.
std::optional<std::string> why_unusable(const CurvedMesh& surface) {
    const SurfaceSpace space(surface);
    const MotionFields fields = motion_fields(space, surface, Projection(space, surface));
    const Observables o = observe(space, surface, {fields.normal, {}, fields.H, fields.K}, Bending{});
    if (const auto bad = find_impossible_curvature(o, surface, 0.008)) return bad->message;
    const MeshTurn turn = mesh_turn(surface, mesh_quality(surface), fields.H, fields.K);
    if (turn.angle > sharpest_start)
        return fmt::format("the normal turns by {:.2g} radians from node to node at {}", turn.angle,
                           words_of_place(turn.where));
    if (const auto met = find_self_intersection(surface)) return met->message;
    return std::nullopt;
}

// A surface of this number of triangles, or why there is none.
std::variant<RemeshedStart, std::string> resolved(const Body& body, const TriangleMesh& smooth, int triangles,
                                                  int order) {
    try {
        // Elements of order 2 are those of order 3 without their highest degree: the surface is known better.
        const CurvedMesh fine = curved(body.name, smooth, std::max(order, 3));
        const auto angle = angle_for(fine, triangles);
        if (!angle) return fmt::format("the surface has more detail than {} triangles resolve", triangles);
        auto made = remesh(fine, Eigen::MatrixXd(0, fine.size()), {.triangles = triangles, .angle = *angle});
        if (const auto* lost = std::get_if<StopReport>(&made)) return lost->message;
        RemeshedStart out{with_volume(std::get<Remeshed>(made).mesh, body.volume), body.volume, body.notes};
        if (const auto why = why_unusable(out.of_order(order))) return *why;
        return out;
    } catch (const MeshError& error) {
        return std::string(error.what()).substr(body.name.size() + 2);
    }
}

double size_of(const TriangleMesh& mesh) {
    Eigen::AlignedBox<double, 3> box;
    for (const Vector3d& x : mesh.points) box.extend(x);
    return box.diagonal().norm();
}

struct Farthest {
    double distance = 0, squares = 0, area = 0;
    Vector3d at{0, 0, 0};
    void add(const DistanceSample& sample) {
        squares += sample.area * sample.distance * sample.distance, area += sample.area;
        if (sample.distance > distance) distance = sample.distance, at = sample.at;
    }
};

// How far the surface is from the file, and how much of that is due to creases.
std::string distance_note(const TriangleMesh& file, const TriangleMesh& surface, double grain, double length) {
    const double size = size_of(file);
    const auto percent = [&](double d) { return fmt::format("{:.2g} percent", 100 * d / size); };
    Farthest all, smooth;
    double sharpest = 0;
    const TriangleMesh creases = creases_of(file, sharpest);
    const MeshDistance to_crease(creases);
    for (const DistanceSample& sample : distances(surface, file, grain)) all.add(sample);
    for (const DistanceSample& sample : distances(file, surface, grain)) {
        all.add(sample);
        if (creases.triangles.empty() || to_crease(sample.at) > length / 2) smooth.add(sample);
    }
    std::string note = fmt::format(
        "The initial shape is at most {:.3g} from the file, {} of its size {:.4g}, at {}; {} rms.", all.distance,
        percent(all.distance), size, words_of_place(all.at), percent(std::sqrt(all.squares / all.area)));
    if (!creases.triangles.empty())
        note += fmt::format(
            " The file has {} creases (edges kinked by more than {:g} degrees, up to {:.0f}), which are "
            "rounded over the length of smoothing; away from them it is at most {}.",
            creases.triangles.size(), crease, sharpest, percent(smooth.distance));
    return note;
}

}  // namespace

CurvedMesh RemeshedStart::of_order(int order) const {
    return order == surface.order ? surface : with_volume(with_order(surface, order), volume);
}

RemeshedStart remeshed_start(ImportedMesh file, const MeshFile& shape, int order) {
    const int triangles = shape.remesh.value();
    const TriangleMesh given = file.mesh;
    const Body body = body_of(file, shape);
    std::string why;
    double length = shape.smoothing_length.value_or(0);
    for (int i = 0; i < (shape.smoothing_length ? 1 : most_lengths); ++i) {
        const double edge = even_edge(mesh_area(body.mesh), triangles);
        if (!shape.smoothing_length) length = first_length * edge * std::pow(longer, i);
        const TriangleMesh smooth = smooth_mesh(body, edge / fine_edges, length);
        if (i == 0) check_crossing(body, smooth, length, int(std::ceil(2 * length * fine_edges / edge)));
        auto made = resolved(body, smooth, triangles, order);
        if (const auto* reason = std::get_if<std::string>(&made)) {
            why = *reason;
            continue;
        }
        RemeshedStart out = std::get<RemeshedStart>(std::move(made));
        const TriangleMesh parts = node_triangles(out.surface);
        out.notes.push_back(fmt::format(
            "{} new triangles instead of {}, smoothed over {:.3g}, {:.2g} of their mean edges: waves of this length "
            "keep half of their height, shorter ones less. The volume is {:.6g} as before.",
            out.surface.triangles(), given.triangles.size(), length, length / edge, body.volume));
        out.notes.push_back(distance_note(given, parts, edge / 2, length));
        return out;
    }
    throw MeshError(
        fmt::format("{}: smoothed over {:.3g}, {}; try shape.remesh = {}{}", body.name, length, why, 2 * triangles,
                    shape.smoothing_length ? fmt::format(", or shape.smoothing_length = {:.3g}", 2 * length) : ""));
}

}  // namespace tubule::surface3d
