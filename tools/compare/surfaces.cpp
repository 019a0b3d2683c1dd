#include "tools/compare/surfaces.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <stdexcept>
#include <string>

#include "surface3d/mesh/reference_triangle.hpp"

namespace tubule::compare {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// As for triangles; of the chord.
constexpr double flat_enough = 0.05;
constexpr int deepest = 8;
// The error of a chord is |X''| (to - from)^2 / 8; the second derivative is sampled at a few points, hence the factor.
constexpr int looks = 4;
constexpr double between_looks = 1.5;

constexpr int gauss = 4;                   // points a panel
constexpr double panel_of_grain = 0.5;     // length of a panel
constexpr double spacing_of_grain = 0.25;  // of points around the axis
constexpr int fewest_around = 8, most_around = 720;
constexpr double golden = 2.399963229728653;  // angle by which rings are turned: no two are aligned

}  // namespace

struct RevolutionSurface::Nearest {
    double square = std::numeric_limits<double>::infinity(), s = 0;
    Vector2d from;  // the query point, as the periodic image sees it
};

RevolutionSurface::RevolutionSurface(PerturbedCurve curve) : curve_(std::move(curve)) {
    std::vector<double> breaks;
    for (const double x : curve_.functions.x)
        breaks.push_back(curve_.is_cell() ? std::acos(std::clamp(-x, -1.0, 1.0)) / pi : x);
    breaks.front() = 0, breaks.back() = 1;
    std::vector<surface3d::BoxTree<2>::Box> boxes;
    for (std::size_t i = 0; i + 1 < breaks.size(); ++i) add_part(breaks[i], breaks[i + 1], 0, boxes);
    breaks_.push_back(1);
    tree_ = surface3d::BoxTree<2>(std::move(boxes));
}

CurveSample RevolutionSurface::evaluate(double s) const {
    const auto [r, z] = profile_at(curve_, Jet<double, 1, 2>::variable(s, 0));
    return {r.v, r.d[0], r.dd[0], z.v, z.d[0], z.dd[0]};
}

void RevolutionSurface::add_part(double from, double to, int depth, std::vector<surface3d::BoxTree<2>::Box>& boxes) {
    double second = 0;
    for (int i = 0; i <= looks; ++i) second = std::max(second, evaluate(from + (to - from) * i / looks).dd().norm());
    const double bulge = between_looks * second * (to - from) * (to - from) / 8;
    const Vector2d a = evaluate(from).x(), b = evaluate(to).x();
    if (bulge > flat_enough * (b - a).norm() && depth < deepest) {
        add_part(from, (from + to) / 2, depth + 1, boxes);
        add_part((from + to) / 2, to, depth + 1, boxes);
        return;
    }
    breaks_.push_back(from), bulge_.push_back(bulge);
    surface3d::BoxTree<2>::Box box(a.cwiseMin(b) - Vector2d::Constant(bulge),
                                   a.cwiseMax(b) + Vector2d::Constant(bulge));
    boxes.push_back(box);
}

Foot RevolutionSurface::foot(const Vector3d& x) const {
    const double rho = std::hypot(x[0], x[1]);
    const double cosine = rho > 0 ? x[0] / rho : 1, sine = rho > 0 ? x[1] / rho : 0;
    Nearest nearest;
    tree_.nearest(Vector2d(rho, x[2]), period(), nearest.square, [&](std::size_t part, const Vector2d& image) {
        const double from = breaks_[part], to = breaks_[part + 1];
        const Vector2d a = evaluate(from).x(), b = evaluate(to).x(), chord = b - a;
        const double t = std::clamp(chord.dot(image - a) / chord.squaredNorm(), 0.0, 1.0);
        const double away = (a + t * chord - image).norm() - bulge_[part];
        if (away > 0 && away * away >= nearest.square) return;
        look_at(from, to, image, nearest);
    });
    const CurveSample p = evaluate(nearest.s);
    const Vector2d normal = Vector2d(p.d()[1], -p.d()[0]).normalized();
    Foot foot;
    foot.point = Vector3d(p.x()[0] * cosine, p.x()[0] * sine, p.x()[1] + (x[2] - nearest.from[1]));
    foot.normal = Vector3d(normal[0] * cosine, normal[0] * sine, normal[1]);
    foot.distance = std::sqrt(nearest.square);
    return foot;
}

void RevolutionSurface::look_at(double from, double to, const Vector2d& x, Nearest& nearest) const {
    constexpr int most = 15;
    const double done = 1e-9 * (to - from);
    const Vector2d a = evaluate(from).x(), chord = evaluate(to).x() - a;
    double s = from + (to - from) * std::clamp(chord.dot(x - a) / chord.squaredNorm(), 0.0, 1.0), last = 1;
    for (int i = 0; i < most && last > 0; ++i) {
        const CurveSample p = evaluate(s);
        const Vector2d away = p.x() - x;
        if (away.squaredNorm() < nearest.square) nearest.square = away.squaredNorm(), nearest.s = s, nearest.from = x;
        if (last < done) return;
        const double square = p.d().squaredNorm(), curved = square + p.dd().dot(away);
        const double next = std::clamp(s - p.d().dot(away) / (curved > 1e-3 * square ? curved : square), from, to);
        last = std::abs(next - s);
        s = next;
    }
}

Vector3d RevolutionSurface::at(const Place& place) const {
    const Vector2d x = evaluate(place.at[0]).x();
    return {x[0] * std::cos(place.at[1]), x[0] * std::sin(place.at[1]), x[1]};
}

void RevolutionSurface::confine(Place& place) const {
    place.at[0] = std::clamp(place.at[0], 0.0, 1.0);
}

// Parameters at which panels end: those of parts, leaving out some if they are shorter than `width`.
std::vector<double> RevolutionSurface::panels(double width) const {
    std::vector<double> out{0};
    double length = 0;
    for (std::size_t i = 0; i + 1 < breaks_.size(); ++i) {
        length += (evaluate(breaks_[i + 1]).x() - evaluate(breaks_[i]).x()).norm();
        if (length < width && i + 2 < breaks_.size()) continue;
        out.push_back(breaks_[i + 1]);
        length = 0;
    }
    return out;
}

std::vector<Sample> RevolutionSurface::samples(double grain) const {
    const auto rule = surface3d::gauss_points(gauss);
    std::vector<Sample> out;
    const auto add_ring = [&](double s, double reach, double weight, double turn) {
        const CurveSample p = evaluate(s);
        const double around = grain > 0 ? std::ceil(2 * pi * p.x()[0] / (spacing_of_grain * grain)) : 1;
        const int count = grain > 0 ? static_cast<int>(std::clamp<double>(around, fewest_around, most_around)) : 1;
        const double area = weight * 2 * pi * p.x()[0] * p.d().norm() / count;
        for (int i = 0; i < count; ++i) {
            const Place place{0, {s, grain > 0 ? turn + 2 * pi * i / count : 0}};
            out.push_back({place, {reach, grain > 0 ? pi / count : 0}, at(place), area});
        }
    };
    const std::vector<double> ends = panels(panel_of_grain * grain);
    for (std::size_t i = 0; i + 1 < ends.size(); ++i) {
        const double from = ends[i], width = ends[i + 1] - from;
        for (const auto& [t, weight] : rule)
            add_ring(from + t * width, width / gauss, weight * width, golden * out.size());
        add_ring(from, width / gauss, 0, golden * i);
    }
    add_ring(1, (1 - ends[ends.size() - 2]) / gauss, 0, 0);
    return out;
}

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
