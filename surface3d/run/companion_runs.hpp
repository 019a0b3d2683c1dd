// Runs that go along with a run in motion, and its error by their comparison.
#pragma once

#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "surface3d/run/surface_simulation.hpp"

namespace tubule::surface3d {

// A run that goes along with another one, for comparison.
class Companion {
public:
    // Start and clock must outlive it; then one of the next two. Elements of another order take the order below the
    // case's, or 3 for 2.
    Companion(const Problem& c, const Start& start, const RunClock& clock, const MotionSettings& settings);
    void begin();
    // What save() has written under the same prefix. Throws as RecordReader. is_saved(): whether it has.
    static std::unique_ptr<Companion> resumed(const Problem& c, const Start& start, const RunClock& clock,
                                              const Record& record, const std::string& prefix);
    static bool is_saved(const Record& record, const std::string& prefix);
    static void check_restart(const Problem& c, const Record& record, const std::string& prefix);
    void save(const std::string& prefix, Record& record) const;

    // Goes to `time`: in one step if it is accepted and at most `growth` times the last; else in several, without
    // inertia the fewest that grow by one factor. False if it ends before.
    bool advance_to(double time, double growth = HUGE_VAL);
    // Continues with about `triangles`, beside a run that has `of_run` of them now.
    void take_mesh(int triangles, int of_run);

    bool has_begun() const { return run_.has_state(); }
    bool is_at(double time) const { return has_begun() && !is_before(run_.time(), time); }
    bool has_initial_mesh() const { return run_.memory().initial_mesh_of > 0; }
    const std::optional<StopReport>& stop() const { return loop_ ? loop_->stop() : no_stop_; }
    const SurfaceSimulation& run() const { return run_; }
    double energy() const { return run_.energy(); }
    int steps() const { return run_.memory().count.steps; }

private:
    std::unique_ptr<const Problem> case_;
    const Start& start_;
    const RunClock& clock_;
    SurfaceSimulation run_;
    std::optional<Loop> loop_;
    inline static const std::optional<StopReport> no_stop_;
};

// The run, as far as its companions need it.
struct RunSoFar {
    std::vector<double> times, energies, dissipations, orders;  // of its steps
    double growth = 1e9;  // of steps of a companion, from one to the next, at most
    double spare = 1;     // stated over known error, spare_for_waves()
    // Where it continued with fewer triangles: the number of that time, the triangles asked for and obtained.
    std::vector<double> thinned_at, asked, had;
};

// How far the run and its companions have been compared.
struct Comparison {
    int compared = 0;        // number of times of the run, as yet
    double error = 0;        // at the last time compared
    double between = 0;      // then, of the two companions
    double sum_in_time = 0;  // then, of the parts that steps have added to the error in time
    double in_time = 0;      // largest error in time
    // At the slowest of the times compared: its number, the dissipation, the difference of the energies, the number of
    // steps of the companion until then. The largest dissipation since then.
    double slowest_at = 0, slowest = 0, difference_then = 0, steps_then = 0, fastest = 0;
};

// The error of a run in motion, from one or two companions. These have fewer triangles, so that errors in space are
// larger by a known factor; or elements of another order where fewer triangles would be too few, are given, or lose the
// surface on the way. One takes several steps of the run at once, so that errors in time are larger by a known factor,
// too: theory.md (11.2). With schemes of high order that factor is far beyond that of errors in space; another
// companion then takes the steps of the run and separates both, theory.md (11.4).
class CompanionRuns {
public:
    // All references must outlive it. `of`: the run whose error it is.
    CompanionRuns(const Problem& c, const Start& start, const RunClock& clock, const MotionSettings& of);

    // Begins, or resumes, with the run, which has this number of triangles. resume() throws as RecordReader. begin()
    // returns the error of the initial state, which has these measures.
    double begin(int triangles, const MotionMeasures& start);
    void resume(const Record& record, int triangles);
    void save(Record& record) const;

    // Tells of a step of the run, lets the companions catch up, and returns the absolute error at the last time
    // compared. Nothing where a companion did not get there: it ended, failed, or pauses, as the run then does. `order`
    // is that of the step; dissipation and smoothness are those of MotionMeasures.
    std::optional<double> compare_at(double time, double energy, double dissipation, int order, double smoothness);
    // Whether companions are at this time, which is that of the last energy, on their initial meshes; then they can
    // get fewer triangles, as the run has: what it asked for, and what it has.
    bool is_at(double time) const;
    void thinned(int asked, int triangles);
    // Stated over known error, of the balance, too.
    double spare() const { return run_.spare; }
    // The largest part of it that is due to time; nothing where that is not known separately.
    std::optional<double> in_time() const;
    // Why and when a companion ended, if it has.
    std::optional<StopReport> stop() const;

    double give_up = HUGE_VAL;  // beyond this error, of E_ref, the run is not worth continuing

private:
    void begin(int triangles);
    void begin(Role role, double coarser_by);
    template <class Work>
    void attempt(const Work& work, double time);
    void catch_up_or_replace(double smoothness);
    bool catch_up(double smoothness);
    double error_at(std::size_t i, double smoothness);
    double error_at_once(std::size_t i, double smoothness);
    void pass_on_thinning(std::size_t i);
    bool is_compared(std::size_t i) const;
    bool separates_time_error() const;

    const Problem& case_;
    const Start& start_;
    const RunClock& clock_;
    MotionSettings of_;
    std::unique_ptr<Companion> long_steps_, same_steps_;  // the second one where errors are separated
    RunSoFar run_;
    Comparison compared_;
    std::optional<StopReport> failure_;  // there are no companions
};

// Throws as RecordReader if a run with an estimated error could not resume from this.
void check_companions(const Problem& c, const Record& record);

}  // namespace tubule::surface3d
