// Laws of motion of a profile curve as one differential-algebraic system in y and y':
// theory.md (4.10), (4.11), (4.12), (4.13), (4.14).
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <map>
#include <vector>

#include "axisym/curve/bead_forms.hpp"
#include "axisym/curve/curve_forms.hpp"
#include "axisym/curve/open_rim.hpp"
#include "axisym/curve/rim_conditions.hpp"
#include "common/model/model.hpp"

namespace tubule::axisym {

struct PointNumbers;

// A law of motion in the form that curves need. With inextensibility there is a velocity u; else X_t.nu = b - lambda.
struct CurveLaw : MotionLaw {
    CurveLaw(const MotionLaw& law) : MotionLaw(law) {}

    // With inextensibility: whether A(X) and V(X) are corrected for drift by errors in time. Where H varies little,
    // both are the same condition, and one is enough; where it does not vary at all (a sphere, a straight tube), lambda
    // nu and a constant pressure are the same force, and keeps_volume must be false, since div u = 0 keeps the volume.
    bool holds_area = true, holds_volume = true;
    bool lagrangian = false;  // the parametrisation is material, X_t = u, instead of even; u is X_t.nu in gradient flow
    bool swirls = false;      // u has a component around the axis
    bool open_rim = false;    // of a patch whose reservoir is beyond its rings, where membrane flows in: OpenRim
};

// Offsets of the unknowns y: the curve X = (r, z) as CurveSpace has it; the periodic part of the velocity u = (u_r,
// u_z) likewise; the swirl u_theta; the pressure p; multipliers. -1 for those that the law does not have.
// Many fields: one for each unknown of any law.
struct MotionLayout {
    int r = 0, z = 0, u_r = -1, u_z = -1, swirl = -1, p = -1;
    int rise = -1;                // of a free period, the last coefficient of the curve
    int tension = -1;             // of an extensible membrane: multiplier of A(X) = A0, the force tension H nu
    int supply = -1;              // of a reservoir: the number that div u is everywhere
    int stretch = -1;             // of a free period L: L_t/L, the velocity has the part (L_t/L) z e_z
    int lambda = -1;              // force -lambda nu, which keeps the volume: INT u.nu = 0; or -P(V), theory.md (3.24)
    int area = -1, volume = -1;   // multipliers of A(X) = A0, V(X) = V0, against drift: zero except for errors in time
    int drift = -1;               // of INT u_z = 0, where nothing else holds the curve in its place
    int mu = -1;                  // alpha (M - M0): the force mu 2 K nu, theory.md (2.20)
    int bead = -1;                // first of BeadNumbers
    int reach = -1;               // of their distance, against drift, where the force holds its rate (with inertia)
    int rim = -1, rim_flow = -1;  // of a patch, first multipliers of rim_functionals(): of the curve, of the velocity
    int shift = -1;               // of INT (X_t - u).t = 0, as the parameter of a period has no fixed point
    int size = 0;
};

// Unknowns and rates that a motion begins with.
struct InitialState {
    Eigen::VectorXd y, rate;
    double time = 0, step = 0;   // of the unknowns, and of the first step from them
    double work = 0;             // with inertia: of what holds the distance of beads, until then
    Eigen::VectorXd shown = {};  // the unknowns at t = 0, with the exact curve
};

// In weak form, for all test displacements phi, velocities v, and pressures q (dS = 2 pi r g ds):
//   ((X_t - u).nu, phi.nu) + c dJ[phi] = 0            the curve moves with u, its parameter stays even (gauge J)
//   (u_t + c u_s/g + ..., v) + 2/Re (D(u), D(v)) + gamma (u, v) - (p, div v) + dE[v] + lambda dV[v] = 0
//   (q, div u - supply) = 0,  dV[u] = 0
// and with sources -(force, v) in the second row and div u - supply - mass in the third
// with c = (u - X_t).t. Half of (div u - supply) u is added to the acceleration, by which the discrete kinetic energy
// has an exact balance. The gradient flow is ((X_t).nu, phi.nu) + dE[phi] + tension dA[phi] + lambda dV[phi] + c
// dJ[phi] = 0; with a material parametrisation (X_t, phi) + dE[phi] + (its force along the curve, phi) + ... = 0. A
// pressure that is given stands for -lambda; where it is a formula of the volume, lambda + P(V) = 0. A free period adds
// (L_t/L) z e_z to u, and the test function z e_z. Beads add SUM q dG[v] (BeadForms); with inertia a held distance D
// has the row dD[u] = D_t, and D itself a multiplier in the first row. Where a patch ends, multipliers
// hold the curve, and the velocity at zero or, where the rim is open, along the membrane. Many fields: besides the
// problem, the places of all its terms in the matrix, found once.
class CurveMotion {
public:
    // `gauge` is the weight c of J; area and volume those to be kept. The space must outlive the motion.
    CurveMotion(const CurveSpace& space, const Bending& bending, const CurveLaw& law, double gauge, double area,
                double volume);
    CurveMotion(const CurveMotion&) = delete;
    CurveMotion& operator=(const CurveMotion&) = delete;

    const CurveSpace& space() const { return forms_.space(); }
    const CurveForms& forms() const { return forms_; }
    const CurveLaw& law() const { return law_; }
    const MotionLayout& layout() const { return at_; }
    // Before anything else where H0 varies: see CurveForms. The parametrisation must be material.
    void fix_H0(const Eigen::VectorXd& x) { forms_.fix_H0(x); }
    // Likewise of a patch: holds its rings where the curve x has them.
    void hold_rings(const Eigen::VectorXd& x);
    // Likewise where the distance of beads is held: that of the curve x and their extension.
    void hold_beads(const Eigen::VectorXd& x) { bead_distance0_ = beads_->distance(x.data()); }
    const SplineSpace& pressures() const { return pressure_; }
    // What the axial force works along, theory.md (3.16): the period of a tube, or the distance of beads.
    double length(const double* y) const;
    double bead_coarseness(const double* y) const { return beads_ ? beads_->coarseness(y) : 0; }
    // Its rate of change where the curve has these rates.
    double lengthening(const double* y, const double* rate) const;

