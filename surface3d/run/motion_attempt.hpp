// One run of a moving surface on a mesh and to a tolerance as given: steps by error, new meshes where they are needed,
// and the reason why it ends.
#pragma once

#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "common/case/case.hpp"
#include "common/run/output_times.hpp"
#include "common/run/run_output.hpp"
#include "common/run/settling.hpp"
#include "surface3d/motion/schemes/time_scheme.hpp"
#include "surface3d/run/motion_checks.hpp"
#include "surface3d/run/motion_frame.hpp"
#include "surface3d/run/motion_run.hpp"
#include "surface3d/run/motion_settings.hpp"
#include "surface3d/run/start.hpp"

namespace tubule::surface3d {

class MotionError;

// Of two times of a run: by more than rounding.
inline bool is_before(double t, double other) {
    return t < other * (1 - 1e-12);
}

// A run on surfaces, from its start to its stop. Many fields: what it is given, what it writes, and where it is.
// One run with settings as given. Many fields: what it is made of, and where it is.
class MotionAttempt {
public:
    // All references must outlive the attempt. `error` tells that of the run; none where it is not to be known.
    MotionAttempt(const Case& c, RunObserver& watch, const RunClock& clock, const MotionSettings& settings,
                  MotionError* error);

    // One of the first two, with a start that outlives the attempt; then go(), or steps as they are wanted.
    void begin(const Start& start);
    void resume(const Restart& restart, const Start& start);
    void go();
    void advance();
    // Of a coarser run: in one step, or in several where that is refused or more than `growth` times as long as the
    // last. Without inertia these are as few as can grow evenly.
    void advance_to(double time, double growth = HUGE_VAL);
    void end(const StopReport& stop) { stop_ = stop; }  // there are no more
    // Of a coarser run: goes on with about so many triangles, beside a run that has so many of them now.
    void follow_to(int triangles, int of_run);
    bool is_on_grid() const { return memory_.grid > 0; }  // its mesh is that of the start, or a coarser one of it

    RunSummary summary;
    const std::optional<StopReport>& stop() const { return stop_; }
    const MotionSettings& settings() const { return memory_.settings; }
    const MotionState& state() const { return state_; }  // no nodes: it could not begin
    double energy() const { return comparable(); }       // with loads: F
    int steps() const { return memory_.count.steps; }
    int rough_steps() const { return rough_steps_; }  // of this attempt, to surfaces that are rough for their mesh
    CurvedMesh mesh() const { return scheme_->surface().mesh(state_); }
    Record saved() const { return state_record(state_, memory_); }
    // Largest errors, absolute: of the energy; of the balance with dissipation.
    double error() const { return memory_.error; }
    double defect() const { return memory_.balance.defect; }

private:
    // Why a trial step was rejected; empty if it is accepted.
    struct Refusal {
        double shrink = 0.25;  // the next trial is so much shorter; 0: there is none
        StopReport report;     // if no step is short enough
    };

    // The start.
    void use_mesh(const CurvedMesh& mesh);
    void set_moving();
    void look();
    void check_start();

    // A step.
    std::optional<StopReport> step();
    std::optional<Refusal> attempt(double tau);
    std::optional<StopReport> impossible(const Observables& o, const MotionState& s) const;
    std::optional<Refusal> judge(const MotionStep& next, const MotionMeasures& m) const;
    double work_of(const MotionStep& next, const MotionMeasures& m) const;
    double since_kink() const;
    void take(const MotionStep& next, const MotionMeasures& m);
    void set_next_step(double tau, double asked, double error, int order);
    bool wants_new_mesh() const;
    void make_new_mesh();
    bool may_be_coarser() const;
    void look_for_coarser();
    bool make_coarser(int triangles, double most_jump);
    Eigen::MatrixXd carried() const;
    bool change_mesh(const CurvedMesh& mesh, const Eigen::MatrixXd& fields, double most_jump);

    // Reasons to stop.
    std::optional<StopReport> check_state() const;
    std::optional<StopReport> check_crossing(bool at_output);
    std::optional<StopReport> check_progress();
    double what_may_change() const;
    double volume_drift() const;

    // What is written.
    void compare();
    void warn_of_drift();
    void write_row();
    void write_frame();
    void summarise(const StopReport& stop);
    Record record();

    const SchemeEntry& traits() const { return entry(time_scheme(case_)); }
    MovingSurface& surface() const { return scheme_->surface(); }
    // What can only fall, and the part of it that runs are compared by: without the kinetic energy.
    double total() const { return comparable() + now_.kinetic; }
    Extent extent_now() const { return {now_.bending.area, now_.bending.volume, state_.period}; }
    double comparable() const { return now_.free_energy - memory_.balance.work; }
    double moment_of_time() const { return 1e-12 * case_.time.end; }
    double left_until_output() const { return outputs_.next() - state_.time; }
    double next_kink() const { return surface().law().next_kink(state_.time + moment_of_time()); }

    const Case& case_;
    const RunClock& clock_;
    MotionError* error_;
    const Start* start_ = nullptr;
    RunOutput out_;
    OutputTimes outputs_;
    std::unique_ptr<TimeScheme> scheme_;
    MotionState state_;
    MotionMeasures now_;
    MotionMemory memory_;
    StallDetector stall_;
    Settling settling_;
    std::optional<StopReport> stop_;
    double until_ = HUGE_VAL;  // no step goes farther
    double error_now_ = 0;
    int rough_steps_ = 0;
    LinearWork linear_work_;
};

}  // namespace tubule::surface3d
