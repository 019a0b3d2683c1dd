// Matrices like those of the three-dimensional tier, for tests and benchmarks of solvers that need no tier: P_k
// Lagrange elements on the flat triangles of a subdivided icosahedron, with the exact normal of the unit sphere.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <array>
#include <vector>

namespace tubule::sphere {

using Matrix = Eigen::SparseMatrix<double>;

struct Triangles {
    std::vector<Eigen::Vector3d> points;
    std::vector<std::array<int, 3>> corners;
};

// 20 * 4^level triangles.
Triangles icosphere(int level);

// mass (a, b) + stiffness (grad a, grad b)
Matrix helmholtz(const Triangles& t, int k, double mass, double stiffness);

// A system of several unknowns per node.
struct System {
    Matrix A;
    std::vector<int> node_of_unknown;
};

// Four unknowns a node, those of mesh motion: (grad Y, grad Z) + wind ((rotation . grad) Y, Z) + (m nu, Z), (Y . nu,
// r). Indefinite, unsymmetric if there is a wind. Unknowns: Y by components, then m.
System saddle(const Triangles& t, int k, double wind);

// One step tau of the flow in u (P_k, by components), p (P_{k-1}), H, K (P_k), Re = 1, k20 = .125, k42 = .12,
// linearised about the sphere (B = -P, H = -2, K = 1), with the rotation as its wind. Unsymmetric; no diagonal for p.
System flow(const Triangles& t, int k, double tau);

// That step, rows scaled to be symmetric except for advection: p by -1, H by -f_HH/tau, K by -f_KK/tau.
System almost_symmetric(System flow, double tau);

}  // namespace tubule::sphere
