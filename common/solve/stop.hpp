// Why a run ended. One list serves exit codes, [expect], scans and pictures.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace tubule {

enum class Stop {
    finished,           // reached time.end
    stationary,         // nothing moves any more, as asked by time.stationary
    pinch_off,          // a neck reached the floor accuracy.r_min
    overhang,           // a graph r(z) has got a vertical tangent
    ill_posed,          // the flow is no longer parabolic: no resolution helps
    self_intersection,  // the surface touches itself
    resolution_lost,    // the discretisation can no longer represent the shape
    mesh_lost,          // elements degenerated beyond repair
    solver_failed,      // time integrator or linear solver gave up
    time_limit,         // time.limit seconds of wall clock used
    interrupted         // SIGINT or SIGTERM
};

// "pinch-off" for Stop::pinch_off, and so on.
std::string_view name(Stop reason);
std::optional<Stop> stop_from_name(std::string_view name);

// Process exit status: 0 finished or stationary, 3 the physics ended it, 4 the numerics failed,
// 5 time limit, 130 interrupted. (2, bad input, never gets as far as a Stop.)
int exit_code(Stop reason);

// What happened, where and when, and what to try.
struct StopReport {
    Stop reason = Stop::finished;
    double time = 0;
    std::string message;  // e.g. "neck radius fell to 0.001 at z = 1.0"
    std::string advice;   // e.g. "lower accuracy.r_min to follow the neck further"
};

}  // namespace tubule
