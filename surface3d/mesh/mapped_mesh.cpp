#include "surface3d/mesh/mapped_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>

#include "common/solve/pause.hpp"

namespace tubule::surface3d {

CurvedMesh flat_mesh(const TriangleMesh& base, int order) {
    if (order < 1 || order > max_order) throw std::invalid_argument("the order of a mesh must be 1, 2, 3 or 4");
    const auto nodes = lattice(order);
    CurvedMesh mesh{.order = order, .nodes = base.points, .cells = {}, .period = base.period, .shifts = {}};
    // Nodes inside an edge: first one and the triangle that made them, by the edge's corners. On a narrow tube two
    // edges can join the same corners, differing in how many periods they cross.
    struct Edge {
        int first, low_shift;
    };
    std::map<std::array<int, 3>, Edge> edges;
    const bool periodic = base.period > 0;

    for (std::size_t t = 0; t < base.triangles.size(); ++t) {
        if (t % 1024 == 0) check_pause();
        const auto& corner = base.triangles[t];
        const auto shift = [&](int c) { return periodic ? base.shifts[t][c] : 0; };
        const auto at = [&](const std::array<int, 3>& n) {
            Eigen::Vector3d x = Eigen::Vector3d::Zero();
            for (int c = 0; c < 3; ++c) x += base.corner(static_cast<int>(t), c) * n[c] / order;
            return x;
        };
        const auto add = [&](int node, int by) {
            mesh.cells.push_back(node);
            if (periodic) mesh.shifts.push_back(by);
        };
        for (int c = 0; c < 3; ++c) add(corner[c], shift(c));
        std::size_t a = 3;
        for (int e = 0; e < 3; ++e) {
            const int from = e, to = (e + 1) % 3;
            const bool forward = corner[from] < corner[to];
            const int low = forward ? from : to, high = forward ? to : from;
            const auto [found, is_new] =
                edges.try_emplace({corner[low], corner[high], shift(high) - shift(low)}, Edge{mesh.size(), shift(low)});
            const Edge& edge = found->second;
            for (int i = 0; i < order - 1; ++i, ++a) {
                // Numbered from the corner of the lower number; made by the first triangle, which sees them unmoved.
                const int rank = forward ? i : order - 2 - i;
                if (is_new) mesh.nodes.resize(edge.first + order - 1);
                if (is_new) mesh.nodes[edge.first + rank] = at(nodes[a]);
                add(edge.first + rank, shift(low) - edge.low_shift);
            }
        }
        for (; a < nodes.size(); ++a) {
            add(mesh.size(), 0);
            mesh.nodes.push_back(at(nodes[a]));
        }
    }
    return mesh;
}

TriangleMesh corner_triangles(const CurvedMesh& mesh) {
    TriangleMesh corners{.points = {}, .triangles = {}, .period = mesh.period, .shifts = {}};
    std::vector<int> number(mesh.size(), -1);
    for (int cell = 0; cell < mesh.triangles(); ++cell) {
        std::array<int, 3> triangle, shifts;
        for (int c = 0; c < 3; ++c) {
            const int node = mesh.node(cell, c);
            if (number[node] < 0) {
                number[node] = static_cast<int>(corners.points.size());
                corners.points.push_back(mesh.nodes[node]);
            }
            triangle[c] = number[node];
            shifts[c] = mesh.period > 0 ? mesh.shifts[cell * mesh.nodes_per_cell() + c] : 0;
        }
        corners.triangles.push_back(triangle);
        if (mesh.period > 0) corners.shifts.push_back(shifts);
    }
    return corners;
}

namespace {

// The triangles between neighbouring nodes of a cell, counter-clockwise.
std::vector<std::array<int, 3>> lattice_triangles(int order) {
    const auto nodes = lattice(order);
    const auto at = [&](int j, int l) {
        return static_cast<int>(std::find(nodes.begin(), nodes.end(), std::array<int, 3>{order - j - l, j, l}) -
                                nodes.begin());
    };
    std::vector<std::array<int, 3>> out;
    for (int j = 0; j < order; ++j)
        for (int l = 0; j + l < order; ++l) {
            out.push_back({at(j, l), at(j + 1, l), at(j, l + 1)});
            if (j + l + 1 < order) out.push_back({at(j + 1, l), at(j + 1, l + 1), at(j, l + 1)});
        }
    return out;
}

}  // namespace

TriangleMesh node_triangles(const CurvedMesh& mesh, int images) {
    TriangleMesh flat;
    std::map<std::array<int, 2>, int> number;  // of a node, in the period where a cell sees it
    const auto small = lattice_triangles(mesh.order);
    for (int image = 0; image < images; ++image)
        for (int cell = 0; cell < mesh.triangles(); ++cell)
            for (const auto& corners : small) {
                std::array<int, 3> triangle;
                for (int c = 0; c < 3; ++c) {
                    const int seen = mesh.period > 0 ? mesh.shifts[cell * mesh.nodes_per_cell() + corners[c]] : 0;
                    const auto [found, is_new] = number.try_emplace({mesh.node(cell, corners[c]), seen + image},
                                                                    static_cast<int>(flat.points.size()));
                    const Eigen::Vector3d up = image * mesh.period * Eigen::Vector3d::UnitZ();
                    if (is_new) flat.points.push_back(mesh.position(cell, corners[c]) + up);
                    triangle[c] = found->second;
                }
                flat.triangles.push_back(triangle);
            }
    return flat;
}

Tabulation at_nodes(int order, int of_order) {
    std::vector<QuadraturePoint> points;
    for (const auto& [i, j, l] : lattice(of_order))
        points.push_back({static_cast<double>(j) / of_order, static_cast<double>(l) / of_order, 0});
    return Tabulation(order, points);
}

CurvedMesh with_order(const CurvedMesh& mesh, int order) {
    CurvedMesh out = flat_mesh(corner_triangles(mesh), order);
    const Tabulation table = at_nodes(mesh.order, order);
    for (int cell = 0; cell < out.triangles(); ++cell) {
        if (cell % 1024 == 0) check_pause();
        Eigen::Matrix3Xd X(3, mesh.nodes_per_cell());
        for (int a = 0; a < mesh.nodes_per_cell(); ++a) X.col(a) = mesh.position(cell, a);
        for (int a = 0; a < out.nodes_per_cell(); ++a) {
            Eigen::Vector3d x = X * table.value.col(a);
            if (out.period > 0) x.z() -= out.period * out.shifts[cell * out.nodes_per_cell() + a];
            out.nodes[out.node(cell, a)] = x;
        }
    }
    return out;
}

}  // namespace tubule::surface3d
