#include "common/run/stationarity.hpp"

#include <algorithm>
#include <cmath>

namespace tubule {
namespace {

constexpr double window =
    0.01;  // of the time left: the rate is measured over this long; its first measurement is skipped

// Bound of the change of the energy until the end, from the present dissipation, kinetic energy and acceleration.
double change_until(double end, double time, const Energetics& e) {
    const double left = end - time;
    return std::max({e.dissipation * left, e.kinetic, e.acceleration * left * left});
}

template <class Fields, class Numbers>
void fields(Fields&& f, Numbers& numbers) {
    f.number("restart_callback_settling_since", numbers[0]), f.number("restart_callback_settling_speed", numbers[1]);
    f.number("restart_callback_settling_rate", numbers[2]), f.number("restart_callback_settling_known", numbers[3]);
}

}  // namespace

std::optional<StopReport> Stationarity::after_step(const Simulation& run) {
    const double t = run.time();
    const Energetics e = run.energetics();
    if (std::isfinite(next_kink(case_.law, t * (1 + 1e-12))) || !is_settled(t, e.dissipation, e.area))
        return std::nullopt;
    if (change_until(case_.time.end, t, e) >= *case_.time.stationary * run.summary.reference_energy)
        return std::nullopt;
    return StopReport{Stop::stationary, t, "the energy no longer changes by more than time.stationary allows", ""};
}

void Stationarity::save(Record& record) const {
    const double numbers[] = {since_, speed_since_, rate_, rate_is_known_};
    fields(RecordWriter(record), numbers);
}

void Stationarity::restore(const Record& record) {
    if (!find_number(record, "restart_callback_settling_since")) return;
    double numbers[4];
    fields(RecordReader(record), numbers);
    since_ = numbers[0], speed_since_ = numbers[1], rate_ = numbers[2], rate_is_known_ = numbers[3];
}

bool Stationarity::is_settled(double time, double dissipation, double area) {
    const double size = std::sqrt(area / (4 * pi)), drag = case_.law.friction + case_.law.viscosity / (size * size);
    const double speed = std::sqrt(std::max(dissipation, 0.0) / (drag * area));
    if (!(speed > 0)) return true;
    const double left = case_.time.end - time, passed = time - since_;
    if (speed_since_ < 0) {
        since_ = time, speed_since_ = 0;  // what fades fast fades first
    } else if (passed >= window * (left + passed)) {
        if (speed_since_ > 0) rate_ = std::log(speed_since_ / speed) / passed, rate_is_known_ = 1;
        since_ = time, speed_since_ = speed;
    }
    if (rate_is_known_ == 0) return false;
    return !(rate_ > 0) || speed * std::min(1 / rate_, left) < std::sqrt(case_.time.stationary.value_or(0)) * size;
}

}  // namespace tubule
