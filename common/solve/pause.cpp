#include "common/solve/pause.hpp"

#include <algorithm>
#include <utility>

namespace tubule {
namespace {

constexpr double patience = 0.25;  // seconds in which a step may come to its end

thread_local PauseWatch* current = nullptr;

}  // namespace

PauseWatch::PauseWatch(std::optional<double> limit, std::function<bool()> interrupted)
    : limit_(limit),
      interrupted_(std::move(interrupted)),
      outer_(std::exchange(current, this)),
      before_(outer_ ? outer_->seconds() : 0),
      started_(outer_ ? outer_->started_ : std::chrono::steady_clock::now()) {}

PauseWatch::~PauseWatch() {
    current = outer_;
}

double PauseWatch::seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - started_).count();
}

void PauseWatch::discount(double seconds) {
    started_ += std::chrono::duration_cast<std::chrono::steady_clock::duration>(std::chrono::duration<double>(seconds));
}

std::optional<Paused> PauseWatch::due() const {
    if (limit_ && seconds() - before_ > *limit_) return Paused{Stop::time_limit, limit_};
    if (interrupted_()) return Paused{Stop::interrupted, limit_};
    return outer_ ? outer_->due() : std::nullopt;
}

std::optional<Paused> PauseWatch::overdue(double ahead) {
    const double now = seconds() - before_;
    if (limit_ && now + ahead > *limit_ + std::max(patience, ahead > 0 ? 0.05 * *limit_ : 0))
        return Paused{Stop::time_limit, limit_};
    if (interrupted_()) {
        double never = -1;
        interrupted_at_.compare_exchange_strong(never, now);
        if (now + ahead > interrupted_at_ + patience) return Paused{Stop::interrupted, limit_};
    }
    return outer_ && !outer_->told_ ? outer_->overdue(ahead) : std::nullopt;
}

void check_pause(double ahead) {
    if (!current || current->told_) return;
    if (const auto pause = current->overdue(ahead)) {
        current->told_ = true;
        throw Paused(*pause);
    }
}

bool pause_is_due() {
    return current && current->due();
}

void pause_if_due() {
    if (!current) return;
    if (const auto pause = current->due()) throw Paused(*pause);
}

SharedPause::SharedPause() : watch_(current && !current->told_ ? current : nullptr) {}

bool SharedPause::look() {
    if (!wanted() && watch_ && watch_->overdue(0)) wanted_.store(true, std::memory_order_relaxed);
    return wanted();
}

}  // namespace tubule
