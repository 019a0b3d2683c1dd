#include "tools/auto/auto_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "axisym/run_profile.hpp"
#include "common/case/problem.hpp"
#include "common/run/run_clock.hpp"
#include "common/run/run_observer.hpp"
#include "common/series/table.hpp"
#include "common/solve/pause.hpp"
#include "surface3d/run/motion_settings.hpp"
#include "surface3d/run/run_surface.hpp"
#include "tools/auto/joined_file.hpp"
#include "tools/auto/noise_growth.hpp"
#include "tools/auto/waves.hpp"

namespace tubule {

namespace {

// ---- an axisymmetric run as it goes: noise grows along it, until it is too large

constexpr double rough_rates = 0.1;  // error, relative

// The numbers wave_1, wave_2, ... of a frame: amplitudes that noise has reached, relative to the largest radius.
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

// How well the rates are known.
struct RatesKnown {
    int states = 0, unknown = 0, estimated = 0, rough = 0;
    std::string why_unknown;  // the last time
};

class ProfileWatch : public TierPart {
public:
    // The case must outlive it. Frames at the times `only_for_rates` do not go to the file.
    ProfileWatch(const Problem& c, RunObserver& file, RowMap map, std::set<double> only_for_rates);

    // Resumes from a frame of the file, with the amplitudes stored there.
    void resume(const Record& frame);

    void frame(const std::function<Record()>& make) override;
    void checkpoint(const Record& state) override;
    void discard() override;
    bool interrupted() override { return reached_ || TierPart::interrupted(); }

    const NoiseGrowth& growth() const { return growth_; }
    const RatesKnown& known() const { return known_; }
    // When, and with which wave, the run must go on in three dimensions.
    const std::optional<NoiseGrowth::Peak>& reached() const { return reached_; }
    const std::optional<Record>& last_frame() const { return last_frame_; }

private:
    void look_at(const Record& frame);
    std::vector<double> last_rates() const;
    Record with_amplitudes(Record frame) const;

