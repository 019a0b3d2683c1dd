// Potentials of places on a profile curve: INT W(r, z) dS and its derivatives in the coefficients of the curve, to be
// added to those of CurveForms. W may have a third variable, a number p. Not for periods that are free.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <span>
#include <vector>

#include "axisym/splines/curve_space.hpp"
#include "common/energy/potential.hpp"

namespace tubule::axisym {

// Over the whole cell or period.
struct PotentialObservation {
    double energy = 0, magnitude = 0;  // INT W dS, INT |W| dS
    double force = 0;                  // -INT W_z dS, which acts on the membrane along the axis
    // The least distance of a point to a wall, and the longest element over the range of a wall near it: where.
    double distance = std::numeric_limits<double>::infinity(), s_distance = 0;
    double coarse = 0, s_coarse = 0;
};
PotentialObservation observe_potential(const CurveSpace& space, const Formula& W, std::span<const Potential> potentials,
                                       const double* x, double p = 0);

// How far formulas of the place are from where they are not defined; its place is s.
FormulaDomain::Margin potential_domain(const CurveSpace& space, std::span<const Potential> potentials, const double* x);

// Elements of a meridian of this length, of which each is half of the shortest range of a wall at most; 0 without
// one.
int elements_for(std::span<const Potential> potentials, double length);

// The derivative of INT W dS as a tube is drawn out along its axis and each point keeps its W: of the axial force, the
// mean over the sections.
double potential_stretch(const CurveSpace& space, const Formula& W, const double* x);

// The gradient, added to space.size() numbers.
void add_potential_gradient(const CurveSpace& space, const Formula& W, double weight, const double* x, double* out,
                            double p = 0);
// The Hessian, added to the values of a matrix; `slots` are the places of each element's local matrix, as in
// CurveForms.
void add_potential_hessian(const CurveSpace& space, const Formula& W, double weight, const double* x,
                           const std::vector<int>& slots, double* values, double p = 0);

}  // namespace tubule::axisym
