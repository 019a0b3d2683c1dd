// Two beads at the poles of a closed profile curve, or one at the pole of a patch, theory.md (2.23): BeadEquations in
// the coefficients of the curve.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "axisym/splines/curve_space.hpp"
#include "common/energy/bead_equations.hpp"

namespace tubule::axisym {

class BeadForms {
public:
    // Keeps the space, of a whole closed curve or a cap, which must outlive it; `foot`: the height of a cap's ring.
    BeadForms(const CurveSpace& space, double width, std::optional<double> foot = {})
        : space_(space), equations_(width, BeadEquations::on_profile, foot) {}

    const BeadEquations& equations() const { return equations_; }
    // The curve x, which must outlive it.
    BeadSurface on(const double* x) const;
    // The positions of the beads of the curve, and multipliers for this force: see BeadEquations.
    BeadNumbers numbers(const double* x, double force) const;
    double distance(const double* x) const { return BeadEquations::distance(numbers(x, 0)); }
    double force(const double* x, const BeadNumbers& at) const { return equations_.force(on(x), at); }

    // What the beads add to the gradient of the energy, added to space.size() numbers; and its derivatives in the
    // curve, into a matrix with the pattern of CurveForms and these slots of it.
    void add_force(const double* x, const BeadNumbers& at, double* out) const;
    void add_hessian(const double* x, const BeadNumbers& at, const std::vector<int>& slots, double* values) const;

    // The longest element near a bead, over the width of its weight.
    double coarseness(const double* x) const;

private:
    const CurveSpace& space_;
    BeadEquations equations_;
};

// The same breaks, of a curve of this length, with elements added that resolve the weights of the beads.
std::vector<double> refined_at_beads(Topology topology, const std::vector<double>& breaks, double width, double length);

}  // namespace tubule::axisym
