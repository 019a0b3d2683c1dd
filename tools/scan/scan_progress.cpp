#include "tools/scan/scan_progress.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <string>

namespace tubule {
namespace {

constexpr double bar_interval = 0.1, line_interval = 10;  // seconds
constexpr std::size_t bar_width = 24;

}  // namespace

ScanProgress::~ScanProgress() {
    if (!drawn_ || !style_.terminal) return;
    std::fputs("\r\x1b[K", style_.out);
    std::fflush(style_.out);
}

void ScanProgress::begin(std::size_t known) {
    begun_with_ = known;
    begun_at_ = style_.clock();
    next_ = begun_at_ + (style_.terminal ? bar_interval : line_interval);
}

void ScanProgress::operator()(std::size_t known, std::size_t wanted, bool follows) {
    if (style_.quiet) return;
    const double now = style_.clock();
    if (now < next_) return;
    next_ = now + (style_.terminal ? bar_interval : line_interval);
    wanted = std::max(wanted, known);
    const double left =
        (now - begun_at_) / static_cast<double>(known - begun_with_) * static_cast<double>(wanted - known);
    const auto words = fmt::format("{} of {} points{}, left {}", known, wanted, follows ? " so far" : "",
                                   (follows ? "at least " : "") + duration(left));
    if (style_.terminal) {
        const std::size_t full = bar_width * known / std::max<std::size_t>(wanted, 1);
        fmt::print(style_.out, "\r[{}{}] {}\x1b[K", std::string(full, '#'), std::string(bar_width - full, '.'), words);
    } else {
        fmt::print(style_.out, "{}\n", words);
    }
    std::fflush(style_.out);
    drawn_ = true;
}

}  // namespace tubule
