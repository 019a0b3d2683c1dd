// Progress of a run: a bar on a terminal, a line from time to time elsewhere.
#pragma once

#include <cstdio>
#include <functional>
#include <string>

namespace tubule {

struct ProgressStyle {
    bool quiet = false;                    // nothing at all
    std::FILE* out = stderr;               // results go to stdout
    bool terminal = is_terminal(stderr);   // bar, redrawn at most 10 times a second; else a line every 10 s,
                                           // the first after 1 s, so that short runs are silent
    std::function<double()> clock = wall;  // seconds

    static bool is_terminal(std::FILE* file);
    static double wall();

    static constexpr std::size_t bar_width = 24;
    double interval() const;  // seconds between two times that something is shown
    // So many of the marks of the bar, where there is one, and words.
    void show(std::size_t marks, const std::string& words) const;
    void wipe() const;  // the bar
};

// One object a run; the bar is wiped when it goes out of scope.
class Progress {
public:
    Progress(double begin, double end, ProgressStyle style = {});
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;
    ~Progress();

    // A run begins, of `of` as far as is known; it is named where there are several.
    void next_run(int number, int of);
    // Call after every step with the time reached, the energy and the step size; costs one reading of the clock.
    void operator()(double time, double energy, double step);

private:
    void show(double time, double energy, double step, double now);

    double begin_, end_;
    std::string run_;  // which one, in words
    ProgressStyle style_;
    double next_;  // when to show something again
    double last_time_, last_wall_;
    double speed_ = 0;  // simulated time per second, smoothed over the last lines shown
    bool drawn_ = false;
};

// "1:02:03", "4:05", "12 s"; "?" when not finite.
std::string duration(double seconds);

}  // namespace tubule
