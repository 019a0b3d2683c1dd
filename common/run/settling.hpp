// Whether a surface that relaxes has come to rest: its energy may be flat while it still moves.
#pragma once

#include <optional>

#include "common/case/case.hpp"

namespace tubule {

// Energy is quadratic in the distance to a minimum, and little changes along a soft mode: time.stationary = e allows
// for distances of sqrt(e) of the size of the surface.
class Settling {
public:
    // Whether the surface is expected to move by no more than that from now on: at its present speed, as the
    // dissipation tells it, and at the rate at which that falls, until the end. To be asked after every step. True
    // where the speed does not fall: then nothing settles.
    bool is_settled(const Case& c, double time, double dissipation, double area);

private:
    double since_ = 0, speed_since_ = -1;  // when the rate began to be measured; not yet
    std::optional<double> rate_;           // measured last
};

}  // namespace tubule
