#include "common/solve/progress.hpp"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "common/solve/message.hpp"

namespace tubule {
namespace {

constexpr double bar_interval = 0.1, line_interval = 10, first_line = 1;  // seconds
constexpr double least_known = 0.05;  // of the time of the run: before, nothing is said of what is left

}  // namespace

bool ProgressStyle::is_terminal(std::FILE* file) {
    return isatty(fileno(file)) == 1;
}

double ProgressStyle::wall() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double ProgressStyle::interval() const {
    return terminal ? bar_interval : line_interval;
}

void ProgressStyle::show(std::size_t marks, const std::string& words) const {
    if (terminal)
        say(out, "\r[{}{}] {}\x1b[K", std::string(marks, '#'), std::string(bar_width - marks, '.'), words);
    else
        say(out, "{}\n", words);
}

void ProgressStyle::wipe() const {
    if (terminal) put_words(out, "\r\x1b[K");
}

std::string duration(double seconds) {
    if (!(seconds < 1e9)) return "?";  // also not a number
    const long s = std::lround(seconds);
    if (s >= 3600) return fmt::format("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60);
    return s >= 60 ? fmt::format("{}:{:02}", s / 60, s % 60) : fmt::format("{} s", s);
}

Progress::Progress(double begin, double end, ProgressStyle style)
    : begin_(begin), end_(end), style_(std::move(style)), last_time_(begin), last_wall_(style_.clock()) {
    next_ = last_wall_ + std::min(style_.interval(), first_line);
}

Progress::~Progress() {
    if (drawn_) style_.wipe();
}

void Progress::next_run(int number, int of) {
    run_ = of > 1 ? fmt::format("run {} of at least {}  ", number, of) : "";
    last_time_ = begin_, last_wall_ = style_.clock(), speed_ = 0;
}

void Progress::operator()(double time, double energy, double step) {
    if (style_.quiet) return;
    const double now = style_.clock();
    if (now >= next_) show(time, energy, step, now);
}

void Progress::show(double time, double energy, double step, double now) {
    if (time < last_time_) last_time_ = begin_, speed_ = 0;  // the run has begun again
    // Steps grow by orders of magnitude during a run: only its recent speed says what is left.
    const double recent = (time - last_time_) / (now - last_wall_);
    speed_ = speed_ > 0 ? 0.7 * speed_ + 0.3 * recent : recent;
    last_time_ = time;
    last_wall_ = now;
    next_ = now + style_.interval();

    const double fraction = std::clamp((time - begin_) / (end_ - begin_), 0.0, 1.0);
    auto words = fmt::format("{}{:3.0f}%  time {:.4g} of {:.4g}  energy {:.6g}  step {:.2g}", run_, 100 * fraction,
                             time, end_, energy, step);
    if (fraction >= least_known && speed_ > 0)
        words += fmt::format("  left {}", duration(std::max(end_ - time, 0.0) / speed_));
    style_.show(static_cast<std::size_t>(fraction * ProgressStyle::bar_width), words);
    drawn_ = true;
}

}  // namespace tubule
