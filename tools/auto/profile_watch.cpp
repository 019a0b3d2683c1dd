#include "tools/auto/profile_watch.hpp"

#include <fmt/format.h>

#include "common/solve/pause.hpp"
#include "tools/auto/waves.hpp"

namespace tubule {

namespace {
constexpr double rough_rates = 0.1;  // error, relative
}

ProfileWatch::ProfileWatch(const Problem& c, RunObserver& file, RowMap map, std::set<double> only_for_rates)
    : TierPart(file, std::move(map)),
      case_(c),
      only_for_rates_(std::move(only_for_rates)),
      growth_(c.automatic.noise, c.automatic.modes) {}

void ProfileWatch::resume(const Record& frame) {
    growth_.begin_with(amplitudes_of(frame));
    look_at(frame);
}

void ProfileWatch::look_at(const Record& frame) {
    if (reached_ || frame.time <= last_time_) return;
    last_time_ = frame.time;
    ++known_.states;
    std::vector<double> rates(growth_.modes(), 0.0);
    try {
        const WaveRates found = wave_rates(case_, frame);
        rates = found.rates;
        known_.estimated += found.estimated;
        known_.rough += found.accuracy > rough_rates;
    } catch (const std::exception& error) {
        ++known_.unknown;
        known_.why_unknown = error.what();
        rates = last_rates();
    } catch (const Paused&) {  // the run ends with its next step: until then
        rates = last_rates();
    }
    growth_.add(frame.time, rates);
    reached_ = growth_.reached(case_.automatic.largest);
}

std::vector<double> ProfileWatch::last_rates() const {
    std::vector<double> rates(growth_.modes(), 0.0);
    for (int m = 1; m <= growth_.modes() && !growth_.empty(); ++m) rates[m - 1] = growth_.last_rate(m);
    return rates;
}

void ProfileWatch::frame(const std::function<Record()>& make) {
    Record record = make();
    look_at(record);
    record = with_amplitudes(std::move(record));
    if (!only_for_rates_.contains(record.time)) TierPart::frame([&] { return record; });
    last_frame_ = std::move(record);
}

void ProfileWatch::checkpoint(const Record& state) {
    look_at(state);
    TierPart::checkpoint(with_amplitudes(state));
}

void ProfileWatch::discard() {
    TierPart::discard();
    growth_.forget();
    known_ = {};
    last_time_ = -1;
    last_frame_.reset();
}

Record ProfileWatch::with_amplitudes(Record frame) const {
    set_amplitudes(frame, amplitudes_at(growth_, frame.time));
    return frame;
}

void set_amplitudes(Record& frame, const std::vector<double>& amplitudes) {
    for (std::size_t i = 0; i < amplitudes.size(); ++i)
        frame.numbers.emplace_back(fmt::format("wave_{}", i + 1), amplitudes[i]);
}

std::vector<double> amplitudes_of(const Record& frame) {
    std::vector<double> out;
    for (const auto& [name, value] : frame.numbers)
        if (name == fmt::format("wave_{}", out.size() + 1)) out.push_back(value);
    return out;
}

std::vector<double> amplitudes_at(const NoiseGrowth& growth, double time) {
    std::vector<double> out;
    for (int m = 1; m <= growth.modes(); ++m) out.push_back(growth.amplitude(m, time));
    return out;
}

}  // namespace tubule