    const Problem& case_;
    std::set<double> only_for_rates_;
    NoiseGrowth growth_;
    RatesKnown known_;
    double last_time_ = -1;
    std::optional<NoiseGrowth::Peak> reached_;
    std::optional<Record> last_frame_;
};

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

// ---- the run

// Times at which rates are found, beside those of frames: so many equal parts of the run, and the first of them halved
// so often, for what is quick at the start.
constexpr int parts = 48, halvings = 12;
// A wave this many times the noise has grown, and is handed over with the largest one.
constexpr double grown = 2;
// Error of the logarithm of an amplitude, in e-folds, above which the time of the switch is reported as uncertain.
constexpr double uncertain = 0.3;

std::vector<double> until(const std::vector<double>& times, double end) {
    std::vector<double> out;
    for (const double t : times)
        if (t < end) out.push_back(t);
    return out;
}

// Besides the output times of the case; rates have kinks where loads have them.
std::set<double> times_for_rates(const Problem& c) {
    std::set<double> out;
    const MotionLaw& law = c.law;
    for (double t = next_kink(law, 0); t < c.time.end; t = next_kink(law, t)) out.insert(t);
    for (int i = 1; i < parts; ++i) out.insert(c.time.end * i / parts);
    for (int i = 1; i <= halvings; ++i) out.insert(c.time.end / parts * std::pow(0.5, i));
    for (const double t : c.time.output) out.erase(t);
    return out;
}

// Stored with the profile from which a run in three dimensions starts, besides its waves.
struct Switch {
    int m = 0;                               // of the wave that has become too large
    double reference_energy = 0, error = 0;  // of the part before
};
template <class Fields, class State>
void switch_fields(Fields&& f, State& s) {
    f.number("switch_m", s.m), f.number("switch_E_ref", s.reference_energy), f.number("switch_error", s.error);
}

bool is_switch(const Record& record) {
    return !record.mesh && find_number(record, "switch_m");
}

std::string percent(double amplitude) {
    return fmt::format("{:.3g} of the radius", amplitude);
}

// Warnings about uncertain rates; empty if there are none.
std::string doubts(const Problem& c, const RatesKnown& known, const NoiseGrowth& growth) {
    std::string out;
    const auto say = [&](const std::string& words) { out += (out.empty() ? "" : "; ") + words; };
    if (known.unknown > 0)
        say(
            fmt::format("the growth rates of waves are unknown at {} of {} times; earlier ones were used instead "
                        "({})",
                        known.unknown, known.states, known.why_unknown));
    if (known.rough > 0)
        say(fmt::format("the growth rates of waves are known to 10 % at best at {} of {} times", known.rough,
                        known.states));
    if (known.estimated > 0)
        say(fmt::format("the shape moves at {} of {} times: growth rates there neglect the effect of its flow on waves",
                        known.estimated, known.states));
    const NoiseGrowth::Peak peak = growth.largest();
    if (peak.m == growth.modes() && peak.amplitude > grown * c.automatic.noise)
        say(fmt::format("m = {} grows most and is the largest m considered: a larger auto.modes may show faster waves",
                        peak.m));
    if (peak.m > 0 && growth.error(peak.m) > uncertain)
        say(fmt::format("the growth of m = {} is known only to within a factor of {:.2g}", peak.m,
                        std::exp(growth.error(peak.m))));
    return out;
}

// That loads have done by the last row; 0 where none changes.
double work_of(const Before& before, const std::vector<std::string>& names) {
    const double work = value_in(before.rows.back(), names, "work");
    return std::isnan(work) ? 0 : work;
}

void add_doubts(RunSummary& s, const Problem& c, const RatesKnown& known, const NoiseGrowth& growth) {
    if (const std::string words = doubts(c, known, growth); !words.empty()) s.warnings.push_back(words);
}

void set_choice(RunSummary& s, const std::string& choice, const std::string& reason) {
    s.details.insert(s.details.begin(), {{"choice", choice}, {"reason", reason}});
}

// On few triangles where these do, as docs/choosing.md has it; again as tier surface3d would choose them where the
// error is larger than requested. A resumed run has the triangles that it had.
RunSummary on_triangles(const Problem& c, const surface3d::Start& start, SurfacePart& part, const Restart* restart) {
    if (restart || !c.accuracy.estimate || !few_triangles_do(c, start))
        return surface3d::run_surface(c, start, part, restart);
    Case few = c;
    few.surface.elements = surface3d::least_triangles;
    RunSummary s = surface3d::run_surface(few, start, part, nullptr);
    if (!s.as_accurate_as_asked && !can_go_on(s.stop.reason)) {
        part.discard();
        return surface3d::run_surface(c, start, part, nullptr);
    }
    s.details.emplace_back("triangles",
                           fmt::format("{}, since the initial shape is smooth", surface3d::least_triangles));
    return s;
}

// Why a run stayed axisymmetric.
std::string why_axisymmetric(const Problem& c, const NoiseGrowth& growth) {
    const NoiseGrowth::Peak peak = growth.largest();
    if (peak.amplitude <= c.automatic.noise * (1 + 1e-12))
        return fmt::format("the initial shape and the model are axisymmetric, and no mode grows (m = 1 to {})",
                           growth.modes());
    return fmt::format(
        "the initial shape and the model are axisymmetric, and modes m > 0 stay small: at most {} (m = {} at t = "
        "{:.6g})",
        percent(peak.amplitude), peak.m, peak.time);
}

// Rows and frames of the axisymmetric part on their way to the file, kept for later. Its last frame is held back.
class FirstPart : public TierPart {
public:
    FirstPart(RunObserver& file, RowMap map, const NoiseGrowth& growth, double end)
        : TierPart(file, std::move(map)), growth_(growth), end_(end) {}
    void row(std::span<const double> values) override {
        before.rows.push_back(map_(values));
        PassingOn::row(before.rows.back());
    }
    void frame(const std::function<Record()>& make) override {
        Record record = make();
        set_amplitudes(record, amplitudes_at(growth_, record.time));
        if (record.time == end_)
            last = std::move(record);
        else
            write(std::move(record));
    }
    void write(Record record) {
        TierPart::frame([&] { return record; });
        before.frames.push_back(std::move(record));
    }
    void discard() override {
        TierPart::discard();
        before = {};
        last.reset();
    }

    Before before;
    std::optional<Record> last;

private:
    const NoiseGrowth& growth_;
    double end_;
};

class AutoRun {
public:
    AutoRun(const Problem& c, const Choice& choice, RunObserver& file)
        : case_(c),
          file_(file),
          clock_(c.time, file),
          choice_(choice),
          names_(joined_series_names(c, choice.axisymmetric)) {}

    RunSummary in_three_dimensions(const Restart* restart);
    RunSummary axisymmetric(const Restart* restart);
    // From the frame of the switch, or from a state after it.
    RunSummary after_switch(const Record& at, const Before& before, const Restart* restart);

private:
    RowMap axisym_rows() const { return {names_, axisym::series_names(case_.of_profile(case_.time.end, {})), 1}; }
    RunSummary watched(ProfileWatch& watch, const std::set<double>& for_rates, const Restart* restart);
    RunSummary with_switch(const NoiseGrowth::Peak& at, const ProfileWatch& watch);

