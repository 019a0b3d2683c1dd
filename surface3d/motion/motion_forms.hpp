// One step of the moving surface as a linear system: unknowns, matrix and right-hand side.
#pragma once

#include <vector>

#include "common/energy/bending.hpp"
#include "surface3d/fem/field_unknowns.hpp"
#include "surface3d/fem/places.hpp"
#include "surface3d/motion/extent.hpp"
#include "surface3d/motion/motion_fields.hpp"
#include "surface3d/motion/surface_law.hpp"

namespace tubule::surface3d {

// Order of the pressure on surfaces of this order: Taylor-Hood elements where the surface flows; 0 without a pressure.
int pressure_order(const SurfaceLaw& law, int order);

// The fields of a law, and the numbers of their unknowns.
struct MotionUnknowns : FieldUnknowns {
    MotionUnknowns(const CurvedMesh& mesh, const SurfaceLaw& law, const Bending& bending);

    int H = -1, K = -1, mu = -1, p = -1;  // first number of each, or -1 where there is none; the velocity begins at 0
};

// The state about which a step is linearised: the surface X* expected at its end, and its history. Over the
// step, X = Xbar + te w and u_t = (u - ubar)/te: theory.md (10.4), backward differences of any order.
struct StepBase {
    const CurvedMesh* mesh;              // X*
    MotionFields fields;                 // of X*
    VectorField displacement;            // X* - Xbar, without its stretch
    VectorField mesh_velocity;           // w*, expected
    Eigen::VectorXd velocity;            // u*, expected, as numbered in MotionUnknowns; of one or three components
    Eigen::VectorXd past;                // ubar
    double te = 0;                       // the step, effectively
    double curvature_stabilisation = 0;  // L_H is taken 1 + this * |B| (width of a triangle) times
    double tension = 0;  // expected: its part in the force changes with H at once, -tension (H - H*, v.nu)
    double stretch = 0;  // in X* - Xbar, of a free period
    // Beads on X*, null without; their positions with multipliers for a force of 1; and the force, given or expected.
    const BeadEquations* beads = nullptr;
    BeadNumbers bead_numbers = BeadNumbers::Zero();
    double force = 0;
    double M = 0;     // INT H of X*
    double time = 0;  // of sources
};

// What belongs to the stretch e of a free period, u = .. + e z e_z: theory.md (3.19), (10.18).
struct StretchTerms {
    Eigen::VectorXd column, row;
    double own = 0;     // of e in its row
    double energy = 0;  // dE[z e_z], less what H and K in the row add to it
    Extent rate;        // of area, volume and period on X*
    double M = 0;       // and of INT H
};

struct StepSystem {
    Eigen::SparseMatrix<double> A;
    Eigen::VectorXd b;
    Eigen::VectorXd flux;           // (u.nu, 1) = flux . unknowns: the column and the row of lambda
    Eigen::VectorXd pressure_load;  // (1, q) in the rows of the pressure: b -= rate * this makes div_P u = rate
    Eigen::VectorXd widening;       // the rate of the area, -(H*, v.nu); of extensible membranes
    Eigen::VectorXd turning;        // the rate of M = INT H, -(2 K, u.nu): theory.md (2.20)
    // The rates of G and dG/dP of each bead, theory.md (2.23), and that of their distance.
    Eigen::Matrix<double, Eigen::Dynamic, 4> beads;
    Eigen::VectorXd pulling(const BeadNumbers& at) const { return -at[1] * beads.col(0) - at[3] * beads.col(2); }
    Eigen::VectorXd force;  // (b, v) on X*, of potentials, too, in the rows of the velocity
    StretchTerms stretch;
    Eigen::SparseMatrix<double>
        advection;  // (c.grad phi_b, phi_a), c = u* - w* along the surface; empty without inertia
};

// H, K and, where kg > 0, mu = -2 kg Lap H at the end of the step are unknowns, coupled to u by their evolution
// equations: the bending force is implicit in both. Of area differences it has what is known on X*, alpha (M - M0) with
// its M: theory.md (10.5), (10.6), (10.7), (10.8).
void assemble(const SurfaceSpace& space, const MotionUnknowns& unknowns, const SurfaceLaw& law, const Bending& bending,
              const StepBase& base, StepSystem& system);

}  // namespace tubule::surface3d
