// Stability of a stationary shape against normal displacements w(s) cos(m theta): growth rates by the second variation
// of E + sigma A + P V and the model's dissipation, one eigenproblem for each m.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "axisym/equilibrium.hpp"

namespace tubule::axisym {

enum class Dissipation {
    gradient_flow,  // INT w^2: the constraints of the problem hold (for m = 0; for others they hold by themselves)
    overdamped      // INT |u|^2 with local inextensibility: the least over all tangential velocities; volume fixed
};

struct ModeRates {
    int m = 0;
    std::vector<double> rates;  // exp(rate t), descending; rigid motions are left out
    std::vector<double> shape;  // w of the first, at equally spaced s, the largest being 1
    bool stable() const { return rates.empty() || rates[0] <= 0; }
};

// The second variation of E + sigma A + P V as a quadratic form in (w, w_s, w_theta, w_ss, w_s_theta, w_theta_theta),
// at each quadrature point of the shape. A shape that is not stationary moves, and the rates are those of the flow
// linearised about that motion at this instant, of the gradient flow only (maths 5, last line): the force b on it adds
// -INT b H w^2 dS to the form of displacements along straight normals.
class ModeStability {
public:
    ModeStability(const StationaryProblem& problem, const Equilibrium& shape);

    // The largest `count` growth rates for this m, of displacements with the period (or closed surface) of the shape;
    // for half a curve, of those that mirror themselves and those that do so with a change of sign. Throws SolveError
    // if the eigenproblem is not solved.
    ModeRates rates(int m, Dissipation dissipation, int count = 3) const;

private:
    void set_force(const std::vector<std::array<double, 3>>& first_variation);
    // What the pole, or a plane of symmetry, makes of w.
    std::vector<Parity> parities(int m) const;
    void add_rates(int m, Dissipation dissipation, Parity parity, int count, ModeRates& out) const;

    struct Point {
        double weight, r, g, normal_r, normal_z, H;  // weight: ds r g, of the curve and not of its mirror image
        double along;                                // n . nu, of the displacement w n
        std::array<double, 21> Q;                    // packed, per ds and dtheta
        double force;  // b and the multipliers: what drives the shape, 0 if it is stationary
    };

    StationaryProblem problem_;
    Equilibrium shape_;
    std::vector<Point> points_;  // element by element
};

// For m = 0 ... last.
std::vector<ModeRates> mode_stability(const StationaryProblem& problem, const Equilibrium& shape, int last,
                                      Dissipation dissipation, int count = 3);

}  // namespace tubule::axisym
