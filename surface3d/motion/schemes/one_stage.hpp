// Linearly implicit schemes whose steps go through one stage: Euler, backward differences, the generalised alpha
// method.
#pragma once

#include "surface3d/motion/schemes/time_scheme.hpp"
#include "surface3d/motion/step_solver.hpp"

namespace tubule::surface3d {

// Nodal values at the beginning of the step that led to a state.
struct PastState {
    VectorField X, w;
    Eigen::VectorXd u;
    double period, stretch;

    explicit PastState(const MotionState& s = {}) : X(s.X), w(s.w), u(s.u), period(s.period), stretch(s.stretch) {}

    template <class Fields, class Own>
    static void fields(Fields& f, Own& own, const MotionState& state) {
        f.array("restart_X_past", own.X, state.X.cols());
        f.array("restart_w_past", own.w, state.X.cols());
        f.array("restart_u_past", own.u, state.u.size());
        f.number("restart_period_past", own.period), f.number("restart_stretch_past", own.stretch);
    }
};

// At `level` of the way through a step, X = Xbar + te w and u_t = (u - ubar)/te. Its end lies on the line from its
// beginning to there.
struct OneStage {
    double level, te;
    VectorField Xbar;
    double period_bar;
    Eigen::VectorXd ubar;
    double error;  // of the positions in a step, in units of their third derivative * tau^3
};

class OneStageScheme : public TimeScheme {
public:
    OneStageScheme(const CurvedMesh& mesh, const SurfaceLaw& law, const Bending& bending, const MotionControl& control)
        : TimeScheme(mesh, law, bending, control), solver_(surface()) {}

    const StepSolver& solver() const { return solver_; }

protected:
    // Backward Euler, the first step of all these schemes.
    static OneStage euler(const MotionState& from, double tau) { return {1, tau, from.X, from.period, from.u, 0}; }

    // Solves on the surface that the last two states extrapolate to, or on that of `from` if there is no past. Area and
    // volume are restored as if `missed` were lacking in addition.
    StageSolution solve(const MotionState& from, const PastState* past, const OneStage& stage, double tau,
                        const Extent& missed = {});

    // The end of the step: on the line, still without what is kept.
    static MotionState end_of(const MotionState& from, const StageSolution& solved, const OneStage& stage, double tau);

    // Momenta, error, area and volume of the step that ends at `to`, as it was left by end_of().
    struct Finished {
        MotionStep step;
        Extent lacking;  // of area and volume, before they were kept
    };
    Finished finish(const MotionState& from, const PastState* past, const OneStage& stage, const StageSolution& solved,
                    MotionState to);

private:
    StepSolver solver_;
};

}  // namespace tubule::surface3d
