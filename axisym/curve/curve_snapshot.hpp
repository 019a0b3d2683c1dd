// Measurements of a curve at one time.
#pragma once

#include <cmath>

#include "axisym/curve/curve_motion.hpp"
#include "common/shapes/tube.hpp"

namespace tubule::axisym {

struct Snapshot {
    CurveObservation o;
    CurveMotion::Balance balance;
    Neck neck;                                // the narrowest; of infinite radius where there is none
    double free_energy = 0;                   // F, theory.md (3.16)
    double length = 0;                        // L of that: the period of a tube, or the distance of beads
    double coarse_bead = 0;                   // longest element near a bead over the width of its weight
    FormulaDomain::Margin pressure_domain{};  // of the formula of the pressure

    double total() const { return free_energy + balance.kinetic; }
};

// Whether the state is that of a membrane, so that other measurements mean something.
inline bool is_admissible(const Snapshot& s) {
    return std::isfinite(s.total()) && s.o.r_min > 0 && s.neck.radius > 0;
}

// Measures the state of unknowns y and their rates.
Snapshot measure(const CurveMotion& motion, double t, const double* y, const double* rate);

// Amplitude of the wave of number n in r(z), also where that has several values.
double mode_amplitude(const CurveSpace& space, const double* y, int n);

}  // namespace tubule::axisym
