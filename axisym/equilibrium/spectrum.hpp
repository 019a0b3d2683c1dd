// Growth rates of a given profile of any shape, by mode_stability on meshes fine enough.
#pragma once

#include <optional>
#include <vector>

#include "axisym/curve/curve_start.hpp"
#include "axisym/equilibrium/mode_stability.hpp"
#include "common/case/equilibrium_choices.hpp"

namespace tubule::axisym {

struct SpectrumSettings {
    int first = 0, last = 2;  // m = first ... last
    int count = 3;            // rates of each m
    double accuracy = 1e-6;   // of each rate, relative to the larger of it and the slowest rate there is
    int max_elements = 200;
    std::optional<double> sigma;  // the tension, where the shape leaves it open (a straight tube, a sphere)
};

struct Spectrum {
    std::vector<ModeRates> modes;
    double sigma = 0, lambda = 0;  // multipliers that hold the shape: E + sigma A + lambda V is stationary
    // How far from rest it is: the root mean square of the displacement of a Newton step, over length/(2 pi) of the
    // meridian. (The force itself is a fourth derivative, of which little is known from points on a profile.)
    double unbalanced = 0;
    double estimated_error = 0;  // of the rates, as `accuracy`
    int elements = 0;
    bool at_rest() const { return unbalanced < 1e-3; }
};

// What a law holds fixed by itself: the volume if it keeps it, the area of an inextensible membrane.
Held held_by(const MotionLaw& law);

// Of a whole tube or cell. Of a shape that is not at rest in the gradient flow, the rates are those of the flow
// linearised about its motion at this instant. For all else the multipliers are those that balance the force best, as
// if the shape were held by them.
// With m = 0 there are constraints: no rates then of an inextensible membrane with the volume free, and none of a shape
// that moves, but for the gradient flow with nothing held (std::invalid_argument). For m >= 1 there are always rates;
// what the motion itself does to waves is left out of inextensible ones, so they are an estimate. None of a law with
// inertia (std::invalid_argument), which is not in the second variation. SolveError if an eigenproblem is not solved.
Spectrum spectrum(const Bending& bending, const MotionLaw& law, Held held, const Meridian& shape,
                  const SpectrumSettings& settings = {});

}  // namespace tubule::axisym
