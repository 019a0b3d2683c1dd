// Two beads at the poles of a closed profile curve, theory.md (2.23): their positions, the force on the curve where
// they are drawn apart, and the derivatives.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "axisym/splines/curve_space.hpp"
#include "common/formula/formula.hpp"

namespace tubule::axisym {

// The unknowns of two beads beside the curve: the position P of the one at s = 0, along the axis and outward; the
// multiplier q of the equation G(x, P) = 0 that defines it; then those of the one at s = 1.
using BeadNumbers = Eigen::Vector4d;

// What draws them: the force between them, or their distance.
struct BeadLoad {
    double force = 0;
    std::optional<double> distance{};  // instead of the force
};

class BeadForms {
public:
    // Keeps the space, of a whole closed curve, which must outlive it.
    BeadForms(const CurveSpace& space, double width);

    // Their equations in the numbers, F = 0: both G, and that q dG/dP is the force, or that both are the same and the
    // distance is held.
    BeadNumbers residual(const BeadLoad& load, const double* x, const BeadNumbers& at) const;
    // SUM q G by the curve: what the beads add to the gradient of the energy. Added to space.size() numbers.
    void add_force(const double* x, const BeadNumbers& at, double* out) const;
    // Its derivatives in the curve, into a matrix with the pattern of CurveForms and these slots of it.
    void add_hessian(const double* x, const BeadNumbers& at, const std::vector<int>& slots, double* values) const;
    struct Slopes {
        Eigen::MatrixXd force_by_numbers, equations_by_curve;  // a column for each number, a row for each equation
        Eigen::Matrix4d equations_by_numbers;
    };
    Slopes slopes(const BeadLoad& load, const double* x, const BeadNumbers& at) const;

    // The positions of the beads of a curve, and multipliers for this force. NaN where a bead has no position.
    BeadNumbers numbers(const double* x, double force) const;
    double distance(const double* x) const;
    static double distance(const BeadNumbers& at) { return at[0] + at[2]; }
    double force(const double* x, const BeadNumbers& at) const;
    // The derivative of the distance in the curve; and the second variation of SUM q G once the positions follow from
    // the curve, less that with the positions held.
    Eigen::VectorXd distance_slope(const double* x, const BeadNumbers& at) const;
    Eigen::MatrixXd following_hessian(const double* x, const BeadNumbers& at) const;

    // Densities of G and dG/dP, in r, z and P.
    const Formula& density(int bead) const { return beads_[bead].G; }
    const Formula& density_by_P(int bead) const { return beads_[bead].by_P; }
    // dG/dP and d^2G/dP^2.
    std::array<double, 2> slopes_in_P(int bead, double P, const double* x) const {
        return {integral(beads_[bead].by_P, P, x), integral(beads_[bead].by_PP, P, x)};
    }

    // The longest element near a bead, over the width of its weight.
    double coarseness(const double* x) const;

private:
    struct Bead {
        Formula G, by_P, by_PP;  // densities, in r, z and P
    };
    double integral(const Formula& density, double P, const double* x) const;
    Eigen::VectorXd slope(const Formula& density, double P, const double* x) const;

    const CurveSpace& space_;
    double width_;
    std::array<Bead, 2> beads_;
};

// The same breaks, of a curve of this length, with elements added that resolve the weights of the beads.
std::vector<double> refined_at_beads(const std::vector<double>& breaks, double width, double length);

}  // namespace tubule::axisym
