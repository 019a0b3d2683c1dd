#include "axisym/splines/curve_space.hpp"

#include <stdexcept>

#include "common/solve/sparse.hpp"

namespace tubule::axisym {

CurveSpace::CurveSpace(Topology topology, std::vector<double> breaks, int degree, int smoothness, double length,
                       bool free_period)
    : topology_(topology),
      length_(length),
      free_period_(free_period),
      r_({0, 1, topology != Topology::tube, 1, tubule::is_patch(topology), topology == Topology::strip},
         std::move(breaks), degree, smoothness, r_parity()),
      z_(r_, z_parity()) {
    if (degree != 3 && degree != 5 && degree != 7) throw std::invalid_argument("spline degree must be 3, 5 or 7");
    if (r_.breaks().front() != 0 || r_.breaks().back() != 1) throw std::invalid_argument("breaks must run from 0 to 1");
    if (free_period && !(length > 0)) throw std::invalid_argument("only the period of a tube can be free");
    if (!(length >= 0) || ((closed() || is_patch()) && length != 0))
        throw std::invalid_argument("the length must be positive for a tube, 0 for a torus, a closed cell or a patch");
}

Parity CurveSpace::r_parity() const {
    return {begins_at_pole() ? -1 : 1, ends_at_pole() ? -1 : 1};
}

Parity CurveSpace::z_parity() const {
    return {begins_at_pole() ? 1 : -1, ends_at_pole() ? 1 : -1};
}

CurveSample CurveSpace::evaluate(const Eigen::VectorXd& x, double s) const {
    const auto [r, r1, r2] = r_.evaluate(x.data(), s);
    const auto [z, z1, z2] = z_.evaluate(x.data() + r_.size(), s);
    return {r, r1, r2, z + rise(x.data()) * s, z1 + rise(x.data()), z2};
}

// By the sparse solver, not by bands: the steps of IDA depend on how an initial curve is rounded.
Eigen::VectorXd CurveSpace::solve_mass(const Eigen::VectorXd& load_of_r, const Eigen::VectorXd& load_of_z) const {
    const auto solved = [](const SplineSpace& field, const Eigen::VectorXd& load) {
        SparseLu lu;
        lu.factor(field.mass());
        return lu.solve(load);
    };
    Eigen::VectorXd x(size());
    x.head(r_.size()) = solved(r_, load_of_r);
    x.segment(r_.size(), z_.size()) = solved(z_, load_of_z);
    if (free_period_) x[shape_size()] = rise();
    return x;
}

Eigen::VectorXd CurveSpace::prolong(const CurveSpace& other, const Eigen::VectorXd& x) const {
    if (other.topology_ != topology_ || other.length_ != length_ || other.free_period_ != free_period_)
        throw std::invalid_argument("curves of different topology or period cannot be prolonged to each other");
    const double excess = other.rise(x.data()) - rise();  // of a free period
    Eigen::VectorXd out = project([&](double s) {
        const CurveSample p = other.evaluate(x, s);
        return std::array{p.r, p.z - excess * s};
    });
    if (free_period_) out[shape_size()] += excess;
    return out;
}

}  // namespace tubule::axisym
