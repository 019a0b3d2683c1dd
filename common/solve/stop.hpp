// Why a run ended. One list serves exit statuses, [expect], scans, pictures and docs/results.md.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

namespace tubule {

// For each reason: its name here and in files, the exit status of the program (0 as requested, 3 ended by the physics,
// 4 the numerics failed, 5 time limit, 130 interrupted; bad input, 2, never becomes a Stop), and when it is given.
// clang-format off
#define TUBULE_STOPS(reason) \
    reason(finished, "finished", 0, "the run reached `time.end`") \
    reason(stationary, "stationary", 0, "the shape is stationary within `time.stationary`") \
    reason(pinch_off, "pinch-off", 3, "a neck reached the floor `accuracy.r_min`") \
    reason(overhang, "overhang", 3, "a graph r(z) has a vertical tangent") \
    reason(ill_posed, "ill-posed", 3, "the flow is no longer parabolic: refinement does not help") \
    reason(undefined, "undefined", 3, "the formula of the energy is no longer defined") \
    reason(self_intersection, "self-intersection", 3, "the surface touches itself") \
    reason(resolution_lost, "resolution-lost", 4, "the discretisation can no longer represent the shape") \
    reason(mesh_lost, "mesh-lost", 4, "elements degenerated beyond repair") \
    reason(solver_failed, "solver-failed", 4, "the time integrator or the linear solver failed") \
    reason(time_limit, "time-limit", 5, "`time.limit` seconds of wall time have passed") \
    reason(interrupted, "interrupted", 130, "SIGINT or SIGTERM")
// clang-format on

enum class Stop {
#define TUBULE_STOP(id, name, exit, meaning) id,
    TUBULE_STOPS(TUBULE_STOP)
#undef TUBULE_STOP
};

struct StopKind {
    Stop reason;
    std::string_view name;  // "pinch-off" for Stop::pinch_off, and so on
    int exit_code;
    std::string_view meaning;
};
inline constexpr std::array stop_kinds{
#define TUBULE_STOP(id, name, exit, meaning) StopKind{Stop::id, name, exit, meaning},
    TUBULE_STOPS(TUBULE_STOP)
#undef TUBULE_STOP
};

constexpr const StopKind& kind_of(Stop reason) {
    return stop_kinds[static_cast<std::size_t>(reason)];
}
constexpr std::string_view name(Stop reason) {
    return kind_of(reason).name;
}
constexpr int exit_code(Stop reason) {
    return kind_of(reason).exit_code;
}
constexpr std::optional<Stop> stop_from_name(std::string_view name) {
    for (const StopKind& kind : stop_kinds)
        if (kind.name == name) return kind.reason;
    return std::nullopt;
}

// What happened, where and when, and what to try.
struct StopReport {
    Stop reason = Stop::finished;
    double time = 0;
    std::string message;  // e.g. "neck radius fell to 0.001 at z = 1.0"
    std::string advice;   // e.g. "lower accuracy.r_min to follow the neck further"
};

}  // namespace tubule
