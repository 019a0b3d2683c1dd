#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <set>

#include "surface3d/curvature.hpp"
#include "surface3d/projection.hpp"

namespace tubule::surface3d {
namespace {

constexpr int max_degree = 2 * max_order;

int coefficients(int degree) {
    return (degree + 1) * (degree + 2) / 2;
}

// x^0 ... x^degree and the first two derivatives.
struct Powers {
    double v[max_degree + 1], d[max_degree + 1], dd[max_degree + 1];

    Powers(double x, int degree) {
        v[0] = 1, d[0] = 0, dd[0] = 0;
        for (int i = 1; i <= degree; ++i) {
            v[i] = v[i - 1] * x;
            d[i] = i * v[i - 1];
            dd[i] = i * d[i - 1];
        }
    }
};

// Normal, B, H and K of a point as one column, and nodal columns as fields.
using Column11 = Eigen::Matrix<double, 11, 1>;
using Columns11 = Eigen::Matrix<double, 11, Eigen::Dynamic>;

Column11 column_of(const SurfacePoint<double>& p) {
    Column11 out;
    out.head<3>() = p.normal;
    out.segment<6>(3) = packed_tensor(p.B);
    out[9] = p.H, out[10] = p.K;
    return out;
}

CurvatureField field_of(const Columns11& values) {
    return {values.topRows<3>().colwise().normalized(), values.middleRows<6>(3), values.row(9).transpose(),
            values.row(10).transpose()};
}

}  // namespace

// height(x, y) over the plane through `origin` spanned by e1, e2, in units of `scale`.
struct PatchRecovery::Graph {
    Eigen::Vector3d origin, e1, e2, normal;
    double scale = 1;
    Eigen::Matrix<double, (max_degree + 1) * (max_degree + 2) / 2, 1> coefficient;

    SurfacePoint<double> at(const Eigen::Vector3d& position, int degree) const {
        const Eigen::Vector3d d = (position - origin) / scale;
        const Powers x(d.dot(e1), degree), y(d.dot(e2), degree);
        double h = 0, hx = 0, hy = 0, hxx = 0, hxy = 0, hyy = 0;
        for (int i = 0, n = 0; i <= degree; ++i)
            for (int j = 0; i + j <= degree; ++j, ++n) {
                const double c = coefficient[n];
                h += c * x.v[i] * y.v[j];
                hx += c * x.d[i] * y.v[j];
                hy += c * x.v[i] * y.d[j];
                hxx += c * x.dd[i] * y.v[j];
                hxy += c * x.d[i] * y.d[j];
                hyy += c * x.v[i] * y.dd[j];
            }
        SurfacePoint<double> p;
        const Eigen::Vector3d X = origin + scale * (x.v[1] * e1 + y.v[1] * e2 + h * normal);
        set_tangents<double>(p, X, e1 + hx * normal, e2 + hy * normal);
        set_curvature<double>(p, normal * (hxx / scale), normal * (hxy / scale), normal * (hyy / scale));
        return p;
    }
};

PatchRecovery::PatchRecovery(const CurvedMesh& mesh)
    : degree_(2 * mesh.order),
      corner_table_(mesh.order, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}),
      patch_of_(mesh.size(), -1),
      shares_(mesh.size()) {
    const int width = mesh.nodes_per_cell();
    for (int cell = 0; cell < mesh.triangles(); ++cell)
        for (int c = 0; c < 3; ++c) {
            int& patch = patch_of_[mesh.node(cell, c)];
            if (patch < 0) {
                patch = static_cast<int>(patches_.size());
                patches_.push_back({mesh.node(cell, c), {}, {}});
            }
            patches_[patch].corners.push_back({cell, c});
        }

    // Nodes of the triangles around, then of those around their corners, until there are more than coefficients.
    for (Patch& patch : patches_) {
        std::set<std::array<int, 2>> cells, members;  // (cell, shift), (node, shift)
        std::vector<std::array<int, 2>> front{{patch.vertex, 0}};
        while (static_cast<int>(members.size()) <= coefficients(degree_) && !front.empty()) {
            std::vector<std::array<int, 2>> next;
            for (const auto& [vertex, vertex_shift] : front)
                for (const auto& [cell, c] : patches_[patch_of_[vertex]].corners) {
                    const int cell_shift = vertex_shift - shift(mesh, cell, c);
                    if (!cells.insert({cell, cell_shift}).second) continue;
                    for (int a = 0; a < width; ++a) {
                        const std::array<int, 2> member{mesh.node(cell, a), cell_shift + shift(mesh, cell, a)};
                        if (members.insert(member).second && a < 3) next.push_back(member);
                    }
                }
            front = next;
        }
        for (const auto& [node, by] : members) patch.members.push_back({node, by});
    }

    const auto nodes = lattice(mesh.order);
    for (int cell = 0; cell < mesh.triangles(); ++cell)
        for (int a = 0; a < width; ++a) {
            auto& shares = shares_[mesh.node(cell, a)];
            if (!shares.empty()) continue;
            for (int c = 0; c < 3; ++c)
                if (nodes[a][c] > 0)
                    shares.push_back({patch_of_[mesh.node(cell, c)], shift(mesh, cell, a) - shift(mesh, cell, c),
                                      static_cast<double>(nodes[a][c]) / mesh.order});
        }
}

