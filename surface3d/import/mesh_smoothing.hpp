// Smoothing of closed triangle meshes over a stated length, and what it should keep.
#pragma once

#include "surface3d/mesh/triangle_mesh.hpp"

namespace tubule::surface3d {

// Waves of the wavelength `halved` keep half of their height, those of twice that length 94 percent, of half that
// length 6 percent: 1/(1 + (halved/w)^4). Spheres and cylinders stay as they are; creases are rounded.
//
// It is the normals that are smoothed, not the positions: smoothed positions move everything bent inward, and a tube
// whose circumference is near the length collapses. The normals n of the vertices become those that minimise
// INT |n - n0|^2 + (halved/2 pi)^4 |Lap n|^2, at unit length; the points then minimise INT |grad x - P grad x0|^2,
// where P projects onto the plane that is normal to n (which shortens the edges of rough triangles to those of the
// smooth surface), and weakly their distance from x0. Throws SolveError where triangles have no area.
TriangleMesh smoothed(const TriangleMesh& mesh, double halved);

// The same filter applied to the points: it parts triangles that noise has folded, whose normals say nothing, but makes
// thin parts thinner, so it is for lengths far below what should stay.
TriangleMesh unfolded(const TriangleMesh& mesh, double halved);

// The points moved along the normals, all equally far, until the mesh bounds this volume.
TriangleMesh with_volume(const TriangleMesh& mesh, double volume);

// Half the cross product of two sides: normal, as long as the area.
Eigen::Vector3d area_vector(const TriangleMesh& mesh, const std::array<int, 3>& triangle);
// The angle between two such normals, in degrees.
double kink_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b);

double mesh_area(const TriangleMesh& mesh);
double mesh_volume(const TriangleMesh& mesh);  // of a closed mesh, > 0 if it faces outward
// The edge length of `triangles` equilateral triangles of this total area.
double even_edge(double area, double triangles);

}  // namespace tubule::surface3d
