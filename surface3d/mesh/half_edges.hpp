// A triangulation that can be modified locally: edges flipped, split, collapsed.
#pragma once

#include <vector>

#include "surface3d/mesh/triangle_mesh.hpp"

namespace tubule::surface3d {

// Plain data. Half-edge h = 3 t + c runs from corner c of triangle t to the next one. Removed items stay in place
// with -1 as its origin, or as the half-edge that leaves it, until `triangles` leaves it out.
struct HalfEdges {
    std::vector<Eigen::Vector3d> points;
    std::vector<int> leaving;  // of each vertex: a half-edge from it
    std::vector<int> origin, twin;
    std::vector<int> shift;  // by how many periods the triangle sees the origin moved
    double period = 0;

    // Throws std::invalid_argument if the triangles do not close or a vertex has itself or another vertex twice as its
    // neighbour, as on a tube of fewer than three rings.
    explicit HalfEdges(const TriangleMesh& mesh);

    // Half-edges of the same triangle, counter-clockwise and clockwise.
    static int next(int h) { return h % 3 == 2 ? h - 2 : h + 1; }
    static int previous(int h) { return h % 3 == 0 ? h + 2 : h - 1; }
    // The number of half-edges, removed ones included.
    int size() const { return static_cast<int>(origin.size()); }
    bool exists(int h) const { return origin[h] >= 0; }
    int target(int h) const { return origin[next(h)]; }

    // The origin and the vector of a half-edge, as its triangle sees them.
    Eigen::Vector3d position(int h) const { return points[origin[h]] + shift[h] * period * Eigen::Vector3d::UnitZ(); }
    Eigen::Vector3d vector(int h) const { return position(next(h)) - position(h); }

    // Calls visit(h) for the half-edges that leave a vertex, around it.
    template <class Visit>
    void around(int vertex, Visit&& visit) const {
        const int first = leaving[vertex];
        int h = first;
        do {
            const int following = twin[previous(h)];
            visit(h);
            h = following;
        } while (h != first);
    }
    int valence(int vertex) const;
    bool adjacent(int a, int b) const;
    int live_triangles() const;

    // Whether the change leaves a closed surface on which no two vertices are joined twice and none has less than
    // three neighbours.
    bool can_flip(int h) const;
    bool can_collapse(int h) const;

    // Turns the edge within the two triangles beside it; h is then one half of the new edge.
    void flip(int h);
    // Divides it, and the triangles beside it, by a new vertex at x, as the triangle of h sees it.
    int split(int h, const Eigen::Vector3d& x);
    // Removes its origin; the target takes over the triangles around it.
    void collapse(int h);

    TriangleMesh triangles() const;

private:
    void join(int h, int other);
    void set(int h, int vertex, int by);
};

}  // namespace tubule::surface3d