    // Sets the unknowns that follow from the curve of y alone: mu, and where beads are.
    void set_followers(Eigen::VectorXd& y) const;
    // The residual F of the system. False where r <= 0 at a quadrature point: try a smaller step.
    bool residual(double t, const double* y, const double* rate, double* F) const;
    // dF/dy + cj dF/drate, into the values of a matrix with pattern().
    void jacobian(double t, const double* y, const double* rate, double cj, double* values) const;
    const Eigen::SparseMatrix<double>& pattern() const { return pattern_; }
    // 1 for unknowns whose rate matters, 0 for the others.
    Eigen::VectorXd differential() const;

    // Kinetic energy and related integrals over the whole cell or period.
    struct Balance {
        double kinetic = 0, dissipation = 0;  // E_K, and the rate at which E + E_K falls
        double supplied = 0;                  // what a reservoir and sources bring, per time: theory.md (3.18), (3.27)
        double momentum_z = 0, angular_z = 0;
        double speed = 0;         // largest |u|; of the gradient flow |X_t.nu|
        double acceleration = 0;  // INT |u_t|^2 dS, at fixed parameter
        double divergence = 0;    // sqrt(INT (div u - supply)^2 dS), of which only the part in the pressures is zero
        Loads loads;              // given or measured; no force where there is neither a period nor beads
    };
    Balance balance(double t, const double* y, const double* rate) const;
    // How far the formulas of sources are from where they are not defined; the place is s.
    FormulaDomain::Margin source_domain(double t, const double* y) const;

    // Consistent unknowns and rates from the curve and velocities of y0 at a time, whose other entries are a guess:
    // after two implicit Euler steps of length h. Throws SolveError if Newton's method fails.
    InitialState consistent(const Eigen::VectorXd& y0, double h, double time = 0) const;

private:
    struct Local;
    void set_pattern();
    bool slides() const { return !law_.inextensible && forms_.bending().H0_varies(); }
    Weights force_weights(double t, const double* y) const;
    Weights drift_weights(const double* y) const;
    Eigen::VectorXd stretched(const double* y) const;
    void add_law(double t, const double* y, const double* rate, double cj, double* values) const;
    void add_forms(double t, const double* y, double* values) const;
    void set_numbers(double t, const double* y, double area, double volume, double* F) const;
    void add_numbers(const double* y, double* values) const;
    BeadLoad bead_load(double t) const;
    BeadNumbers bead_numbers(const double* y) const { return Eigen::Map<const BeadNumbers>(y + at_.bead); }
    void add_beads(double t, const double* y, double* values) const;
    BeadNumbers lengthening_beads(const double* y) const;
    double reach_rate(const double* y) const;
    void hold_reach(double t, const double* y, double* F) const;
    void add_reach(const double* y, double* values) const;
    void hold_rim(double t, const double* y, double* F) const;
    void add_rim(double t, const double* y, double* values) const;
    void hold_open_rim(double t, const double* y, double* F) const;
    void add_open_rim(double t, const double* y, double* values) const;
    double rim_supply(const double* y) const;
    int slot_of(int row, int column) const;
    void add_stretch(double t, const double* y, double cj, double* values) const;
    PointNumbers point_numbers(double t, const double* y) const;
    Eigen::VectorXd velocity(const double* y) const;
    int number_of(int row) const;
    Loads loads_of(double t, const double* y, double tension, double pull) const;
    void scatter(int element, const Eigen::MatrixXd& local, double* values) const;
    template <class Packs>
    void add_row(int number, int e, int g, const Packs& weight, const Packs* in_slots, double* values) const;
    template <class Packs>
    void add_column(int number, int part, int e, int g, const Packs& factor, double* values) const;
    void add_free_period(int e, int g, const PointNumbers& numbers, const Local& at, double cj, double* values) const;
    template <class Rows>
    void add_test_column(int number, int e, int g, const Rows& rows, double* values) const;
    Eigen::VectorXd gradient_at(const Weights& weights, const double* y) const;

    // A field of unknowns: where it stands, and which of the pointwise slots it fills.
    struct Part {
        const SplineSpace* field;
        int offset;
    };
    int width(int part) const { return parts_[part].field->width(); }

    CurveForms forms_;
    CurveLaw law_;
    std::optional<BeadForms> beads_;
    Eigen::MatrixXd rim_;         // rim_functionals()
    Eigen::VectorXd rim_values_;  // of the curve
    std::vector<OpenRim> open_rims_;
    double gauge_, area0_, volume0_, bead_distance0_ = 0;
    SplineSpace pressure_;
    MotionLayout at_;
    std::vector<Part> parts_;  // in the order of the pointwise fields; absent ones have offset -1
    Eigen::SparseMatrix<double> pattern_;
    std::vector<int> slots_;  // of the local matrix of each element, column by column
    int local_size_ = 0;
    std::vector<int> numbers_;                       // the multipliers and the rise, which have dense rows and columns
    std::map<int, std::vector<int>> number_rows_;    // of each number, its row
    std::vector<int> momentum_slots_, curve_slots_;  // of each entry of forms_.pattern() in the rows of u, of X
};

}  // namespace tubule::axisym
