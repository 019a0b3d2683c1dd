#include "common/run/error_scale.hpp"

#include <fmt/format.h>

#include <cmath>

namespace tubule {
namespace {

constexpr double no_change = 1e-9;  // of E_ref: a surface that was at rest

}  // namespace

std::string doubt_before(const Case& c, double energy, double E_ref) {
    const double allowed = c.accuracy.energy * E_ref;
    if (!(allowed > std::abs(energy)) || !std::isfinite(allowed)) return "";
    const std::string doubt = fmt::format(
        "accuracy.energy = {:.2g} allows for an error of {:.3g}, as E_ref = {:.4g}, but the energy of the start is "
        "{:.3g}",
        c.accuracy.energy, allowed, E_ref, energy);
    if (energy == 0) return doubt;
    return fmt::format("{}: ask for less than {:.1g}", doubt, std::abs(energy) / E_ref);
}

std::string doubt_after(const Case& c, Stop stop, double start, double end, double E_ref) {
    const double allowed = c.accuracy.energy * E_ref, change = std::abs(end - start);
    if (kind_of(stop).exit_code != 0 || !(allowed > change) || change <= no_change * E_ref) return "";
    return fmt::format(
        "accuracy.energy = {:.2g} allows for an error of {:.3g}, as E_ref = {:.4g}, but the energy changed by only "
        "{:.3g}: ask for less than {:.1g}",
        c.accuracy.energy, allowed, E_ref, change, change / E_ref);
}

}  // namespace tubule
