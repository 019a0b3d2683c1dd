// Shows how far a scan has come: a bar on a terminal, a line every ten seconds elsewhere.
#pragma once

#include <cstddef>
#include <utility>

#include "common/solve/progress.hpp"

namespace tubule {

class ScanProgress {
public:
    explicit ScanProgress(ProgressStyle style = {}) : style_(std::move(style)) {}
    ScanProgress(const ScanProgress&) = delete;
    ~ScanProgress();

    void begin(std::size_t known);  // points that are done before anything is run
    // Points done and wanted; `follows`: more may be added, so that no remaining time is shown.
    void operator()(std::size_t known, std::size_t wanted, bool follows);

private:
    ProgressStyle style_;
    std::size_t begun_with_ = 0;
    double begun_at_ = 0, next_ = 0;
    bool drawn_ = false;
};

}  // namespace tubule
