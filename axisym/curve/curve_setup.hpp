// From a case to the system of equations of one run: mesh, law of motion, initial state.
#pragma once

#include <memory>

#include "axisym/curve/curve_motion.hpp"
#include "axisym/curve/curve_output.hpp"
#include "axisym/curve/curve_settings.hpp"
#include "axisym/curve/shape_integrals.hpp"
#include "axisym/integration/time_integrator.hpp"
#include "axisym/splines/arc_length.hpp"
#include "common/case/problem.hpp"
#include "common/solve/derivative_check.hpp"

namespace tubule::axisym {

CurveLaw law_of(const Problem& c);

// The initial shape of a case. Throws CaseError for a result without a frame of this tier.
Curve initial_curve(const Problem& c);

// The curve of the frame that a case begins with, with its velocity, where the case asks for that. Throws CaseError
// where the frame has none.
std::optional<PerturbedCurve> initial_velocity(const Problem& c);

// The initial shape of all runs of a case: half of the profile if it is symmetric and the case allows it.
struct InitialShape {
    Curve meridian;
    double area = 0, volume = 0, length = 0;  // L of theory.md (3.16)
    ShapeEnergy bending;
    std::optional<PerturbedCurve> velocity = {};  // the curve of a frame with its velocity
    std::string note = {};                        // for the user

    double free_energy(const MotionLaw& law) const;  // F, theory.md (3.16), with the loads of t = 0
};
InitialShape initial_shape(const Problem& c);

// Taylor slopes of alpha/2 (M - M0)^2 at the initial shape of a tube, with what its Hessian has of rank one.
DerivativeCheck check_area_differences(const Problem& c);

// The system of one run. Case and initial shape must outlive it.
struct CurveSetup {
    CurveSetup(const Problem& c, const InitialShape& start, const CurveSettings& settings);

    const Problem& c;
    const InitialShape& start;
    CurveSettings settings;
    std::unique_ptr<CurveSpace> space;
    std::unique_ptr<CurveMotion> motion;
    double reference_energy = 0;  // what errors are relative to
    double magnitude = 0;         // of the terms of the initial energy
    SeriesTable<CurveRow> series;

    int elements() const { return space->splines().elements() * space->images(); }
    Eigen::VectorXd curve(const double* y) const { return Eigen::Map<const Eigen::VectorXd>(y, space->size()); }
    // What was measured on the spline that is nearest to the initial shape, with the energy, area and volume of the
    // shape.
    Snapshot with_exact_shape(Snapshot measured) const;
    // Without the monitored quantities: dissipation and guards.
    ImplicitSystem system() const;
    TimeControl control(double first_step) const;
};

// What the run computes from. Throws SolveError where the equations have no solution that the motion may reach.
InitialState initial_state(const CurveSetup& setup);
// Likewise after the curve and velocity of y at a time: a velocity with inertia jumps where the distance of beads is
// held and its rate changes.
InitialState state_after(const CurveSetup& setup, const Eigen::VectorXd& y, double time);
// The initial shape alone, with no velocity: what can be shown where initial_state() throws.
InitialState state_without_velocity(const CurveSetup& setup);

// These settings, with as many more elements as a spline needs that has nearly the energy of the initial shape.
CurveSettings settings_for(const Problem& c, const InitialShape& start, CurveSettings settings);

}  // namespace tubule::axisym
