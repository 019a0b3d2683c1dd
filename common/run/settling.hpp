// Whether a surface that relaxes has come to rest: its energy may be flat while it still moves.
#pragma once

#include <optional>

#include "common/case/case.hpp"

namespace tubule {

// The energy is quadratic in the distance to a minimum and nearly flat along a soft mode: time.stationary = e allows
// distances of sqrt(e) times the size of the surface.
class Settling {
public:
    // Whether the surface will move by no more than that until the end, if its speed (from the dissipation) goes on to
    // fall at its present rate. Call it after every step. True where the speed does not fall: waiting would not help.
    bool is_settled(const Case& c, double time, double dissipation, double area);

private:
    double since_ = 0, speed_since_ = -1;  // where the measurement of the rate began; -1: not yet
    std::optional<double> rate_;           // measured last
};

}  // namespace tubule
