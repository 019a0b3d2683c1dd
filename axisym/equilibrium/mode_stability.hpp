// Stability of a stationary shape against normal displacements w(s) cos(m theta): growth rates from the second
// variation of E + sigma A + lambda V and the dissipation 2 viscosity INT |D(u)|^2 + friction INT |u|^2, theory.md
// (3.14), one eigenproblem for each m. Inertia is neglected. Without inextensibility u is w nu alone, and the problem's
// constraints hold (for m = 0; for others they hold by themselves). With it what the law keeps is fixed, too, and the
// tangential velocity is the one of least dissipation; with a reservoir its divergence is the same everywhere.
#pragma once

#include <Eigen/Core>
#include <array>
#include <utility>
#include <vector>

#include "axisym/equilibrium/equilibrium.hpp"
#include "axisym/equilibrium/gradient_modes.hpp"
#include "axisym/splines/third_derivatives.hpp"
#include "common/model/model.hpp"

namespace tubule::axisym {

struct ModeRates {
    int m = 0;
    std::vector<double> rates{};  // exp(rate t), descending; rigid motions are left out
    std::vector<double> shape{};  // w of the first, at equally spaced s, the largest being 1
    // Displacements w cos(m theta) of each, likewise, whose mean square over the surface is 1.
    std::vector<std::vector<double>> displacements{};
    double softness = 0;  // SUM -1/rate over all rates of the mesh, of which those above are the first
    // No wave of this m grows.
    bool stable() const { return rates.empty() || rates[0] <= 0; }
};

// The second variation of E + sigma A + lambda V as a quadratic form in (w, w_s, w_theta, w_ss, w_s_theta,
// w_theta_theta), at each quadrature point of the shape. A shape that is not stationary moves, and the rates, in
// gradient flow only, are those of the flow linearised about that motion at this instant, theory.md (8.8): the force b
// on it adds -INT b H w^2 dS to the form of displacements along straight normals.
class ModeStability {
public:
    // Copies both.
    ModeStability(const StationaryProblem& problem, const Equilibrium& shape);

    // The largest `count` growth rates for this m, of displacements with the period (or closed surface) of the shape;
    // for half a curve, of those that mirror themselves and those that do so with a change of sign. Throws SolveError
    // if the eigenproblem is not solved.
    ModeRates rates(int m, const MotionLaw& law, int count = 3) const;
    // Rates of m = 0 in gradient flow: displacements of a half curve that mirror themselves, or change their sign at
    // its planes of symmetry; of a whole curve all are even.
    std::vector<double> axisymmetric_rates(bool even, int count) const;

private:
    // Many fields: where a point is, and what the forms need of it.
    struct Point {
        int element, group, lane;
        double weight, r, g, kappa_s, kappa_theta, H, slope, stretching;  // slope dr/ds of arc length, d log g / d s
        double normal_r, normal_z, z;
        double along;                // n . nu, of the displacement w n
        std::array<double, 21> Q;    // packed, per ds and dtheta
        std::array<double, 4> bead;  // of each, slope_along_normal() of G and dG/dP
        double force;                // b and the multipliers: what drives the shape, 0 if it is stationary
    };
    static double slope_along_normal(const Formula& W, double P, const Point& p);
    // Quadratic and linear forms of one m, per dtheta and over the curve alone, not its mirror image.
    struct Forms;

    void add_gradients(int element, int group, const Eigen::VectorXd& n_r, const Eigen::VectorXd& n_z);
    void set_force(const std::vector<std::array<double, 4>>& first_variation);
    std::vector<Parity> parities(int m) const;
    int mirror(Parity parity) const;
    Forms assemble(int m, const SplineSpace& field) const;
    Eigen::MatrixXd regular(int m, const SplineSpace& field) const;
    Eigen::MatrixXd dissipation_form(int m, const MotionLaw& law, Parity parity, const SplineSpace& field,
                                     const Forms& forms) const;
    Eigen::MatrixXd potentials(int m, const MotionLaw& law, Parity parity, const SplineSpace& field,
                               const Forms& forms) const;
    std::pair<Eigen::MatrixXd, Eigen::MatrixXd> ring_conditions(int m, const MotionLaw& law, const SplineSpace& field,
                                                                const SplineSpace& psi,
                                                                const Eigen::MatrixXd& chi) const;
    Eigen::MatrixXd with_flux(const MotionLaw& law, const Eigen::MatrixXd& of_w, const Eigen::MatrixXd& M) const;
    Eigen::MatrixXd fixed_functionals(int m, const MotionLaw& law, const SplineSpace& field, Forms& forms,
                                      const Eigen::MatrixXd& M) const;
    void fix_at_rings(const SplineSpace& field, Eigen::MatrixXd& fixed) const;
    void add_beads(Forms& forms, Eigen::MatrixXd& fixed) const;
    void add_rates(int m, const MotionLaw& law, Parity parity, int count, ModeRates& out) const;

    StationaryProblem problem_;
    Equilibrium shape_;
    std::optional<BeadForms> beads_;
    std::vector<Point> points_;  // element by element
    std::optional<GradientModes> gradients_;
    std::optional<ThirdDerivatives> third_;  // with gradients_
};

// For m = 0 ... last.
std::vector<ModeRates> mode_stability(const StationaryProblem& problem, const Equilibrium& shape, int last,
                                      const MotionLaw& law, int count = 3);

}  // namespace tubule::axisym
