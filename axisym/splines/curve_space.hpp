// Splines of a parameter s in [0, 1] for profile curves X(s) = (r, z) and for the fields on them. Every field shares
// the splines of one ProfileSpace; how it continues beyond the two ends, by reflection with a sign, is its own matter.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "axisym/splines/profile_space.hpp"
#include "common/shapes/meridian.hpp"

namespace tubule::axisym {

// Under reflection at s = 0 and at s = 1: +1 even, -1 odd. Without meaning on a periodic cell.
struct Parity {
    int start = 1, end = 1;
};

// A scalar field: which coefficient, with which sign, each active spline of an element carries. The ProfileSpace must
// outlive it.
class Field {
public:
    Field(const ProfileSpace& splines, Parity parity);

    int size() const { return size_; }
    const ProfileSpace& splines() const { return *splines_; }
    const int* dofs(int element) const { return &dofs_[element * splines_->width()]; }
    // +1, -1, or 0 where the spline is absent from fields of this parity (its dof is then 0).
    const double* signs(int element) const { return &signs_[element * splines_->width()]; }

    // Value, first and second derivative at s.
    std::array<double, 3> evaluate(const double* coefficients, double s) const;
    // The derivative of order `degree`, constant on each element.
    double top_derivative(const double* coefficients, int element) const;
    // The coefficients, least squares at the quadrature points, of f(s): exact if f is in this space. Throws SolveError
    // if the mesh is degenerate.
    template <class F>
    Eigen::VectorXd project(F&& f) const {
        Eigen::VectorXd load = Eigen::VectorXd::Zero(size_);
        for (int e = 0; e < splines_->elements(); ++e) {
            if (e % 64 == 0) check_pause();  // the function may take its time
            for (int g = 0; g < splines_->groups(); ++g) {
                const ProfileSpace::Basis& b = splines_->basis(e, g);
                for (int q = 0; q < ProfileSpace::lanes; ++q) {
                    const double value = b.weight[q] * f(b.z[q]);
                    for (int a = 0; a < splines_->width(); ++a)
                        load[dofs(e)[a]] += signs(e)[a] * value * b.by_spline[q][0][a];
                }
            }
        }
        return solve_mass(load);
    }
    // INT phi ds of each spline: the functional of the mean.
    Eigen::VectorXd mean() const;

private:
    Eigen::VectorXd solve_mass(const Eigen::VectorXd& load) const;

    const ProfileSpace* splines_;
    int size_ = 0;
    std::vector<int> dofs_;
    std::vector<double> signs_;
};

struct CurvePoint {
    double r, r1, r2, z, z1, z2;  // with derivatives in s
};

// Curves run such that the outward normal is (z', -r')/|X'|: upwards on the outside. A vector of size() numbers holds
// the coefficients of r, followed by those of z less rise s, and by the rise itself where the period is free.
class CurveSpace {
public:
    // Breaks ascend from 0 to 1; degree 3, 5 or 7; 1 <= smoothness < degree; `length` is the period of a tube, at the
    // start if the period is free, and is 0 for cells. Throws std::invalid_argument.
    CurveSpace(Topology topology, std::vector<double> breaks, int degree, int smoothness, double length = 0,
               bool free_period = false);
    CurveSpace(const CurveSpace&) = delete;  // its fields refer to its splines
    CurveSpace& operator=(const CurveSpace&) = delete;

    Topology topology() const { return topology_; }
    bool closed() const { return topology_ == Topology::cell || topology_ == Topology::half_cell; }
    // The period, and the rise of the curve from s = 0 to s = 1: initially, and of a curve x.
    double length() const { return length_; }
    double rise() const { return topology_ == Topology::half_tube ? length_ / 2 : length_; }
    double rise(const double* x) const { return free_period_ ? x[shape_size()] : rise(); }
    double length(const double* x) const { return free_period_ ? images() * rise(x) : length_; }
    bool free_period() const { return free_period_; }
    // Copies of the curve in the whole cell or period.
    int images() const { return topology_ == Topology::half_cell || topology_ == Topology::half_tube ? 2 : 1; }
    const ProfileSpace& splines() const { return splines_; }
    const Field& r() const { return r_; }
    const Field& z() const { return z_; }
    // Numbers of coefficients: of r and z; and with a free rise, which stands last.
    int shape_size() const { return r_.size() + z_.size(); }
    int size() const { return shape_size() + (free_period_ ? 1 : 0); }

    // Parities of other fields: scalars (pressure, curvatures, normal velocity), and vectors in the meridian plane
    // component by component; a swirl u_theta is like r.
    Parity scalar_parity() const { return {}; }
    Parity r_parity() const;
    Parity z_parity() const;

    CurvePoint evaluate(const Eigen::VectorXd& x, double s) const;
    // The curve s -> {r, z}, by projection.
    template <class F>
    Eigen::VectorXd project(F&& f) const {
        Eigen::VectorXd x(size());
        x.head(r_.size()) = r_.project([&](double s) { return f(s)[0]; });
        x.segment(r_.size(), z_.size()) = z_.project([&](double s) { return f(s)[1] - rise() * s; });
        if (free_period_) x[shape_size()] = rise();
        return x;
    }
    // The curve x of another space of this topology; the same curve if those knots are all here too.
    Eigen::VectorXd prolong(const CurveSpace& other, const Eigen::VectorXd& x) const;

private:
    Topology topology_;
    double length_;
    bool free_period_;
    ProfileSpace splines_;
    Field r_, z_;
};

// Breaks of n equal elements of [0, 1].
std::vector<double> equal_breaks(int n);

}  // namespace tubule::axisym
