// Ends a run that has come to rest (time.stationary): its energy may be flat while the membrane still moves.
#pragma once

#include "common/case/problem.hpp"
#include "common/run/simulation.hpp"

namespace tubule {

// The energy is quadratic in the distance to a minimum and nearly flat along a soft mode: time.stationary = e allows
// distances of sqrt(e) times the size of the membrane, and changes of the energy of e E_ref.
class Stationarity : public Callback {
public:
    // The problem must outlive it.
    explicit Stationarity(const Problem& c) : case_(c) {}
    explicit Stationarity(Problem&&) = delete;

    std::optional<StopReport> after_step(const Simulation& run) override;
    void save(Record& record) const override;
    void restore(const Record& record) override;

    // Whether the membrane will move by no more than that until the end, if its speed (from the dissipation) continues
    // to fall at its present rate. Call it after every step. True where the speed does not fall: waiting is of no use.
    bool is_settled(double time, double dissipation, double area);

private:
    const Problem& case_;
    double since_ = 0, speed_since_ = -1;  // where the measurement of the rate began; -1: not yet
    double rate_ = 0, rate_is_known_ = 0;  // measured last; 1 once it was measured
};

}  // namespace tubule
