// The ring of a patch through which an inextensible membrane flows in from a reservoir beyond it: conditions on the
// velocity there, bilinear in curve and velocity, and the pull of the reservoir. theory.md (3.25).
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <array>
#include <vector>

#include "axisym/splines/curve_space.hpp"
#include "common/energy/bending.hpp"
#include "common/model/model.hpp"

namespace tubule::axisym {

class OpenRim {
public:
    // At the end 0 or 1 of the space, which must outlive it.
    OpenRim(const CurveSpace& space, int end, Rim rim);

    // Matrices B of the conditions x.B u = 0: no velocity along the normal and, where the ring is clamped, no turning.
    const std::vector<Eigen::SparseMatrix<double>>& conditions() const { return conditions_; }

    // The force of the reservoir, -2 pi r (tension + f + W) along the membrane and inward, as the rows of a velocity:
    // their numbers, values, and derivatives in the coefficients `columns` of the curve.
    struct Pull {
        std::array<int, 2> rows;
        Eigen::Vector2d values;
        std::vector<int> columns;
        Eigen::Matrix<double, 2, Eigen::Dynamic> slopes;
    };
    Pull pull(const Bending& bending, double tension, const double* x) const;
    // What the volume of the space's curves, INT pi r^2 z' ds, has of an end that moves, although no membrane sweeps
    // it: outward pi r^2 by z; and its derivative by r.
    struct VolumeAtEnd {
        int r, z;  // coefficients
        double by_z, by_z_r;
    };
    VolumeAtEnd volume_at_end(const double* x) const;
    // 2 pi r u.t for the velocity u, t outward along the membrane: the rate at which area leaves; and |u|^2.
    std::array<double, 2> outflow(const double* x, const double* u) const;

private:
    // Coefficients of the curve, r and then z, and derivatives 0, 1, 2 of their splines at the end.
    struct Dof {
        int number;
        std::array<double, 3> at_end;
    };
    const CurveSpace& space_;
    double outward_;
    std::array<std::vector<Dof>, 2> dofs_;
    std::vector<Eigen::SparseMatrix<double>> conditions_;
};

}  // namespace tubule::axisym
