#include "tools/scan/scan_progress.hpp"

#include <fmt/core.h>

#include <algorithm>

namespace tubule {

ScanProgress::~ScanProgress() {
    if (drawn_) style_.wipe();
}

void ScanProgress::begin(std::size_t known) {
    begun_with_ = known;
    begun_at_ = style_.clock();
    next_ = begun_at_ + style_.interval();
}

void ScanProgress::operator()(std::size_t known, std::size_t wanted, bool follows) {
    if (style_.quiet) return;
    const double now = style_.clock();
    if (now < next_) return;
    next_ = now + style_.interval();
    wanted = std::max(wanted, known);
    const double left =
        (now - begun_at_) / static_cast<double>(known - begun_with_) * static_cast<double>(wanted - known);
    const auto words = fmt::format("{} of {} points{}, left {}", known, wanted, follows ? " so far" : "",
                                   (follows ? "at least " : "") + duration(left));
    style_.show(ProgressStyle::bar_width * known / std::max<std::size_t>(wanted, 1), words);
    drawn_ = true;
}

}  // namespace tubule
