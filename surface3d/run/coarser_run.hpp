// A coarser run that follows another one, for comparison.
#pragma once

#include <cmath>
#include <memory>
#include <optional>
#include <string>

#include "surface3d/run/surface_simulation.hpp"

namespace tubule::surface3d {

class CoarserRun {
public:
    // Start and clock must outlive it; then one of the next two. Elements of another order take the order below the
    // case's, or 3 for 2.
    CoarserRun(const Problem& c, const Start& start, const RunClock& clock, const MotionSettings& settings);
    void begin();
    // What save() has written under the same prefix. Throws as RecordReader. is_saved(): whether it has.
    static std::unique_ptr<CoarserRun> resumed(const Problem& c, const Start& start, const RunClock& clock,
                                               const Record& record, const std::string& prefix);
    static bool is_saved(const Record& record, const std::string& prefix);
    static void check_restart(const Problem& c, const Record& record, const std::string& prefix);
    void save(const std::string& prefix, Record& record) const;

    // In one step, or in several where that is refused or more than `growth` times as long as the last. Without inertia
    // these are as few as can grow evenly. False if it has ended before.
    bool advance_to(double time, double growth = HUGE_VAL);
    // Continues with about `triangles`, beside a run that has `of_run` of them now.
    void follow_to(int triangles, int of_run);

    bool has_begun() const { return run_.has_state(); }
    bool is_at(double time) const { return has_begun() && !is_before(run_.time(), time); }
    bool is_on_grid() const { return run_.memory().grid > 0; }  // its mesh is an initial one, or became coarser
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

}  // namespace tubule::surface3d