std::vector<PatchRecovery::Graph> PatchRecovery::fit(const CurvedMesh& mesh) const {
    const int n_patches = static_cast<int>(patches_.size());
    std::vector<Graph> graphs(n_patches);
#pragma omp parallel
    {
        Eigen::MatrixXd rows;
        Eigen::VectorXd heights;
        Eigen::ColPivHouseholderQR<Eigen::MatrixXd> factors;
#pragma omp for schedule(static)
        for (int i = 0; i < n_patches; ++i) {
            const Patch& patch = patches_[i];
            Graph& graph = graphs[i];
            graph.origin = mesh.nodes[patch.vertex];
            graph.normal.setZero();
            for (const auto& [cell, c] : patch.corners)
                graph.normal += tangent_point(cell_nodes(mesh, cell), corner_table_, c).normal;
            graph.normal.normalize();
            graph.e1 = graph.normal.unitOrthogonal();
            graph.e2 = graph.normal.cross(graph.e1);

            const int n = static_cast<int>(patch.members.size());
            const auto offset = [&](int r) {
                const Member& m = patch.members[r];
                return Eigen::Vector3d(mesh.nodes[m.node] + m.shift * mesh.period * Eigen::Vector3d::UnitZ() -
                                       graph.origin);
            };
            graph.scale = 0;
            for (int r = 0; r < n; ++r) graph.scale = std::max(graph.scale, offset(r).norm());
            rows.resize(n, coefficients(degree_));
            heights.resize(n);
            for (int r = 0; r < n; ++r) {
                const Eigen::Vector3d d = offset(r) / graph.scale;
                const Powers x(d.dot(graph.e1), degree_), y(d.dot(graph.e2), degree_);
                for (int ex = 0, column = 0; ex <= degree_; ++ex)
                    for (int ey = 0; ex + ey <= degree_; ++ey, ++column) rows(r, column) = x.v[ex] * y.v[ey];
                heights[r] = d.dot(graph.normal);
            }
            graph.coefficient.head(rows.cols()) = factors.compute(rows).solve(heights);
        }
    }
    return graphs;
}

CurvatureField PatchRecovery::nodal(const CurvedMesh& mesh) const {
    const std::vector<Graph> graphs = fit(mesh);
    Columns11 values(11, mesh.size());
#pragma omp parallel for schedule(static)
    for (int node = 0; node < mesh.size(); ++node) {
        Column11 mean = Column11::Zero();
        for (const auto& [patch, by, weight] : shares_[node]) {
            const Eigen::Vector3d x = mesh.nodes[node] + by * mesh.period * Eigen::Vector3d::UnitZ();
            mean += weight * column_of(graphs[patch].at(x, degree_));
        }
        values.col(node) = mean;
    }
    return field_of(values);
}

CurvatureField PatchRecovery::projected(const SurfaceSpace& space, const CurvedMesh& mesh) const {
    const std::vector<Graph> graphs = fit(mesh);
    const Tabulation& table = space.tabulation();
    const Projection project(space, mesh);
    return field_of(project(load<11>(space, mesh, [&](int cell, const CellColumns<3>& X, int q, CellColumns<11>& out) {
        const SurfacePoint<double> p = tangent_point(X, table, q);
        const Eigen::Vector2d at = table.point.col(q);
        const double weight[3] = {1 - at[0] - at[1], at[0], at[1]};
        Column11 mean = Column11::Zero();
        for (int c = 0; c < 3; ++c) {
            const Eigen::Vector3d x = p.x - shift(mesh, cell, c) * mesh.period * Eigen::Vector3d::UnitZ();
            mean += weight[c] * column_of(graphs[patch_of_[mesh.node(cell, c)]].at(x, degree_));
        }
        out.noalias() += (table.weight[q] * p.area * mean) * table.value.col(q).transpose();
    })));
}

}  // namespace tubule::surface3d
