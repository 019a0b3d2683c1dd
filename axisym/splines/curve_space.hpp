// Profile curves X(s) = (r, z), 0 <= s <= 1, as splines, and the parities of the fields on them.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "axisym/splines/spline_space.hpp"
#include "common/shapes/curve.hpp"

namespace tubule::axisym {

// Curves run such that the outward normal is (z', -r')/|X'|: upwards on the outside. A vector of size() numbers holds
// the coefficients of r, followed by those of z less rise s, and by the rise itself where the period is free.
class CurveSpace {
public:
    // Breaks ascend from 0 to 1; degree 3, 5 or 7; 1 <= smoothness < degree; `length` is the period of a tube, at the
    // start if the period is free, and is 0 for cells and patches. Throws std::invalid_argument.
    CurveSpace(Topology topology, std::vector<double> breaks, int degree, int smoothness, double length = 0,
               bool free_period = false);

    Topology topology() const { return topology_; }
    bool closed() const { return is_closed(topology_); }
    bool is_patch() const { return tubule::is_patch(topology_); }
    // Whether the curve ends at a pole: there r is odd and z even.
    bool begins_at_pole() const { return closed(); }
    bool ends_at_pole() const { return topology_ == Topology::cell || topology_ == Topology::cap; }
    // The period, and the rise of the curve from s = 0 to s = 1: initially, and of a curve x.
    double length() const { return length_; }
    double rise() const { return topology_ == Topology::half_tube ? length_ / 2 : length_; }
    double rise(const double* x) const { return free_period_ ? x[shape_size()] : rise(); }
    double length(const double* x) const { return free_period_ ? images() * rise(x) : length_; }
    bool free_period() const { return free_period_; }
    // Copies of the curve in the whole cell or period.
    int images() const { return topology_ == Topology::half_cell || topology_ == Topology::half_tube ? 2 : 1; }
    const SplineSpace& r() const { return r_; }
    const SplineSpace& z() const { return z_; }
    const SplineSpace& splines() const { return r_; }  // for what r and z have in common
    // r and z by their number 0, 1; where the coefficients of that field begin; and the coefficient of the active
    // spline a of element e.
    const SplineSpace& field(int i) const { return i == 0 ? r_ : z_; }
    int offset(int i) const { return i == 0 ? 0 : r_.size(); }
    int dof(int e, int i, int a) const { return offset(i) + field(i).dofs(e)[a]; }
    // Adds what each active spline of element e in a field contributes to `out`, of size() numbers.
    void add(int e, int i, const double* local, double* out) const { field(i).add(e, local, out + offset(i)); }
    // Numbers of coefficients: of r and z; and with a free rise, which stands last.
    int shape_size() const { return r_.size() + z_.size(); }
    int size() const { return shape_size() + (free_period_ ? 1 : 0); }

    // Vectors in the meridian plane have these parities component by component; a swirl u_theta is like r. Scalars
    // (pressure, curvatures, normal velocity) are even.
    Parity r_parity() const;
    Parity z_parity() const;

    CurveSample evaluate(const Eigen::VectorXd& x, double s) const;
    // The curve s -> {r, z}, by projection.
    template <class F>
    Eigen::VectorXd project(F&& f) const {
        return solve_mass(r_.load([&](double s) { return f(s)[0]; }),
                          z_.load([&](double s) { return f(s)[1] - rise() * s; }));
    }
    // The curve x of another space of this topology; the same curve if those knots are all here too.
    Eigen::VectorXd prolong(const CurveSpace& other, const Eigen::VectorXd& x) const;

private:
    Eigen::VectorXd solve_mass(const Eigen::VectorXd& load_of_r, const Eigen::VectorXd& load_of_z) const;

    Topology topology_;
    double length_;
    bool free_period_;
    SplineSpace r_, z_;
};

}  // namespace tubule::axisym
