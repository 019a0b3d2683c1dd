#include "surface3d/meshing/remesh_sizes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <queue>

#include "surface3d/fem/surface_space.hpp"

namespace tubule::surface3d {
namespace {

constexpr double largest_over_even = 2, most_over_wanted = 4;

// Dijkstra: from the smallest to the largest, none exceeds another by more than growth times the way between them.
void limit_growth(const CurvedMesh& mesh, double growth, Eigen::VectorXd& width) {
    const int n = mesh.nodes_per_cell();
    std::vector<std::vector<std::pair<int, double>>> near(mesh.size());
    for (int cell = 0; cell < mesh.triangles(); ++cell)
        for (int a = 0; a < n; ++a)
            for (int b = 0; b < n; ++b)
                if (a != b)
                    near[mesh.node(cell, a)].emplace_back(
                        mesh.node(cell, b), growth * (mesh.position(cell, a) - mesh.position(cell, b)).norm());
    using Entry = std::pair<double, int>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
    for (int i = 0; i < mesh.size(); ++i) queue.emplace(width[i], i);
    while (!queue.empty()) {
        const auto [w, i] = queue.top();
        queue.pop();
        if (w > width[i]) continue;
        for (const auto& [j, more] : near[i])
            if (w + more < width[j]) queue.emplace(width[j] = w + more, j);
    }
}

Eigen::VectorXd areas(const CurvedMesh& mesh) {
    Eigen::VectorXd area = Eigen::VectorXd::Zero(mesh.triangles());
    for_each_point(mesh, 2 * mesh.order,
                   [&](int cell, const SurfacePoint<double>& p, double weight) { area[cell] += weight * p.area; });
    return area;
}

// How many equilateral triangles have these widths.
double count(const CurvedMesh& mesh, const Eigen::VectorXd& area, const Eigen::VectorXd& width, double largest) {
    const int n = mesh.nodes_per_cell();
    double sum = 0;
    for (int cell = 0; cell < mesh.triangles(); ++cell)
        for (int a = 0; a < n; ++a) sum += area[cell] / n / std::pow(std::min(width[mesh.node(cell, a)], largest), 2);
    return sum * 4 / std::sqrt(3.0);
}

}  // namespace

Eigen::VectorXd functions_at(int order, const Eigen::Vector2d& at) {
    return Tabulation(order, {{at[0], at[1], 0}}).value.col(0);
}

double MeshSizes::at(const CurvedMesh& mesh, const MeshPoint& p) const {
    const int n = mesh.nodes_per_cell();
    const Eigen::VectorXd phi = functions_at(mesh.order, p.at);
    double value = 0, low = HUGE_VAL, high = 0;
    for (int a = 0; a < n; ++a) {
        const double w = width[mesh.node(p.cell, a)];
        value += w * phi[a], low = std::min(low, w), high = std::max(high, w);
    }
    return std::clamp(value, low, high);
}

MeshSizes mesh_sizes(const CurvedMesh& mesh, const Eigen::VectorXd& H, const Eigen::VectorXd& K,
                     const RemeshOptions& options) {
    const Eigen::VectorXd area = areas(mesh);
    const double wanted = options.triangles > 0 ? options.triangles : mesh.triangles();
    const double even = std::sqrt(4 / std::sqrt(3.0) * area.sum() / wanted);
    MeshSizes sizes;
    sizes.width.resize(mesh.size());
    for (int i = 0; i < mesh.size(); ++i)
        sizes.width[i] = std::min({options.angle / largest_curvature(H[i], K[i]), largest_over_even * even,
                                   options.largest.size() > 0 ? options.largest[i] : HUGE_VAL});
    int narrowest;
    const double smallest = sizes.width.minCoeff(&narrowest);
    limit_growth(mesh, options.growth, sizes.width);

    double low = 0, high = largest_over_even * even;
    if (const double needed = count(mesh, area, sizes.width, high); !(needed <= most_over_wanted * wanted)) {
        sizes.lost =
            StopReport{Stop::resolution_lost, 0,
                       fmt::format("a curvature of {:.3g} at {} needs {:.3g} triangles, but {} are allowed",
                                   options.angle / smallest, words_of_place(mesh.nodes[narrowest], 6), needed, wanted),
                       "allow more triangles"};
        return sizes;
    } else if (needed < wanted) {
        for (int i = 0; i < 50; ++i) {
            const double middle = (low + high) / 2;
            (count(mesh, area, sizes.width, middle) > wanted ? low : high) = middle;
        }
    }
    sizes.width = sizes.width.cwiseMin(high);
    sizes.triangles = count(mesh, area, sizes.width, high);
    return sizes;
}

}  // namespace tubule::surface3d
