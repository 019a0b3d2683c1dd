// How far triangle meshes are from each other.
#pragma once

#include <vector>

#include "surface3d/mesh/box_tree.hpp"
#include "surface3d/mesh/triangle_mesh.hpp"

namespace tubule::surface3d {

// The distance of a point from the triangles of a mesh, some of which may be segments or points; infinite from none.
class MeshDistance {
public:
    explicit MeshDistance(const TriangleMesh& mesh);  // which must live on
    double operator()(const Eigen::Vector3d& x) const;

private:
    const TriangleMesh& mesh_;
    BoxTree<3> tree_;
};

struct DistanceSample {
    Eigen::Vector3d at;
    double area, distance;
};

// From the corners of the triangles of `from`, and the centres of parts of them that are no longer than `grain`, to
// `to`. Each sample stands for a part of the area.
std::vector<DistanceSample> distances(const TriangleMesh& from, const TriangleMesh& to, double grain);

}  // namespace tubule::surface3d
