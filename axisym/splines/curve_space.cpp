#include "axisym/splines/curve_space.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "common/solve/sparse.hpp"

namespace tubule::axisym {
// Raw spline i of degree p has the knots i ... i + p + 1; element e sees the splines from e m + m - 1 - p on, m being
// the multiplicity of knots. Reflection at s = 0 takes spline i to low - i, at s = 1 to high - i.
Field::Field(const ProfileSpace& splines, Parity parity) : splines_(&splines) {
    const int w = splines.width(), n = splines.elements();
    if (!splines.cell().mirror) {
        dofs_.assign(splines.dofs(0), splines.dofs(0) + n * w);
        signs_.assign(n * w, 1);
        size_ = splines.size();
        return;
    }
    const int m = splines.degree() - splines.smoothness(), low = m - 2 - splines.degree(), high = low + 2 * n * m;
    // A spline that is its own mirror image is absent from odd fields.
    const int first = ((low + 1) >> 1) + (low % 2 == 0 && parity.start < 0 ? 1 : 0);
    const int last = (high >> 1) - (high % 2 == 0 && parity.end < 0 ? 1 : 0);
    size_ = last - first + 1;
    for (int e = 0; e < n; ++e)
        for (int a = 0; a < w; ++a) {
            int i = e * m + m - 1 - splines.degree() + a;
            double sign = 1;
            while (2 * i < low || 2 * i > high) {
                const bool below = 2 * i < low;
                i = (below ? low : high) - i;
                sign *= below ? parity.start : parity.end;
            }
            const bool absent = i < first || i > last;
            dofs_.push_back(absent ? 0 : i - first);
            signs_.push_back(absent ? 0 : sign);
        }
}

std::array<double, 3> Field::evaluate(const double* c, double s) const {
    double values[3 * ProfileSpace::max_width];
    const int e = splines_->element_at(s), w = splines_->width();
    splines_->splines(e, s, 2, values);
    std::array<double, 3> out{};
    for (int d = 0; d < 3; ++d)
        for (int a = 0; a < w; ++a) out[d] += values[d * w + a] * signs(e)[a] * c[dofs(e)[a]];
    return out;
}

double Field::top_derivative(const double* c, int element) const {
    double sum = 0;
    for (int a = 0; a < splines_->width(); ++a)
        sum += splines_->top_derivatives(element)[a] * signs(element)[a] * c[dofs(element)[a]];
    return sum;
}

Eigen::VectorXd Field::mean() const {
    Eigen::VectorXd out = Eigen::VectorXd::Zero(size_);
    for (int e = 0; e < splines_->elements(); ++e)
        for (int g = 0; g < splines_->groups(); ++g) {
            const ProfileSpace::Basis& b = splines_->basis(e, g);
            for (int q = 0; q < ProfileSpace::lanes; ++q)
                for (int a = 0; a < splines_->width(); ++a)
                    out[dofs(e)[a]] += signs(e)[a] * b.weight[q] * b.by_spline[q][0][a];
        }
    return out;
}

Eigen::VectorXd Field::solve_mass(const Eigen::VectorXd& load) const {
    const int w = splines_->width();
    std::vector<Eigen::Triplet<double>> entries;
    entries.reserve(splines_->elements() * w * w);
    for (int e = 0; e < splines_->elements(); ++e)
        for (int a = 0; a < w; ++a)
            for (int b = 0; b < w; ++b) {
                if (signs(e)[a] * signs(e)[b] == 0) continue;
                double sum = 0;
                for (int g = 0; g < splines_->groups(); ++g) {
                    const ProfileSpace::Basis& basis = splines_->basis(e, g);
                    for (int q = 0; q < ProfileSpace::lanes; ++q)
                        sum += basis.weight[q] * basis.by_spline[q][0][a] * basis.by_spline[q][0][b];
                }
                entries.emplace_back(dofs(e)[a], dofs(e)[b], signs(e)[a] * signs(e)[b] * sum);
            }
    Eigen::SparseMatrix<double> mass(size_, size_);
    mass.setFromTriplets(entries.begin(), entries.end());
    SparseLu lu;
    lu.factor(mass);
    return lu.solve(load);
}

CurveSpace::CurveSpace(Topology topology, std::vector<double> breaks, int degree, int smoothness, double length,
                       bool free_period)
    : topology_(topology),
      length_(length),
      free_period_(free_period),
      splines_({0, 1, topology != Topology::tube, 1}, std::move(breaks), degree, smoothness),
      r_(splines_, r_parity()),
      z_(splines_, z_parity()) {
    if (degree != 3 && degree != 5 && degree != 7) throw std::invalid_argument("spline degree must be 3, 5 or 7");
    if (splines_.breaks().front() != 0 || splines_.breaks().back() != 1)
        throw std::invalid_argument("breaks must run from 0 to 1");
    if (free_period && !(length > 0)) throw std::invalid_argument("only the period of a tube can be free");
    if (!(length >= 0) || (closed() && length != 0))
        throw std::invalid_argument("the length must be positive for a tube, 0 for a torus or a closed cell");
}

Parity CurveSpace::r_parity() const {
    return closed() ? Parity{-1, topology_ == Topology::cell ? -1 : 1} : Parity{1, 1};
}

Parity CurveSpace::z_parity() const {
    return closed() ? Parity{1, topology_ == Topology::cell ? 1 : -1} : Parity{-1, -1};
}

CurvePoint CurveSpace::evaluate(const Eigen::VectorXd& x, double s) const {
    const auto [r, r1, r2] = r_.evaluate(x.data(), s);
    const auto [z, z1, z2] = z_.evaluate(x.data() + r_.size(), s);
    return {r, r1, r2, z + rise(x.data()) * s, z1 + rise(x.data()), z2};
}

Eigen::VectorXd CurveSpace::prolong(const CurveSpace& other, const Eigen::VectorXd& x) const {
    if (other.topology_ != topology_ || other.length_ != length_ || other.free_period_ != free_period_)
        throw std::invalid_argument("curves of different topology or period cannot be prolonged to each other");
    const double excess = other.rise(x.data()) - rise();  // of a free period
    Eigen::VectorXd out = project([&](double s) {
        const CurvePoint p = other.evaluate(x, s);
        return std::array{p.r, p.z - excess * s};
    });
    if (free_period_) out[shape_size()] += excess;
    return out;
}

std::vector<double> equal_breaks(int n) {
    std::vector<double> breaks(n + 1);
    for (int i = 0; i <= n; ++i) breaks[i] = static_cast<double>(i) / n;
    return breaks;
}

}  // namespace tubule::axisym
