// Functionals of a profile curve and their derivatives in the coefficients of (r, z) and in a free rise: bending
// energy, area, volume, and the gauge that keeps the parametrisation even.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <array>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "axisym/curve/potential_forms.hpp"
#include "axisym/splines/curve_space.hpp"
#include "axisym/splines/gradient_forms.hpp"
#include "common/energy/bending.hpp"

namespace tubule::axisym {

struct VaryingH0;  // of packs, which depend on the machine's registers: not for those who include this

// The functional energy INT f dS + area A + volume V + gauge J + M M of the whole cell or period, by its weights.
// With the energy go its gradient term, kg INT |grad H|^2 dS, and its potentials, INT W dS.
//   f = f(H, K)        V = INT pi r^2 z' ds        M = INT H dS
//   J = 1/2 INT (d log g/ds)^2 ds, g = |X'|, theory.md (4.9)
// All but J do not depend on the parametrisation; J vanishes for one in proportion to arc length, which every shape
// has. So E + c J has the stationary shapes of E, and a Hessian that is regular along the curve. Of the energy of area
// differences, alpha/2 (M - M0)^2, the gradient is that of alpha (M - M0) M: a weight that whoever solves chooses.
struct Weights {
    double energy = 0, area = 0, volume = 0, gauge = 0, M = 0;
};

// Diagnostics of a curve, over the whole cell or period; extremes over the quadrature points. Many fields: a list of
// measurements, found in one pass, that share no rule.
struct CurveObservation {
    double energy = 0;                // with that of area differences
    std::vector<double> energy_term;  // of each term, see term_names()
    double energy_kg = 0;             // theory.md (2.25)
    double energy_alpha = 0, M = 0;   // theory.md (2.19)
    double area = 0, volume = 0, gauge = 0;
    double length = 0;                                                  // of the meridian
    double r_min = std::numeric_limits<double>::infinity(), s_min = 0;  // not a pole, but possibly near one
    double r_max = 0, s_max = 0;
    double g_min = std::numeric_limits<double>::infinity(), g_max = 0;  // speeds |X'|
    double curvature = 0, s_curvature = 0;                              // largest |kappa_s| or |kappa_theta|
    // Smallest principal symbol f_HH + 2 f_HK x + f_KK x^2: for x = kappa_theta, and for all x between the principal
    // curvatures: theory.md (2.14).
    double symbol = std::numeric_limits<double>::infinity(), s_symbol = 0, symbol_3d = symbol;
    // With kg > 0 the symbol stays infinite. Where f has a negative one, waves grow that are longer than 2 pi
    // sqrt(2 kg/|symbol|): the largest ratio of an element to that root.
    double coarse = 0, s_coarse = 0;
    PotentialObservation potential;  // its energy is part of `energy`
    FormulaDomain::Margin domain;    // of the energy's formula; its place is s
};

class CurveForms {
public:
    // Keeps the space, which must outlive it. Throws as GradientForms where kg > 0.
    CurveForms(const CurveSpace& space, const Bending& bending);

    const CurveSpace& space() const { return space_; }
    const Bending& bending() const { return bending_; }
    void set_bending(const Bending& bending);
    // Where H0 varies it is a function of the area below a point, until this fixes it to the parameters: H0 of s is
    // then what the formula gives at the point s of the curve x. Throws std::invalid_argument where that is no number.
    void fix_H0(const Eigen::VectorXd& x);
    // H0 at the parameters `s`, ascending, of the curve x; or the number.
    std::vector<double> H0_at(const Eigen::VectorXd& x, const std::vector<double>& s) const;

    // Not finite or meaningless unless r > 0 at all quadrature points: see admissible().
    double value(const Weights& weights, const Eigen::VectorXd& x) const;
    Eigen::VectorXd gradient(const Weights& weights, const Eigen::VectorXd& x) const;
    // As above, added to `out` of space().size() numbers. False if at a quadrature point r <= 0 or the energy is not
    // defined.
    bool add_gradient(const Weights& weights, const double* x, double* out) const;
    Eigen::SparseMatrix<double> hessian(const Weights& weights, const Eigen::VectorXd& x) const;
    // As above, added to the values of a matrix with pattern(); not where H0 is a function of the area below, where the
    // matrix is full.
    void add_hessian(const Weights& weights, const double* x, double* values) const;
    const Eigen::SparseMatrix<double>& pattern() const { return pattern_; }
    // Places in its values of the local matrix of each element, column by column.
    const std::vector<int>& slots() const { return slots_; }
    // INT f_H0 dH0/ds (dX.t)/g dS, the power of the force along the curve that a fixed H0 exerts, theory.md (4.15):
    // added to a gradient it leaves the force along the normal. And its derivatives, which are not symmetric.
    void add_sliding(const double* x, double* out) const;
    void add_sliding_slopes(const double* x, double* values) const;
    // The derivative along the displacement z e_z, which stretches a curve along the axis: theory.md (3.19).
    double stretch_slope(const Weights& weights, const Eigen::VectorXd& x) const;
    // INT dX . dX dS, into the pattern(): the product of displacements that a descent is measured with.
    Eigen::SparseMatrix<double> mass(const Eigen::VectorXd& x) const;
    double M(const double* x) const;  // INT H dS

    // r > 0, |X'| > 0 and the energy defined at all quadrature points, none of them behind a wall.
    bool admissible(const Eigen::VectorXd& x) const;
    // `mesh_loss`, if given, receives for each element the energy lost to the spline there: half the second variation,
    // its direction being the best approximation error along the normal, from the jumps of the highest derivatives.
    CurveObservation observe(const Eigen::VectorXd& x, std::vector<double>* mesh_loss = nullptr) const;
    // E_ref, the scale that the required accuracy refers to: theory.md (11.1).
    double reference_energy(const Eigen::VectorXd& x) const;

private:
    template <int P>
    bool gradient_kernel(const Weights& weights, const VaryingH0& H0, const double* x, double* out) const;
    template <int P>
    void hessian_kernel(const Weights& weights, const VaryingH0& H0, const double* x, double* values) const;
    bool H0_by_area() const { return bending_.H0_varies() && !fixed_H0_; }
    const VaryingH0& fixed_H0() const;
    // use(what H0 is at the points of the curve x, if it varies)
    template <class Use>
    auto with_H0(const double* x, const Use& use) const;
    FormulaDomain::Margin domain(const Eigen::VectorXd& x) const;
    template <class Add>
    void add_rise_hessian(const Weights& weights, const double* x, const Add& add) const;
    std::vector<double> loss_to_mesh(const Eigen::VectorXd& x, const std::vector<double>& stiffness,
                                     const std::vector<double>& of_gradients) const;

    const CurveSpace& space_;
    Bending bending_;
    std::optional<Formula> W_;                            // of its potentials
    std::optional<GradientForms<CurveSpace>> gradients_;  // where kg > 0
    std::shared_ptr<const VaryingH0> fixed_H0_;           // none before fix_H0()
    Eigen::VectorXd fixed_on_;
    double images_;
    Eigen::SparseMatrix<double> pattern_;
    std::vector<int> slots_;  // place in pattern_ of the local matrix entries of each element, column by column
};

}  // namespace tubule::axisym
