// The state of a moving surface, and one step of it.
#pragma once

#include <cmath>
#include <memory>

#include "surface3d/fem/surface_space.hpp"

namespace tubule {
class RecordWriter;
}

namespace tubule::surface3d {

struct MotionState;

// What a time scheme remembers beside the state of the surface: its own history.
class SchemeMemory {
public:
    virtual ~SchemeMemory() = default;
    virtual void save(RecordWriter& out, const MotionState& state) const = 0;  // under names restart_...
};

// Nodal values at a time.
struct MotionState {
    double time = 0;
    double step = 0;                 // that led here; 0 initially
    VectorField X, w;                // positions, their velocity without stretch z e_z
    Eigen::VectorXd u;               // velocity as in MotionUnknowns, component by component, without the same
    Eigen::VectorXd p;               // pressure, at the nodes of its own order
    double lambda = 0;               // multiplier of the volume; 0 where that is free
    double tension = 0;              // multiplier of the area as a whole; 0 where that is free or p holds it
    double force = 0;                // multiplier of the distance of beads; 0 where that is free
    double period = 0, stretch = 0;  // of a tube: length, and the rate at which it grows over itself
    // What the scheme that made the step keeps; null initially, and for schemes that keep nothing. Steps share it: it
    // is never modified, each step creates its own.
    std::shared_ptr<const SchemeMemory> memory;
};

struct MotionStep {
    MotionState state;
    double error = 0;       // of the positions over this step along the normal, largest, estimated;
    int order = 2;          // it grows with the power order + 1 of the length of the step
    double correction = 0;  // energy spent on the correction of area and volume
};

// Whether positions, velocities and multipliers are finite.
inline bool is_finite(const MotionState& s) {
    return s.X.allFinite() && s.w.allFinite() && s.u.allFinite() && s.p.allFinite() && std::isfinite(s.lambda) &&
           std::isfinite(s.tension) && std::isfinite(s.force) && std::isfinite(s.period) && std::isfinite(s.stretch);
}

// by z e_z at the nodes.
inline VectorField stretched(const VectorField& X, double by) {
    VectorField out = VectorField::Zero(3, X.cols());
    out.row(2) = by * X.row(2);
    return out;
}

}  // namespace tubule::surface3d
