// One run of a moving surface on a mesh and to a tolerance as given: steps by error, new meshes where they are needed,
// events.
#pragma once

#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "common/case/problem.hpp"
#include "common/run/loop.hpp"
#include "common/run/simulation.hpp"
#include "surface3d/motion/schemes/time_scheme.hpp"
#include "surface3d/run/guards.hpp"
#include "surface3d/run/motion_frame.hpp"
#include "surface3d/run/motion_settings.hpp"
#include "surface3d/run/start.hpp"

namespace tubule::surface3d {

class CompanionRuns;

// Whether t is before the other time by more than rounding.
inline bool is_before(double t, double other) {
    return t < other * (1 - 1e-12);
}

// Many fields: what it is given, its state, and what it remembers.
class SurfaceSimulation : public Simulation {
public:
    // All references must outlive it, and the start of begin() or resume(), of which one comes first. `companions`
    // give the error of the run; none where it is not to be known.
    SurfaceSimulation(const Problem& c, RunObserver& watch, const MotionSettings& settings, CompanionRuns* companions);
    void begin(const Start& start);
    void resume(const Restart& restart, const Start& start);

    bool is_reported() const { return memory_.settings.role == Role::reported; }
    bool has_state() const override { return scheme_ != nullptr; }
    double begin_time() const override;
    double time() const override { return state_.time; }
    double step_size() const override { return state_.step; }
    Energetics energetics() const override;
    std::unique_ptr<StateView> at(double t) override;
    std::optional<StopReport> check_start() override;
    std::optional<StopReport> advance(double until) override;
    bool lands_on_outputs() const override { return true; }
    std::optional<StopReport> update_error() override;
    std::optional<StopReport> find_event(bool at_output) override;
    std::optional<StopReport> check_error() override;
    std::optional<StopReport> adapt_mesh() override;
    StopReport failure(const SolveError& error) override;
    void summarise() override;

    const MotionSettings& settings() const { return memory_.settings; }
    const MotionMemory& memory() const { return memory_; }
    const MotionState& state() const { return state_; }
    bool has_inertia() const { return surface().law().inertia != 0; }
    double energy() const { return comparable(); }  // with loads: F
    CurvedMesh mesh() const { return surface().mesh(state_); }
    double shortest_usual_step() const;  // a run of shorter ones may have stalled

    // For companions: the length of the next step; a mesh of about `triangles` beside a run that has `of_run` of them
    // now, or why there is none.
    void set_next_step(double tau) { memory_.next_step = tau; }
    std::optional<StopReport> take_thinner_mesh(int triangles, int of_run);

private:
    class View;
    // Why a trial step was rejected; empty if it is accepted.
    struct Refusal {
        double shrink = 0.25;  // length of the next trial over this one; 0: there is none
        StopReport report;     // if no step is short enough
    };

    // The initial shape.
    void use_mesh(const CurvedMesh& mesh);
    bool moves_from_the_first() const;
    void set_moving();
    double jump();
    double first_step_from(double by_error) const;
    double initial_dissipation();
    void measure_state();
    void measure_first_state();

    // A step.
    std::optional<Refusal> try_step(double tau);
    std::optional<StopReport> impossible(const Observables& o, const MotionState& s) const;
    std::optional<Refusal> check_trial(const MotionStep& next, const MotionMeasures& m) const;
    double work_of(const MotionStep& next, const MotionMeasures& m) const;
    double supplied_by(const MotionStep& next, const MotionMeasures& m) const;
    double since_kink() const;
    void take(const MotionStep& next, const MotionMeasures& m);
    void choose_next_step(double tau, double asked, double error, int order);

    // Another mesh.
    bool wants_new_mesh() const;
    void make_new_mesh();
    bool may_be_thinned() const;
    void look_for_thinner();
    bool thin_to(int triangles, double most_jump);
    Eigen::MatrixXd carried() const;
    bool change_mesh(const CurvedMesh& mesh, const Eigen::MatrixXd& fields, double most_jump);

    std::optional<StopReport> check_state() const;
    std::optional<StopReport> check_crossing(bool at_output);
    std::string advice_where_it_fails() const;
    double most_coarse() const;
    double coarseness_of(const CurvedMesh& mesh) const;
    bool is_coarse() const;
    double volume_drift() const;
    void warn_of_drift();

    const SchemeEntry& traits() const { return entry(case_.scheme); }
    MovingSurface& surface() const { return scheme_->surface(); }
    // total(): F + kinetic - work - supplied, never rises. comparable(): F - work, by which runs are compared.
    double total() const { return comparable() + now_.kinetic - memory_.balance.supplied; }
    double comparable() const { return now_.free_energy - memory_.balance.work; }
    Extent extent_now() const { return {now_.bending.area, now_.bending.volume, now_.length}; }
    double moment_of_time() const { return 1e-12 * case_.time.end; }
    double next_kink() const { return tubule::next_kink(surface().law(), state_.time + moment_of_time()); }

    const Problem& case_;
    RunObserver& watch_;
    CompanionRuns* companions_;
    const Start* start_ = nullptr;
    std::unique_ptr<TimeScheme> scheme_;
    MotionState state_;
    MotionMeasures now_;
    MotionMemory memory_;
    std::optional<StopReport> initial_stop_;
    double error_now_ = 0;
};

// The loop of such a run, once it has begun: with the callbacks that surfaces have. All references must outlive it.
Loop loop_of(SurfaceSimulation& run, const Problem& c, RunObserver& watch, const RunClock& clock);

}  // namespace tubule::surface3d
