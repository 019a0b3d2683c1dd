// Base triangulations: spheres, tori, tubes and other surfaces of revolution, structured or not.
#pragma once

#include <vector>

#include "common/shapes/torus.hpp"
#include "surface3d/mesh/triangle_mesh.hpp"

namespace tubule::surface3d {

// The unit sphere: an icosahedron with every edge divided into n parts, 20 n^2 triangles.
TriangleMesh icosphere(int n);

// n_axis quadrangles around the axis times n_tube around the tube, each cut in two along alternating diagonals; both
// even.
TriangleMesh torus_grid(const Torus& torus, int n_axis, int n_tube);

// Points on a circle around the z axis: evenly spaced, beginning `phase` spacings after theta = 0. A pole is a ring of
// one point.
struct Ring {
    double r = 1, z = 0;
    int count = 1;
    double phase = 0;
};

// The surface through rings of ascending order along the profile (outward is to the right of its direction seen with r
// to the right and z upwards), closed by poles at both ends, or continued by the first ring moved up by `period`.
TriangleMesh ring_mesh(const std::vector<Ring>& rings, double period = 0);

// A tube of n_z (even) rings of n_theta points, every other ring turned by half a spacing.
TriangleMesh tube_rings(double radius, double length, int n_z, int n_theta);

// Irregular neighbours: every point is moved along the surface by up to `amount` of its shortest edge, at random but
// the same for the same seed, and edges are flipped until no two angles opposite to an edge exceed pi together
// (Delaunay).
TriangleMesh jittered(TriangleMesh mesh, double amount, unsigned seed);

}  // namespace tubule::surface3d
