// A law of motion, theory.md (3.1), as a step of tier 2 solves for it.
#pragma once

#include <Eigen/Core>
#include <algorithm>

#include "common/model/model.hpp"
#include "surface3d/motion/extent.hpp"

namespace tubule::surface3d {

struct SurfaceLaw : MotionLaw {
    SurfaceLaw(const MotionLaw& law) : MotionLaw(law) {}

    // The tangential velocity has inertia or viscosity: u has three components. Else u.nu is all that is unknown of u,
    // and its tangential part is -grad p/friction, or zero where the membrane is extensible.
    bool flows = inertia != 0 || viscosity != 0;

    int components() const { return flows ? 3 : 1; }

    // F - E of a surface at a time, theory.md (3.16), and how fast its loads change it.
    double potential(double time, const Extent& of) const {
        return loads_at(*this, time).energy(of.area, of.volume, of.length);
    }
    double power(double time, const Extent& of) const {
        return load_rates(*this, time).energy(of.area, of.volume, of.length);
    }
    // The rate of F - E where the extent of a surface that encloses `volume` changes at a rate.
    double potential_rate(double time, const Extent& rate, double volume) const {
        const Loads loads = loads_at(*this, time);
        return loads.tension * rate.area - loads.pressure_at(volume) * rate.volume - loads.force * rate.length;
    }
    // Sources at a point and a time: force and membrane per area.
    Eigen::Vector3d body_force(const Eigen::Vector3d& x, double time) const {
        const double at[]{x[0], x[1], x[2], time};
        return {source.force_at(0, at), source.force_at(1, at), source.force_at(2, at)};
    }
    double mass_source(const Eigen::Vector3d& x, double time) const {
        const double at[]{x[0], x[1], x[2], time};
        return source.mass_at(at);
    }
    bool holds_distance() const { return beads && beads->extension; }
    // The rate, too: with inertia the velocity jumps where it does.
    bool holds_rate() const { return holds_distance() && inertia != 0; }
};

}  // namespace tubule::surface3d
