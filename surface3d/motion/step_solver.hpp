// The linearly implicit stages of which time schemes are made: each solved on the surface that is expected at its time.
#pragma once

#include "common/solve/bordered.hpp"
#include "common/solve/gmres.hpp"
#include "surface3d/motion/motion_forms.hpp"
#include "surface3d/motion/moving_surface.hpp"

namespace tubule::surface3d {

// At the time of a stage X = Xbar + te (w + stretch z e_z) and u_t = (u - ubar)/te.
struct Stage {
    double time, te;
    VectorField Xbar;
    double period_bar;
    Eigen::VectorXd ubar;
    VectorField X, w;  // expected positions, velocity of the nodes,
    double period, stretch;
    Eigen::VectorXd u;  // velocity,
    double tension;     // of an area that is kept as a whole
    double force;       // that holds the distance of beads
    double relaxation;  // time in which the mesh becomes even; shorter ones than about te overshoot
};

struct StageSolution {
    VectorField X, w;
    Eigen::VectorXd u, p;
    double lambda = 0, tension = 0, force = 0, period = 0, stretch = 0;  // as those of MotionState
    MotionFields fields;                                                 // of the surface that was expected
    bool keeps_volume = false;

    MotionState state(double time, double step) const;  // that of its end, `step` after the last
};

// What keeping area and volume took: free energy, to first order, and what was lacking of them.
struct KeptExtent {
    double energy = 0;
    Extent lacking;
};

class StepSolver {
public:
    explicit StepSolver(MovingSurface& surface);  // which must outlive it

    // With the given rates of area, volume and the distance of beads, where they are kept
    // (MovingSurface::rate_to_keep). SolveError.
    StageSolution solve(const Stage& stage, const Extent& rate);

    // Moves the end of a step, whose last stage was `solved`, to the area, volume and distance that are kept.
    // SolveError where they cannot be kept to 1e-8.
    KeptExtent keep_extent(const StageSolution& solved, MotionState& to) const;

    const MotionUnknowns& unknowns() const { return unknowns_; }
    const StepSystem& system() const { return system_; }  // of the last stage, rows scaled to be almost symmetric

private:
    Eigen::VectorXd solve(const StepBase& base, double time, const Extent& rate, StageSolution& out);
    Eigen::VectorXd mesh_flux(const StepBase& base, const Eigen::VectorXd& u);
    void make_symmetric(const StepBase& base);
    void add_beads(const StepBase& base, const Extent& rate, BorderedSolver::Border& border, Eigen::Index& n) const;
    double lead(const StepBase& base, const Eigen::VectorXd& slope, double by_stretch) const;
    double paired(const Eigen::VectorXd& rows, const VectorField& v, const MotionFields& fields) const;
    double work(const MovingSurface::Correction& by, const MotionState& at, const MotionFields& fields) const;

    MovingSurface& surface_;
    MotionUnknowns unknowns_;
    StepSystem system_;
    BorderedSolver solver_;
    Gmres gmres_;
};

}  // namespace tubule::surface3d
