// Long work that ends in time: now and then it asks whether a time limit has passed or a signal has come.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <functional>
#include <optional>

#include "common/solve/stop.hpp"

namespace tubule {

// Thrown by check_pause(), and caught where the state can be saved. It is no std::exception: nothing has failed, and
// what handles failures lets it pass.
struct Paused {
    Stop reason;  // time_limit or interrupted
    std::optional<double> limit;
};

// While it lives, work of this thread pauses for the reasons given. They nest: work pauses as soon as one is due.
class PauseWatch {
public:
    // `limit`: of wall time from now on, in seconds; none without it. `interrupted` is called from any thread.
    PauseWatch(std::optional<double> limit, std::function<bool()> interrupted);
    ~PauseWatch();
    PauseWatch(const PauseWatch&) = delete;
    PauseWatch& operator=(const PauseWatch&) = delete;

    // Since the outermost watch of this thread was made.
    double seconds() const;
    // That much of the time past does not count; a negative one counts, though it passed before. For the outermost
    // watch, before others are made.
    void discount(double seconds);
    // Why it is time to pause, if it is: asked between steps, where the state is at hand.
    std::optional<Paused> due() const;

private:
    friend class SharedPause;
    friend void check_pause(double);
    friend void pause_if_due();
    std::optional<Paused> overdue(double ahead);

    std::optional<double> limit_;
    std::function<bool()> interrupted_;
    PauseWatch* outer_;
    double before_;  // seconds() when it was made
    std::chrono::steady_clock::time_point started_;
    std::atomic<double> interrupted_at_ = -1;
    bool told_ = false;
};

// Asked within steps and starts, whose work is lost by a pause: throws Paused where a watch of this thread has been due
// for a quarter of a second. The innermost one throws once: what saves the state afterwards is left alone.
// `ahead`: the seconds that work will take which nothing can end; a limit that this would exceed by much is as good as
// passed. To be called outside parallel regions, and from no callback of a C library.
void check_pause(double ahead = 0);
// Whether a watch of this thread is due.
bool pause_is_due();
// Asked after a trial run, which may have ended because a watch around it was due: throws Paused at once if one is.
void pause_if_due();

// The same for loops on several threads and for callbacks. Made outside of them; asked anywhere.
class SharedPause {
public:
    SharedPause();
    // Looks at the clock. Once it is true the loop is to do nothing more, and its results are of no use.
    bool look();
    // Looks every now and then; the number of the call.
    bool look(std::size_t call) { return call % 256 == 0 ? look() : wanted(); }
    bool wanted() const { return wanted_.load(std::memory_order_relaxed); }
    // After the loop: throws Paused if it was to end.
    void check() const {
        if (wanted()) check_pause();
    }

private:
    PauseWatch* watch_;
    std::atomic<bool> wanted_ = false;
};

}  // namespace tubule
