#include "common/solve/stop.hpp"

#include <array>

namespace tubule {
namespace {

struct Entry {
    Stop reason;
    std::string_view name;
    int exit;
};
constexpr std::array<Entry, 11> entries{{{Stop::finished, "finished", 0},
                                         {Stop::stationary, "stationary", 0},
                                         {Stop::pinch_off, "pinch-off", 3},
                                         {Stop::overhang, "overhang", 3},
                                         {Stop::ill_posed, "ill-posed", 3},
                                         {Stop::self_intersection, "self-intersection", 3},
                                         {Stop::resolution_lost, "resolution-lost", 4},
                                         {Stop::mesh_lost, "mesh-lost", 4},
                                         {Stop::solver_failed, "solver-failed", 4},
                                         {Stop::time_limit, "time-limit", 5},
                                         {Stop::interrupted, "interrupted", 130}}};

const Entry& entry(Stop reason) {
    return entries[static_cast<std::size_t>(reason)];
}

}  // namespace

std::string_view name(Stop reason) {
    return entry(reason).name;
}

int exit_code(Stop reason) {
    return entry(reason).exit;
}

std::optional<Stop> stop_from_name(std::string_view name) {
    for (const auto& e : entries)
        if (e.name == name) return e.reason;
    return std::nullopt;
}

}  // namespace tubule
