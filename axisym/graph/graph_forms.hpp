// The discrete free energy F = E + tension A - pressure V of a profile and its gradient flow: value, gradient and
// Hessian come from one object, together with the mass matrix of the dissipation.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <array>
#include <optional>
#include <vector>

#include "axisym/splines/gradient_forms.hpp"
#include "axisym/splines/spline_space.hpp"
#include "common/energy/bending.hpp"
#include "common/model/model.hpp"

namespace tubule::axisym {

// Diagnostics of a state, integrated or extremised over the whole period. Many fields: a list of measurements that
// share no rule.
struct Observation {
    double energy = 0, free_energy = 0;
    std::vector<double> energy_term;  // of each term, see term_names()
    double energy_kg = 0;             // of the gradient term, theory.md (2.25)
    double dissipation = 0;           // INT b^2 dS of the rate handed in: -dF/dt along the flow
    double area = 0, volume = 0;
    double r_min = 0, z_min = 0;  // smallest radius at quadrature points, and where
    double r_max = 0, z_max = 0;
    double steepness = 0, z_steep = 0;  // largest |r'| r_min / r: O(1) on a catenoidal neck, unbounded at an overhang
    double symbol = 0, z_symbol = 0;    // smallest principal symbol, theory.md (2.14), for x = kappa_theta
    double symbol_3d = 0;               // the same over all x between the principal curvatures
    double coarse = 0, z_coarse = 0;    // as of CurveObservation, where kg > 0; the symbol does not matter then
    FormulaDomain::Margin domain;       // of the energy's formula; its place is z
};

class Forms {
public:
    // The loads are the same at all times; a force means nothing to a graph, whose period is fixed.
    Forms(const SplineSpace& space, const Bending& bending, const Loads& loads = {});

    const SplineSpace& space() const { return space_; }
    const Bending& bending() const { return bending_; }
    const Loads& loads() const { return loads_; }

    // F, and its derivatives.
    double free_energy(const Eigen::VectorXd& x) const;
    Eigen::VectorXd gradient(const Eigen::VectorXd& x) const;
    Eigen::SparseMatrix<double> hessian(const Eigen::VectorXd& x) const;
    // INT 2 pi (r/g) phi_i phi_j dz: theory.md (4.4)
    Eigen::SparseMatrix<double> mass(const Eigen::VectorXd& x) const;

    // M(x) v + grad F(x), which vanishes for the rate v of the gradient flow. Arrays of space().size() numbers.
    // False, with `out` unusable, if at a quadrature point the radius is not positive or the energy is not defined.
    bool residual(const double* x, const double* v, double* out) const;
    // Jacobian dF/dv of this residual F, the mass, into the values of a matrix with pattern().
    void mass(const double* x, double* values) const;
    // Jacobian dF/dx + cj dF/dv, likewise.
    void jacobian(const double* x, const double* v, double cj, double* values) const;
    // Compressed columns shared by hessian, mass and jacobian.
    const Eigen::SparseMatrix<double>& pattern() const { return pattern_; }

    // The rate x_t of the flow at x. Throws SolveError when the mass matrix is singular.
    Eigen::VectorXd rate(const Eigen::VectorXd& x) const;

    // `mesh_loss`, if given, receives for each element the energy lost to the spline there: half the second
    // variation of the best approximation error, from the jumps of the highest derivative
    // (docs/decisions/graphs.md), over the whole period.
    Observation observe(const double* x, const double* v, std::vector<double>* mesh_loss = nullptr) const;
    // The axial force that keeps the period, theory.md (3.19): dF/dL while the profile is stretched along z.
    double axial_force(const Eigen::VectorXd& x) const;
    // E_ref, the scale that the required accuracy refers to: theory.md (11.1).
    double reference_energy(const Eigen::VectorXd& x) const;
    // Functionals of the coefficients that give the cosine and sine amplitudes of the mode with n waves
    // over the period.
    std::array<Eigen::VectorXd, 2> mode(int n) const;

private:
    template <int P>
    bool residual_kernel(const double* x, const double* v, double* out) const;
    template <int P>
    void jacobian_kernel(const double* x, const double* v, double cj, double* values) const;
    template <int P>
    void mass_kernel(const double* x, double* values) const;
    template <class Local>
    void scatter(int element, const Local& local, double* values) const;
    FormulaDomain::Margin domain(const double* x) const;
    template <int P>
    Observation observe_kernel(const double* x, const double* v, double* stiffness) const;
    template <int P, class Integrand>
    double integral_kernel(const double* x, const Integrand& integrand) const;

    const SplineSpace& space_;
    Bending bending_;
    Loads loads_;
    std::optional<GradientForms<SplineSpace>> gradients_;  // where kg > 0
    double images_;                                        // cells in the whole period
    Eigen::SparseMatrix<double> pattern_;
    std::vector<double> loss_scale_;  // of each element, see observe()
    std::vector<int> slots_;          // place in pattern_ of the local matrix entries of each element
};

}  // namespace tubule::axisym
