// A surface of curved triangles: isoparametric Lagrange elements P_k, on a closed surface of any genus or on a tube
// that is periodic in z.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace tubule::surface3d {

// Plain data. The nodes of a cell are in VTK's order of Lagrange triangles: the vertices, counter-clockwise seen from
// outside; the nodes inside the edges v0v1, v1v2, v2v0, each running along its edge; the interior (k = 3: the centre;
// k = 4: three, the one nearest to v0 first, then v1, v2).
struct CurvedMesh {
    int order = 2;  // k: 2, 3 or 4
    std::vector<Eigen::Vector3d> nodes;
    std::vector<int> cells;  // node numbers, nodes_per_cell() for each triangle

    // Tubes: the length of a period in z, and for every entry of `cells` the number of periods by which the node is
    // moved as this cell sees it. 0 and empty on a closed surface.
    double period = 0;
    std::vector<int> shifts;

    int nodes_per_cell() const { return (order + 1) * (order + 2) / 2; }
    int size() const { return static_cast<int>(nodes.size()); }
    int triangles() const { return static_cast<int>(cells.size()) / nodes_per_cell(); }

    // Number and position of node `a` of a cell.
    int node(int cell, int a) const { return cells[cell * nodes_per_cell() + a]; }
    Eigen::Vector3d position(int cell, int a) const {
        const int i = cell * nodes_per_cell() + a;
        Eigen::Vector3d x = nodes[cells[i]];
        if (period > 0) x.z() += period * shifts[i];
        return x;
    }
};

}  // namespace tubule::surface3d
