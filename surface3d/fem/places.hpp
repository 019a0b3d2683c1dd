// What acts on a curved mesh at places: potentials, theory.md (2.22), and two beads, (2.23).
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "common/energy/bead_equations.hpp"
#include "common/energy/potential.hpp"
#include "common/model/model.hpp"
#include "surface3d/fem/surface_space.hpp"

namespace tubule::surface3d {

// W at a point, which is a tension that varies, and its derivatives by the place; zeros without W.
struct PointPotential {
    double value = 0;
    Eigen::Vector3d slope = Eigen::Vector3d::Zero();
    Eigen::Matrix3d second = Eigen::Matrix3d::Zero();

    PointPotential() = default;
    PointPotential(const std::optional<Formula>& W, const Eigen::Vector3d& x) {
        if (W) *this = PointPotential(*W, x, 0);
    }
    // A density of a number P, too.
    PointPotential(const Formula& W, const Eigen::Vector3d& x, double P);
    void add(double factor, const PointPotential& other) {
        value += factor * other.value, slope += factor * other.slope, second += factor * other.second;
    }
};

// INT W dS of a density of the place x, y, z and of a number P; and its rate as the nodes move at velocities v.
double place_integral(const SurfaceSpace& space, const CurvedMesh& mesh, const Formula& W, double P = 0);
double place_rate(const SurfaceSpace& space, const CurvedMesh& mesh, const Formula& W, double P, const VectorField& v);

// The ends of the surface along the axis, outward: where beads are looked for.
std::array<double, 2> poles(const CurvedMesh& mesh);
// The beads of a surface, which pull with this force. NaN where a bead has no position.
BeadNumbers bead_numbers(const SurfaceSpace& space, const CurvedMesh& mesh, const BeadEquations& beads, double force);
// The distance of beads of this width.
double bead_distance(const CurvedMesh& mesh, double width);

// How far apart the nodes are near a bead, or near a wall: the longest edge there over the width of the bead, or the
// range of the wall, and over the order. Above `coarsest` they do not resolve it: docs/decisions/equilibria.md.
struct Coarseness {
    double value = 0;
    Eigen::Vector3d where = Eigen::Vector3d::Zero();
};
constexpr double coarsest_place = 0.6;
Coarseness bead_coarseness(const CurvedMesh& mesh, const BeadNumbers& at, double width);
Coarseness wall_coarseness(const CurvedMesh& mesh, std::span<const Potential> potentials);
// Likewise over a scale that is given at the nodes.
Coarseness coarseness(const CurvedMesh& mesh, const Eigen::VectorXd& scale);

// Whether the weight of a bead of this width with its pole at z is more than rounding there.
inline bool is_in_reach(const Eigen::Vector3d& x, double z, double width) {
    return (x - z * Eigen::Vector3d::UnitZ()).norm() < 8.5 * width;
}

// So many even triangles resolve a surface of this area near all walls and beads: with edges of twice the shortest
// range or width, nodes of order 4 are half of it apart. And the largest edges that do, at the nodes of a mesh of this
// order.
int triangles_for_places(std::span<const Potential> potentials, const std::optional<Beads>& beads, double area);
Eigen::VectorXd largest_edges(const CurvedMesh& mesh, std::span<const Potential> potentials,
                              const std::optional<Beads>& beads, const BeadNumbers& at);

// The least distance of a node from a wall, infinite without any: not positive behind it.
struct WallDistance {
    double value = HUGE_VAL;
    Eigen::Vector3d where = Eigen::Vector3d::Zero();
};
WallDistance wall_distance(const CurvedMesh& mesh, std::span<const Potential> potentials);

// Combinations of translations and of rotations about `centre`, of a tube about z alone, these per `size`, along which
// a density of the place does not change at the nodes: one column of six each, translation before rotation.
Eigen::MatrixXd unmoved_by(const Formula& W, const CurvedMesh& mesh, const Eigen::Vector3d& centre, double size);
// Those that no potential and, if there are beads, these do not resist: beads let a surface move along the z axis and
// turn about it.
Eigen::MatrixXd free_motions(const CurvedMesh& mesh, const std::vector<Potential>& potentials, bool with_beads,
                             const Eigen::Vector3d& centre, double size);

}  // namespace tubule::surface3d
