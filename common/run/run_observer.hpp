// What a run of either tier hands over: rows and frames as it goes, a summary at its end.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "common/result/result.hpp"
#include "common/solve/stop.hpp"

namespace tubule {

// An observer of a run. Rows hold one value for each series of the tier; a frame is made when asked for.
struct RunObserver {
    virtual ~RunObserver() = default;
    virtual void row(std::span<const double>) {}
    virtual std::size_t mesh(const SurfaceCells&) { return 0; }  // the number by which frames name it
    virtual void frame(const std::function<Record()>& /*make*/) {}
    virtual void checkpoint(const Record&) {}
    virtual void discard() {}  // the run begins again with finer settings: forget all rows and frames
    virtual void next_run(int /*number*/, int /*of*/) {}  // a run begins; the number of runs as far as is known
    virtual void progress(double /*time*/, double /*energy*/, double /*step*/) {}
    virtual bool interrupted() { return false; }
    virtual void note(const std::string& /*words*/) {}  // a message to show at once
};

// Hands everything on.
class PassingOn : public RunObserver {
public:
    explicit PassingOn(RunObserver& to) : to_(to) {}
    void row(std::span<const double> values) override { to_.row(values); }
    std::size_t mesh(const SurfaceCells& cells) override { return to_.mesh(cells); }
    void frame(const std::function<Record()>& make) override { to_.frame(make); }
    void checkpoint(const Record& state) override { to_.checkpoint(state); }
    void discard() override { to_.discard(); }
    void next_run(int number, int of) override { to_.next_run(number, of); }
    void progress(double time, double energy, double step) override { to_.progress(time, energy, step); }
    bool interrupted() override { return to_.interrupted(); }
    void note(const std::string& words) override { to_.note(words); }

private:
    RunObserver& to_;
};

// Whether the run was stopped from outside, and can be resumed as if it had not been.
inline bool can_go_on(Stop reason) {
    return reason == Stop::interrupted || reason == Stop::time_limit;
}

struct RunSummary {
    StopReport stop;
    double energy = 0;            // at the stop
    double reference_energy = 0;  // E_ref, theory.md (11.1): asked and estimated errors are relative to it
    double estimated_error = 0;   // of the energy, largest over the run, relative to E_ref; 1 where it is unknown
    bool as_accurate_as_asked = true;
    int attempts = 1;     // how often the run began again with finer settings, plus one
    int elements = 0;     // at the stop; of a tube over one period
    int rough_steps = 0;  // of surfaces: those after which they are rough for their mesh
    std::vector<std::string> warnings;
    std::string effort;  // in words, such as "85 steps, 96 elements"
    About details;       // more of it, by name

    bool error_is_known() const { return estimated_error < 1; }
};

}  // namespace tubule
