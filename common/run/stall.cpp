#include "common/run/stall.hpp"

#include <fmt/format.h>

namespace tubule {
namespace {

constexpr double least_progress = 1e-3;  // increase of the time that counts as progress, relative
constexpr double least_fall = 0.1;       // fall of the energy that does, relative to the tolerance

}  // namespace

std::optional<StopReport> Stall::after_step(const Simulation& run) {
    return look(run.time(), run.step_size(), run.energetics().total_least / run.summary.reference_energy);
}

std::optional<StopReport> Stall::look(double time, double step, double least) {
    if (time > (1 + least_progress) * time_ || least < energy_ - least_fall * accuracy_) {
        time_ = time, energy_ = least, steps_ = 0;
        return std::nullopt;
    }
    if (++steps_ <= most_steps_ || step >= tiny_) return std::nullopt;
    return StopReport{Stop::solver_failed, time, fmt::format("no progress with steps of {:.2g}", step), advice_};
}

void Stall::save(Record& record) const {
    RecordWriter out(record);
    out.number("restart_callback_stall_steps", steps_), out.number("restart_callback_stall_time", time_);
    out.number("restart_callback_stall_energy", energy_);
}

void Stall::restore(const Record& record) {
    if (!find_number(record, "restart_callback_stall_steps")) return;
    const RecordReader in(record);
    in.number("restart_callback_stall_steps", steps_), in.number("restart_callback_stall_time", time_);
    in.number("restart_callback_stall_energy", energy_);
}

}  // namespace tubule