    const Problem& case_;
    RunObserver& file_;
    RunClock clock_;  // of all parts together
    const Choice& choice_;
    std::vector<std::string> names_;
    std::vector<std::string> warnings_;  // of the part before
    std::string effort_;
};

RunSummary AutoRun::in_three_dimensions(const Restart* restart) {
    if (!restart) file_.note(fmt::format("tier surface3d: {}", choice_.reason));
    const Problem c = case_.of_surface();
    const Before nothing;
    SurfacePart part(file_, {names_, surface3d::series_names(c), 2}, nothing);
    RunSummary s = on_triangles(c, *choice_.start, part, restart);
    set_choice(s, "surface3d", choice_.reason);
    return s;
}

// A run that is stationary, but for waves that will be too large before its end, goes on: they would be missed
// otherwise.
RunSummary AutoRun::watched(ProfileWatch& watch, const std::set<double>& for_rates, const Restart* restart) {
    std::vector<double> output = case_.time.output;
    output.insert(output.end(), for_rates.begin(), for_rates.end());
    std::sort(output.begin(), output.end());
    Case c = case_.of_profile(case_.time.end, output);
    RunSummary s = axisym::run_profile(c, watch, restart);
    const NoiseGrowth& growth = watch.growth();
    if (s.stop.reason != Stop::stationary || growth.empty() || watch.reached()) return s;
    for (int m = 1; m <= growth.modes(); ++m) {
        const double end =
            growth.amplitude(m, s.stop.time) * std::exp(growth.last_rate(m) * (c.time.end - s.stop.time));
        if (end < case_.automatic.largest) continue;
        c.time.stationary.reset();
        const Restart from{*watch.last_frame()};
        return axisym::run_profile(c, watch, &from);
    }
    return s;
}

RunSummary AutoRun::axisymmetric(const Restart* restart) {
    const std::set<double> for_rates = times_for_rates(case_);
    ProfileWatch watch(case_, file_, axisym_rows(), for_rates);
    if (restart) watch.resume(restart->record);
    RunSummary s = watched(watch, for_rates, restart);
    if (watch.reached()) return with_switch(*watch.reached(), watch);
    set_choice(s, "axisym", why_axisymmetric(case_, watch.growth()));
    add_doubts(s, case_, watch.known(), watch.growth());
    return s;
}

RunSummary AutoRun::with_switch(const NoiseGrowth::Peak& at, const ProfileWatch& watch) {
    file_.discard();
    Case c = case_.of_profile(at.time, until(case_.time.output, at.time));
    c.time.stationary.reset();
    FirstPart part(file_, axisym_rows(), watch.growth(), at.time);
    RunSummary s = axisym::run_profile(c, part);
    add_doubts(s, case_, watch.known(), watch.growth());
    if (s.stop.reason != Stop::finished || !part.last) {
        if (part.last) part.write(*part.last);
        set_choice(s, "axisym", fmt::format("m = {} would be too large at t = {:.6g}", at.m, at.time));
        return s;
    }
    Record last = *part.last;
    const Switch known{at.m, s.reference_energy, s.estimated_error};
    switch_fields(RecordWriter(last), known);
    part.write(last);
    warnings_ = s.warnings, effort_ = s.effort;
    return after_switch(last, part.before, nullptr);
}

RunSummary AutoRun::after_switch(const Record& at, const Before& before, const Restart* restart) {
    Switch known;
    switch_fields(RecordReader(at), known);
    const int m = known.m;
    std::vector<double> amplitudes = amplitudes_of(at);
    const double largest = amplitudes.at(m - 1);
    const std::string reason = fmt::format("the non-axisymmetric mode m = {} grows from {:.3g} to {} at t = {:.6g}", m,
                                           case_.automatic.noise, percent(largest), at.time);
    file_.note(fmt::format("from tier axisym to surface3d: {}", reason));
    for (double& a : amplitudes)
        if (a < grown * case_.automatic.noise && a < largest) a = 0;

    RunSummary s = clock_.pausing([&] {
        Case handed = case_.of_surface();
        handed.handover =
            Handover{perturbed_curve(case_, at, amplitudes), at.time, known.reference_energy, work_of(before, names_)};
        const Problem c = handed;
        SurfacePart part(file_, {names_, surface3d::series_names(c), 2}, before);
        return on_triangles(c, surface3d::Start(c), part, restart);
    });
    s.stop.time = std::max(s.stop.time, at.time);  // where it pauses before the first state in three dimensions
    s.estimated_error = std::max(s.estimated_error, known.error);
    s.as_accurate_as_asked = s.as_accurate_as_asked && known.error <= case_.accuracy.energy;
    s.warnings.insert(s.warnings.begin(), warnings_.begin(), warnings_.end());
    if (!effort_.empty()) s.effort = fmt::format("{}, then {}", effort_, s.effort);
    set_choice(s, "axisym, then surface3d", reason);
    s.details.insert(s.details.end(),
                     {{"switch_time", at.time}, {"switch_mode", std::int64_t{m}}, {"switch_amplitude", largest}});
    return s;
}

}  // namespace

RunSummary run_auto(const Problem& c, const Choice& choice, RunObserver& file, const Restart* restart,
                    const Result* unfinished) {
    AutoRun run(c, choice, file);
    if (!choice.axisymmetric) return run.in_three_dimensions(restart);
    if (!restart) return run.axisymmetric(nullptr);
    if (!restart->record.mesh && !is_switch(restart->record)) return run.axisymmetric(restart);
    if (!unfinished)
        throw std::invalid_argument("resuming a run of tier \"auto\" in three dimensions needs its result file");
    const Before before = axisymmetric_part(*unfinished);
    if (before.frames.empty() || !is_switch(before.frames.back()))
        throw std::runtime_error("the result has no frame at which its run switched to three dimensions");
    return run.after_switch(before.frames.back(), before, restart->record.mesh ? restart : nullptr);
}

}  // namespace tubule
