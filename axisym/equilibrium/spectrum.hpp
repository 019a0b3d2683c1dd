// Growth rates of a given profile of any shape, by mode_stability on meshes fine enough.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "axisym/equilibrium/mode_stability.hpp"
#include "axisym/splines/arc_length.hpp"
#include "common/case/equilibrium_choices.hpp"

namespace tubule::axisym {

struct SpectrumSettings {
    int first = 0, last = 2;  // m = first ... last
    int count = 3;            // rates of each m
    double accuracy = 1e-6;   // of each rate, relative to the larger of it and the slowest rate there is
    int max_elements = 200;
    std::optional<double> sigma;  // the tension: of a free area; or where the shape leaves it open (a tube, a sphere)
    double pressure = 0;          // of a free volume
    std::shared_ptr<const Formula> pressure_of_volume{};  // instead of the number
    std::optional<double> force;  // of a free period: what balances it; of beads whose distance is not held
};

// The loads of a law at a time, where `held` leaves their partners free.
void set_loads(SpectrumSettings& settings, const MotionLaw& law, Held held, double time);

struct Spectrum {
    std::vector<ModeRates> modes;
    double area = 0;
    double sigma = 0, lambda = 0;  // multipliers that hold the shape: E + sigma A + lambda V is stationary
    // How far from rest it is: the root mean square of the displacement of a Newton step, over length/(2 pi) of the
    // meridian. (The force itself is a fourth derivative, of which little is known from points on a profile.)
    double unbalanced = 0;
    double estimated_error = 0;  // of the rates, as `accuracy`
    int elements = 0;
    bool at_rest() const { return unbalanced < 1e-3; }
};

// The quantities that a law conserves: the volume if it keeps it, the area of an inextensible membrane without a
// reservoir, or of an extensible one that keeps it.
Held held_by(const MotionLaw& law);

// For a whole tube or cell. For a shape that is not at rest in gradient flow, the rates are those of the flow
// linearised about its motion at this instant. Otherwise the multipliers are those that balance the force best, as
// if the shape were held by them.
// For m = 0 the constraints act: there are no rates for a moving shape except in gradient flow with nothing held
// (std::invalid_argument). For m >= 1 there are always rates;
// those of inextensible laws, and where a free period changes, neglect the effect of the motion itself on waves, so
// they are an estimate. A free period has no spectrum for m = 0, and a law with inertia none at all, since the
// displacements of the second variation have neither (std::invalid_argument). SolveError if an eigenproblem fails.
Spectrum spectrum(const Bending& bending, const MotionLaw& law, Held held, const Curve& shape,
                  const SpectrumSettings& settings = {});

}  // namespace tubule::axisym
