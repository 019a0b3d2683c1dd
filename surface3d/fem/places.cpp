#include "surface3d/fem/places.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "common/geometry/jet.hpp"
#include "common/solve/dense.hpp"

namespace tubule::surface3d {
namespace {

template <class OfPoint>
double sum_over(const SurfaceSpace& space, const CurvedMesh& mesh, const OfPoint& of_point) {
    const Tabulation& table = space.tabulation();
    Eigen::VectorXd of_cell(space.cells());  // so that the sum does not depend on the number of threads
    space.for_each_cell([&](int cell) {
        const CellColumns<3> X = cell_nodes(mesh, cell);
        double sum = 0;
        for (int q = 0; q < table.points(); ++q) {
            const SurfacePoint<double> p = tangent_point(X, table, q);
            sum += table.weight[q] * p.area * of_point(cell, q, p);
        }
        of_cell[cell] = sum;
    });
    return of_cell.sum();
}

// W and its slope.
std::array<double, 4> value_and_slope(const Formula& W, const Eigen::Vector3d& x, double P) {
    using J = Jet<double, 3, 1>;
    const J place[]{J::variable(x[0], 0), J::variable(x[1], 1), J::variable(x[2], 2), J(P)}, w = evaluate(W, place);
    return {w.v, w.d[0], w.d[1], w.d[2]};
}

// Widths of a bead, ranges of a wall; new meshes are fine where the surface may get there soon.
constexpr double near = 2, soon_near = 4;

double distance_from_beads(const Eigen::Vector3d& x, const BeadNumbers& at) {
    return std::min((x + at[0] * Eigen::Vector3d::UnitZ()).norm(), (x - at[2] * Eigen::Vector3d::UnitZ()).norm());
}

// The shortest range of walls near this place, infinite where none is near.
double wall_range_at(const Eigen::Vector3d& x, std::span<const Potential> potentials, double near) {
    double shortest = HUGE_VAL;
    for (const Potential& p : potentials)
        if (p.is_wall() && p.distance(x.head<2>().norm(), x.z()) < near * p.range)
            shortest = std::min(shortest, p.range);
    return shortest;
}

// The longest edge of each cell over the order and `size_at(cell, longest)`, infinite where nothing is near.
template <class SizeAt>
Coarseness coarsest_of(const CurvedMesh& mesh, const SizeAt& size_at) {
    Coarseness out;
    for (int cell = 0; cell < mesh.triangles(); ++cell) {
        double longest = 0;
        for (int c = 0; c < 3; ++c)
            longest = std::max(longest, (mesh.position(cell, (c + 1) % 3) - mesh.position(cell, c)).norm());
        if (const double here = longest / (size_at(cell, longest) * mesh.order); here > out.value)
            out = {here, mesh.position(cell, 0)};
    }
    return out;
}

}  // namespace

PointPotential::PointPotential(const Formula& W, const Eigen::Vector3d& x, double P) {
    using J = Jet<double, 3, 2>;
    const J place[]{J::variable(x[0], 0), J::variable(x[1], 1), J::variable(x[2], 2), J(P)}, w = evaluate(W, place);
    value = w.v;
    for (int i = 0; i < 3; ++i) {
        slope[i] = w.d[i];
        for (int j = 0; j < 3; ++j) second(i, j) = w.dd[packed<3>(i, j)];
    }
}

double place_integral(const SurfaceSpace& space, const CurvedMesh& mesh, const Formula& W, double P) {
    return sum_over(space, mesh, [&](int, int, const SurfacePoint<double>& p) {
        const double place[]{p.x[0], p.x[1], p.x[2], P};
        return evaluate(W, place);
    });
}

double place_rate(const SurfaceSpace& space, const CurvedMesh& mesh, const Formula& W, double P, const VectorField& v) {
    const Tabulation& table = space.tabulation();
    return sum_over(space, mesh, [&](int cell, int q, const SurfacePoint<double>& p) {
        const CellColumns<3> V = space.gather(v, cell);
        const auto [value, x, y, z] = value_and_slope(W, p.x, P);
        return Eigen::Vector3d(x, y, z).dot(V * table.value.col(q)) +
               value * gradients(p, table, q).cwiseProduct(V).sum();
    });
}

std::array<double, 2> poles(const CurvedMesh& mesh) {
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (const Eigen::Vector3d& x : mesh.nodes) low = std::min(low, x.z()), high = std::max(high, x.z());
    return {-low, high};
}

BeadNumbers bead_numbers(const SurfaceSpace& space, const CurvedMesh& mesh, const BeadEquations& beads, double force) {
    // Newton's method takes many integrals of weights that reach a few of the points.
    const Tabulation& table = space.tabulation();
    std::vector<Eigen::Vector4d> points;  // place and area
    points.reserve(static_cast<std::size_t>(space.cells()) * table.points());
    for (int cell = 0; cell < space.cells(); ++cell) {
        const CellColumns<3> X = cell_nodes(mesh, cell);
        for (int q = 0; q < table.points(); ++q) {
            const SurfacePoint<double> p = tangent_point(X, table, q);
            points.emplace_back(p.x[0], p.x[1], p.x[2], table.weight[q] * p.area);
        }
    }
    const auto integral = [&](const Formula& W, double P) {
        double sum = 0;
        for (const Eigen::Vector4d& x : points) {
            if (!is_in_reach(x.head<3>(), P, beads.width()) && !is_in_reach(x.head<3>(), -P, beads.width())) continue;
            const double place[]{x[0], x[1], x[2], P};
            sum += x[3] * evaluate(W, place);
        }
        return sum;
    };
    return beads.numbers({integral, {}}, poles(mesh), force);
}

double bead_distance(const CurvedMesh& mesh, double width) {
    return BeadEquations::distance(
        bead_numbers(SurfaceSpace(mesh), mesh, BeadEquations(width, BeadEquations::in_space), 0));
}

Coarseness bead_coarseness(const CurvedMesh& mesh, const BeadNumbers& at, double width) {
    constexpr double holds = 0.6;  // a triangle around a pole has a corner within this part of its longest side
    return coarsest_of(mesh, [&](int cell, double longest) {
        double distance = HUGE_VAL;
        for (int c = 0; c < 3; ++c) distance = std::min(distance, distance_from_beads(mesh.position(cell, c), at));
        return distance < std::max(near * width, holds * longest) ? width : HUGE_VAL;
    });
}

Coarseness wall_coarseness(const CurvedMesh& mesh, std::span<const Potential> potentials) {
    if (potentials.empty()) return {};
    return coarsest_of(mesh, [&](int cell, double) {
        double shortest = HUGE_VAL;
        for (int a = 0; a < mesh.nodes_per_cell(); ++a)
            shortest = std::min(shortest, wall_range_at(mesh.position(cell, a), potentials, near));
        return shortest;
    });
}

Coarseness coarseness(const CurvedMesh& mesh, const Eigen::VectorXd& scale) {
    return coarsest_of(mesh, [&](int cell, double) {
        double shortest = HUGE_VAL;
        for (int a = 0; a < mesh.nodes_per_cell(); ++a) shortest = std::min(shortest, scale[mesh.node(cell, a)]);
        return shortest;
    });
}

int triangles_for_places(std::span<const Potential> potentials, const std::optional<Beads>& beads, double area) {
    double shortest = beads ? beads->width : HUGE_VAL;
    for (const Potential& p : potentials)
        if (p.is_wall()) shortest = std::min(shortest, p.range);
    return static_cast<int>(std::min(area / (std::sqrt(3.0) * shortest * shortest), 1e6));
}

Eigen::VectorXd largest_edges(const CurvedMesh& mesh, std::span<const Potential> potentials,
                              const std::optional<Beads>& beads, const BeadNumbers& at) {
    constexpr double of_coarsest = 0.5;  // so that the longest edge of a new mesh is below it, and that mesh lasts
    Eigen::VectorXd out(mesh.size());
    for (int i = 0; i < mesh.size(); ++i) {
        double size = wall_range_at(mesh.nodes[i], potentials, soon_near);
        if (beads && distance_from_beads(mesh.nodes[i], at) < soon_near * beads->width)
            size = std::min(size, beads->width);
        out[i] = of_coarsest * coarsest_place * mesh.order * size;
    }
    return out;
}

WallDistance wall_distance(const CurvedMesh& mesh, std::span<const Potential> potentials) {
    WallDistance out;
    for (const Potential& p : potentials)
        for (const Eigen::Vector3d& x : mesh.nodes) {
            if (!p.is_wall()) continue;
            const double distance = p.distance(x.head<2>().norm(), x.z());
            if (!(distance >= out.value)) out = {distance, x};
        }
    return out;
}

Eigen::MatrixXd unmoved_by(const Formula& W, const CurvedMesh& mesh, const Eigen::Vector3d& centre, double size) {
    constexpr double nothing = 1e-10;  // of the mean square of the slope
    constexpr int all = 6;
    Eigen::MatrixXd changes(mesh.size(), all);
    const std::vector<int> possible =
        mesh.period > 0 ? std::vector<int>{0, 1, 2, 5} : std::vector<int>{0, 1, 2, 3, 4, 5};
    double slopes = 0;
    for (int i = 0; i < mesh.size(); ++i) {
        const auto [value, x, y, z] = value_and_slope(W, mesh.nodes[i], 0);
        const Eigen::Vector3d slope(x, y, z), from = (mesh.nodes[i] - centre) / size;
        changes.row(i) << slope.transpose(), from.cross(slope).transpose();
        slopes += slope.squaredNorm();
    }
    const Eigen::MatrixXd of_possible = changes(Eigen::all, possible);
    const Eigenpairs gram = eigenpairs(of_possible.transpose() * of_possible, true);
    Eigen::Index n = 0;
    while (n < gram.values.size() && gram.values[n] <= nothing * slopes) ++n;
    Eigen::MatrixXd out = Eigen::MatrixXd::Zero(all, n);
    out(possible, Eigen::all) = gram.vectors.leftCols(n);
    return out;
}

Eigen::MatrixXd free_motions(const CurvedMesh& mesh, const std::vector<Potential>& potentials, bool with_beads,
                             const Eigen::Vector3d& centre, double size) {
    constexpr int all = 6, across = 2;
    Eigen::MatrixXd out = Eigen::MatrixXd::Identity(all, all);
    if (mesh.period > 0) out = out(Eigen::all, std::array{0, 1, 2, 5}).eval();
    if (const auto W = potential_density_in_space(potentials)) out = unmoved_by(*W, mesh, centre, size);
    if (!with_beads) return out;
    // Those that are combinations of what the potentials leave.
    Eigen::MatrixXd of_axis = Eigen::MatrixXd::Zero(all, 2), left(all, 0);
    of_axis(2, 0) = of_axis(5, 1) = 1;
    of_axis.col(1).head(across) << -centre.y() / size, centre.x() / size;
    for (const auto& motion : of_axis.colwise()) {
        if (out.cols() == 0 || (out * least_squares(out, motion) - motion).norm() > 1e-6) continue;
        left.conservativeResize(Eigen::NoChange, left.cols() + 1);
        left.rightCols(1) = motion;
    }
    return left;
}

}  // namespace tubule::surface3d
