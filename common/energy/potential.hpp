// Potentials of places: INT W dS beside the bending energy, with W a function of the distance to a wall (a plane across
// the axis, or a sphere about it), or a formula of the place. theory.md (2.22).
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include "common/formula/formula.hpp"

namespace tubule {

struct Potential {
    enum class Kind { plane, sphere, formula };
    enum class Law { morse, nine_three };
    static constexpr std::array<std::string_view, 2> variables{"r", "z"};      // in tier axisym
    static constexpr std::array<std::string_view, 3> in_space{"x", "y", "z"};  // in tier surface3d

    Kind kind = Kind::plane;
    double z = 0;         // of the plane, or of the sphere's centre
    double radius = 1;    // of the sphere
    bool behind = false;  // the membrane is below the plane, or in the sphere
    Law law = Law::morse;
    double strength = 0;  // energy per area at the minimum, which is -strength
    double range = 0;     // distance of the minimum from the wall
    std::shared_ptr<const Formula> formula = {};

    bool is_wall() const { return kind != Kind::formula; }
    // Whether it holds a membrane in its place along the axis, in tier axisym.
    bool acts_along_axis() const { return is_wall() ? strength != 0 : uses(*formula, 1); }
    bool acts() const { return !is_wall() || strength != 0; }
    // From the wall to a point, negative behind it.
    double distance(double r, double z) const;
};

// The sum of all W, in r and z, or in x, y and z; none of no potentials.
std::optional<Formula> potential_density(std::span<const Potential> potentials);
std::optional<Formula> potential_density_in_space(std::span<const Potential> potentials);

}  // namespace tubule
