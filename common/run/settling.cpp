#include "common/run/settling.hpp"

#include <algorithm>
#include <cmath>

namespace tubule {
namespace {

constexpr double window = 0.01;  // of the time left: the rate is measured over this long; its first measurement is skipped

}  // namespace

bool Settling::is_settled(const Case& c, double time, double dissipation, double area) {
    const MotionLaw law = motion_law(c.model);
    const double size = std::sqrt(area / (4 * pi)), drag = law.friction + law.viscosity / (size * size);
    const double speed = std::sqrt(std::max(dissipation, 0.0) / (drag * area));
    if (!(speed > 0)) return true;
    const double left = c.time.end - time, passed = time - since_;
    if (speed_since_ < 0) {
        since_ = time, speed_since_ = 0;  // what fades fast fades first
    } else if (passed >= window * (left + passed)) {
        if (speed_since_ > 0) rate_ = std::log(speed_since_ / speed) / passed;
        since_ = time, speed_since_ = speed;
    }
    if (!rate_) return false;
    return !(*rate_ > 0) || speed * std::min(1 / *rate_, left) < std::sqrt(c.time.stationary.value_or(0)) * size;
}

}  // namespace tubule
