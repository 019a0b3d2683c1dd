// Events: a mesh that is not a valid surface, curvatures that are inconsistent with it, and why a motion stops before
// its end. Each is silent while all is well; those of motions trigger on NaN, too.
#pragma once

#include <cmath>
#include <optional>

#include "common/case/problem.hpp"
#include "common/solve/stop.hpp"
#include "surface3d/curvature/bending_force.hpp"
#include "surface3d/fem/mesh_quality.hpp"
#include "surface3d/motion/motion_measures.hpp"

namespace tubule::surface3d {

// A cell that folds (mesh_quality).
std::optional<StopReport> find_fold(const MeshQuality& quality);

// Closed surfaces have INT H^2 >= 16 pi (Willmore), and INT K is 2 pi times the Euler characteristic (Gauss-Bonnet):
// a report where one of them is missed by more than `allowed` of 16 pi, or of 4 pi and that multiple of 2 pi.
std::optional<StopReport> find_impossible_curvature(const Observables& o, const CurvedMesh& mesh,
                                                    double allowed = 0.01);

// Triangles that meet where they should not, those of the next periods of a tube included; the curved ones are taken as
// the flat ones between their nodes.
std::optional<StopReport> find_self_intersection(const CurvedMesh& mesh);

// Where the formula of the energy is hardly defined.
StopReport undefined_energy(const MotionMeasures& m, double time);

// The neck radius that ends a run: accuracy.r_min. Meshes from files come in any units, so there, unless the case gives
// it, the default counts in radii of the sphere of this area.
double least_neck(const Problem& c, double area);

// Faults of the shape and its triangles, which no shorter step would remedy: an energy that does not resist short
// waves or is hardly defined, a wall that is passed, a neck thinner than r_min, normals that turn too far from node to
// node, a degenerate triangle.
std::optional<StopReport> find_bad_shape(const MotionMeasures& m, double r_min, double time);

// Triangles that do not resolve a wall or a bead: a coarseness above `most`.
std::optional<StopReport> find_coarse_place(const MotionMeasures& m, double most, double time);

// The energy, kinetic energy included, can only fall. A step that raises it by more than a quarter of the accuracy
// asked is refused; many small rises stop a run once they come to ten times that accuracy. All relative to E_ref, the
// rise over many steps since the lowest energy.
std::optional<StopReport> find_rise_in_step(double rise, double asked, double time, double step);
std::optional<StopReport> find_slow_rise(double rise, double asked, double time);

// INT H^2 or INT K off by more than `allowed` (find_impossible_curvature), with advice for a motion.
std::optional<StopReport> find_impossible_motion(const Observables& o, const CurvedMesh& mesh, double allowed,
                                                 double time);

// Where area and volume are one condition, the area alone is kept: the relative change of the volume since t = 0,
// which may be a hundredth of the accuracy asked. Where they are two, steps that miss the volume are refused.
constexpr double most_drift = 0.01;
std::optional<StopReport> find_drift(double change, double asked, double time);

}  // namespace tubule::surface3d
