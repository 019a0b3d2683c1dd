#include "tools/scan/outcome.hpp"

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "axisym/curve/vesicle_families.hpp"

namespace tubule {
namespace {

constexpr std::array<std::string_view, n_outcomes> names{
    "not-run",           "uniform-tube", "unduloid",  "sphere",  "closed", "pinched",     "overhang", "ill-posed",
    "self-intersection", "failed",       "undecided", "prolate", "oblate", "stomatocyte", "pear"};

bool is_sphere(double area, double volume) {
    return 6 * std::sqrt(std::numbers::pi) * volume / std::pow(area, 1.5) > 1 - axisym::volume_off_sphere;
}

Outcome at_rest(const EndShape& end) {
    if (end.periodic)
        return end.r_max - end.r_min < waves_of_uniform_tube * (end.r_max + end.r_min) ? Outcome::uniform_tube
                                                                                       : Outcome::unduloid;
    return is_sphere(end.area, end.volume) ? Outcome::sphere : Outcome::closed;
}

}  // namespace

std::string_view name(Outcome outcome) {
    return names[static_cast<std::size_t>(outcome)];
}

std::optional<Outcome> outcome_from_name(std::string_view name) {
    for (std::size_t i = 0; i < names.size(); ++i)
        if (names[i] == name) return static_cast<Outcome>(i);
    return std::nullopt;
}

std::vector<std::string> outcome_names() {
    return {names.begin(), names.end()};
}

Outcome outcome_of(Stop reason, const EndShape& end) {
    switch (reason) {
        case Stop::stationary:
            return at_rest(end);
        case Stop::pinch_off:
            return Outcome::pinched;
        case Stop::overhang:
            return Outcome::overhang;
        case Stop::ill_posed:
        case Stop::undefined:
            return Outcome::ill_posed;
        case Stop::self_intersection:
            return Outcome::self_intersection;
        default:  // no outcome of its own: the numerics failed, or the run could have gone on
            return exit_code(reason) == exit_code(Stop::solver_failed) ? Outcome::failed : Outcome::undecided;
    }
}

Outcome cell_at_rest(std::optional<Family> family) {
    static_assert(
        static_cast<int>(Outcome::pear) - static_cast<int>(Outcome::prolate) == static_cast<int>(Family::pear),
        "outcomes of cells stand in the order of families");
    if (!family) return Outcome::sphere;
    return static_cast<Outcome>(static_cast<int>(Outcome::prolate) + static_cast<int>(*family));
}

}  // namespace tubule
