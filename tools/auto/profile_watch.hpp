// An axisymmetric run of tier "auto" as it goes: noise grows along it, until it is too large.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "common/case/problem.hpp"
#include "common/run/run.hpp"
#include "tools/auto/joined_file.hpp"
#include "tools/auto/noise_growth.hpp"

namespace tubule {

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

// The numbers wave_1, wave_2, ... of a frame: amplitudes that noise has reached, relative to the largest radius.
void set_amplitudes(Record& frame, const std::vector<double>& amplitudes);
std::vector<double> amplitudes_of(const Record& frame);
std::vector<double> amplitudes_at(const NoiseGrowth& growth, double time);

}  // namespace tubule
