// Two beads at the poles of a closed surface, or one at the pole of a patch, theory.md (2.23): the equations of their
// positions, and of the force between them or of their distance, for the integrals of either tier.
#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "common/formula/formula.hpp"

namespace tubule {

// Unknowns beside the shape: the position P of the lower bead, along the axis and outward; the multiplier q of the
// equation G = 0 that defines it; then those of the upper one.
using BeadNumbers = Eigen::Vector4d;

// What draws them: the force between them, or their distance.
struct BeadLoad {
    double force = 0;
    std::optional<double> distance{};  // instead of the force
};

// A surface, for which a tier integrates densities, formulas of the place and of P.
struct BeadSurface {
    std::function<double(const Formula&, double P)> integral;
    std::function<Eigen::VectorXd(const Formula&, double P)> slope;  // of the integral in the unknowns of the shape
};

class BeadEquations {
public:
    static constexpr std::array<std::string_view, 3> on_profile{"r", "z", "P"};
    static constexpr std::array<std::string_view, 4> in_space{"x", "y", "z", "P"};
    // `foot`: the height of the ring of a patch, which stands for the lower bead; its q is 0.
    BeadEquations(double width, std::span<const std::string_view> variables, std::optional<double> foot = {});

    // F = 0: both G, and that q dG/dP is the force, or that both are the same and the distance is held. The force of
    // the beads on the shape is the slope of SUM q G.
    BeadNumbers residual(const BeadSurface& on, const BeadLoad& load, const BeadNumbers& at) const;
    struct Slopes {
        Eigen::MatrixXd force_by_numbers, equations_by_shape;  // a column for each number, a row for each equation
        Eigen::Matrix4d equations_by_numbers;
    };
    Slopes slopes(const BeadSurface& on, const BeadLoad& load, const BeadNumbers& at) const;

    // The positions of the beads of a surface with its poles there, and multipliers for this force. NaN where a bead
    // has no position.
    BeadNumbers numbers(const BeadSurface& on, const std::array<double, 2>& poles, double force) const;
    static double distance(const BeadNumbers& at) { return at[0] + at[2]; }
    double force(const BeadSurface& on, const BeadNumbers& at) const;
    // The derivative of the distance in the shape.
    Eigen::VectorXd distance_slope(const BeadSurface& on, const BeadNumbers& at) const;
    // What the second variation of SUM q G has beyond that at held positions, as these follow from the shape:
    // SUM weight column column^T.
    struct Following {
        Eigen::MatrixXd columns;
        Eigen::VectorXd weights;
    };
    Following following(const BeadSurface& on, const BeadNumbers& at) const;

    // SUM q G, less the force times what the distance is beyond one that is held: what the Lagrangian has beside F.
    double lagrangian(const BeadSurface& on, const BeadLoad& load, const BeadNumbers& at) const;
    // SUM q G as the integral of a density of the place alone.
    std::string force_density(const BeadNumbers& at) const;

    double width() const { return width_; }
    bool has_bead(int bead) const { return bead >= first(); }
    // The row of a distance that is held.
    int distance_row() const { return foot_ ? 3 : 1; }
    // Densities of G and dG/dP.
    const Formula& density(int bead) const { return beads_[bead].G; }
    const Formula& density_by_P(int bead) const { return beads_[bead].by_P; }
    // dG/dP and d^2G/dP^2.
    std::array<double, 2> slopes_in_P(const BeadSurface& on, int bead, double P) const {
        return {on.integral(beads_[bead].by_P, P), on.integral(beads_[bead].by_PP, P)};
    }

private:
    struct Bead {
        Formula G, by_P, by_PP;  // densities
    };
    int first() const { return foot_ ? 1 : 0; }

    double width_;
    bool in_space_;
    std::optional<double> foot_;
    std::array<Bead, 2> beads_;
};

}  // namespace tubule
