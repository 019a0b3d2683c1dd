// The error of a run in motion, from a coarser run that goes along with it.
#pragma once

#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "surface3d/run/coarser_run.hpp"

namespace tubule::surface3d {

// The run itself, as far as coarser runs are to follow it.
struct FollowedRun {
    std::vector<double> times, energies, dissipations, orders;  // of its steps
    double growth = 1e9;  // of steps of the coarser run, from one to the next, at most
    double spare = 1;     // stated over known error, spare_for_waves()
    // Where it continued with fewer triangles: the number of that time, the triangles asked for and obtained.
    std::vector<double> thinned_at, asked, had;
};

// How far the run and its coarser runs have been compared.
struct Comparison {
    int compared = 0;        // number of times of the run, as yet
    double error = 0;        // at the last time compared
    double between = 0;      // then, of the two coarser runs
    double sum_in_time = 0;  // then, of the parts that steps have added to the error in time
    double in_time = 0;      // largest error in time
    // At the slowest of the times compared: its number, the dissipation, the difference of the energies, the number of
    // steps of the coarser run until then. The largest dissipation since then.
    double slowest_at = 0, slowest = 0, difference_then = 0, steps_then = 0, fastest = 0;
};

// Coarser runs have fewer triangles, so that errors in space are larger by a known factor; or elements of another order
// where fewer triangles would be too few, are given, or lose the surface on the way. One takes several steps of the run
// at once, so that errors in time are larger by a known factor, too: theory.md (11.2). With schemes of high order that
// factor is far beyond that of errors in space; another coarser run then takes the steps of the run and separates both,
// theory.md (11.4).
class MotionError {
public:
    // All references must outlive it. `of`: the run whose error it is.
    MotionError(const Problem& c, const Start& start, const RunClock& clock, const MotionSettings& of);

    // Begins, or resumes, with the run, which has this number of triangles. resume() throws as RecordReader. begin()
    // returns the error of the initial state, which has these measures.
    double begin(int triangles, const MotionMeasures& start);
    void resume(const Record& record, int triangles);
    void save(Record& record) const;

    // Absolute error of this energy, after a step of this order, or of the last one compared; dissipation and
    // smoothness are those of MotionMeasures. Nothing where a coarser run has no energy: it has ended before, for
    // whatever reason, or pauses, as the run will.
    std::optional<double> follow_to(double time, double energy, double dissipation, int order, double smoothness);
    // Whether coarser runs are at this time, which is that of the last energy, on their initial meshes; then they can
    // get fewer triangles, as the run has: what it asked for, and what it has.
    bool is_at(double time) const;
    void thinned(int asked, int triangles);
    // Stated over known error, of the balance, too.
    double spare() const { return of_run_.spare; }
    // The largest part of it that is due to time; nothing where that is not known separately.
    std::optional<double> in_time() const;
    // Why and when a coarser run ended, if it has.
    std::optional<StopReport> stop() const;

    double give_up = HUGE_VAL;  // beyond this error, of E_ref, the run is not worth continuing

private:
    void begin(int triangles);
    void begin(Role role, double coarser_by);
    template <class Work>
    void attempt(const Work& work, double time);
    void follow(double smoothness);
    bool catch_up(double smoothness);
    double error_at(std::size_t i, double smoothness);
    double error_at_once(std::size_t i, double smoothness);
    void follow_mesh(std::size_t i);
    bool is_compared(std::size_t i) const;
    bool separates_time_error() const;

    const Problem& case_;
    const Start& start_;
    const RunClock& clock_;
    MotionSettings of_;
    std::unique_ptr<CoarserRun> coarser_, same_steps_;  // the second one where errors are separated
    FollowedRun of_run_;
    Comparison compared_;
    std::optional<StopReport> failure_;  // there are no coarser runs
};

// Throws as RecordReader if a run with an estimated error could not resume from this.
void check_error_restart(const Problem& c, const Record& record);

}  // namespace tubule::surface3d
