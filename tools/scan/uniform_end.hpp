// Detects when a tube in gradient flow is so uniform that its outcome is known: by the closed dispersion relation,
// theory.md (5.6), all its waves decay from now on, for every radius on the way to rest.
#pragma once

#include <optional>

#include "common/case/problem.hpp"

namespace tubule {

// What a row records of a tube.
struct TubeState {
    double energy = 0, volume = 0, r_min = 0, r_max = 0;
};

class UniformEnd {
public:
    // Empty where the relation does not apply: other models and shapes, a volume that is kept, an f with f_HK.
    static std::optional<UniformEnd> of(const Problem& c);

    // Whether the waves are small, in amplitude and in energy, and each that the symmetry of the start allows decays
    // relative to the radius, by a margin, at every radius from here to the one where the tube rests.
    bool decided(const TubeState& s) const;

private:
    UniformEnd(const Bending& energy, double length, int waves, double floor)
        : energy_(energy), length_(length), waves_(waves), floor_(floor) {}
    bool waves_decay(double R) const;
    double radius_at_rest(double R) const;

    Bending energy_;
    double length_;
    int waves_;     // over the length, of the longest wave that the start has
    double floor_;  // radius at which a run stops
};

}  // namespace tubule
