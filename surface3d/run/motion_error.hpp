// The error of a run in motion, from a coarser run that goes along with it.
#pragma once

#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "surface3d/run/motion_attempt.hpp"

namespace tubule::surface3d {

// The coarser run has fewer triangles and goes over several steps of the run at once, so that errors in space and in
// time are larger by known factors: the difference of the energies is R - 1 times the error, R being the smaller
// factor. It follows the run by these few steps. It has elements of another order where fewer triangles would be too
// few, are not ours to choose, or lose the surface on the way.
struct ComparedEnergies {
    std::vector<double> times, energies;  // of the run, at which the coarser one is compared with it
    int compared = 0;                     // so many of them, as yet
    int since = 0;                        // steps of the run since the last of these times
    double error = 0;                     // at the last time compared
};

class MotionError {
public:
    // All references must outlive it. `of`: the run whose error it is.
    MotionError(const Case& c, const Start& start, RunObserver& watch, const RunClock& clock, const MotionSettings& of);

    // With the run, which has so many triangles, or where that goes on. resume() throws as RecordReader. The error of
    // the start, which is known from a finer mesh: where the shape is not smooth, two meshes may be off by the same.
    double begin(int triangles, double energy);
    void resume(const Record& record, int triangles);
    void save(Record& record) const;

    // Of this energy, which is that after a step, or of the last one that was compared, absolute; the smoothness is
    // that of MotionMeasures. Nothing where the coarser run has no energy: it has ended before, or it was told to
    // pause, as the run will be.
    std::optional<double> at(double time, double energy, double smoothness);
    // Why and when the coarser run ended, if it has.
    std::optional<StopReport> stop() const;

    double give_up = HUGE_VAL;  // beyond this error, of E_ref, the run is not worth going on

private:
    // The coarser run refers to its case.
    struct Coarser {
        Case c;
        std::optional<MotionAttempt> run;
    };

    std::unique_ptr<Coarser> make(Role role, const MotionSettings& settings) const;
    void begin(int triangles);
    void begin(Role role, double coarser_by);
    bool catch_up(double smoothness);
    double error_of_start(double energy) const;

    const Case& case_;
    const Start& start_;
    RunObserver& watch_;
    const RunClock& clock_;
    MotionSettings of_;
    std::unique_ptr<Coarser> coarser_;
    ComparedEnergies of_run_;
};

// Throws as RecordReader if a run with an error could not go on from this.
void check_error_restart(const Case& c, const Record& record);

}  // namespace tubule::surface3d
