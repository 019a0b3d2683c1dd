#include "axisym/curve/varying_H0.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "axisym/curve/curve_local.hpp"

namespace tubule::axisym {
namespace {

constexpr int lanes = SplineSpace::lanes;

}  // namespace

Eigen::MatrixXd partial_sums(int points) {
    const GaussRule rule = gauss_rule(points);
    Eigen::MatrixXd out = Eigen::MatrixXd::Zero(points, points);
    for (int i = 0; i < points; ++i)
        for (int q = 0; q < points; ++q) {
            const double x = rule.nodes[i] * rule.nodes[q];
            for (int j = 0; j < points; ++j) {
                double lagrange = 1;
                for (int k = 0; k < points; ++k)
                    if (k != j) lagrange *= (x - rule.nodes[k]) / (rule.nodes[j] - rule.nodes[k]);
                out(i, j) += rule.nodes[i] * rule.weights[q] * lagrange / rule.weights[j];
            }
        }
    return out;
}

namespace {

// Sums of a value at all points up to each of them; and, transposed, of what follows each.
class RunningSums {
public:
    explicit RunningSums(const SplineSpace& splines)
        : points_(lanes * splines.groups()), elements_(splines.elements()), within_(partial_sums(points_)) {}

    template <class Values>  // one row a point
    Eigen::MatrixXd up_to(const Values& of) const {
        Eigen::MatrixXd out(of.rows(), of.cols());
        Eigen::RowVectorXd before = Eigen::RowVectorXd::Zero(of.cols());
        for (int e = 0; e < elements_; ++e) {
            const auto own = of.middleRows(e * points_, points_);
            out.middleRows(e * points_, points_) = within_ * own;
            out.middleRows(e * points_, points_).rowwise() += before;
            before += own.colwise().sum();
        }
        return out;
    }
    Eigen::VectorXd transposed(const Eigen::VectorXd& of) const {
        Eigen::VectorXd out(of.size());
        double after = 0;
        for (int e = elements_ - 1; e >= 0; --e) {
            const auto own = of.segment(e * points_, points_);
            out.segment(e * points_, points_) = (within_.transpose() * own).array() + after;
            after += own.sum();
        }
        return out;
    }

private:
    int points_, elements_;
    Eigen::MatrixXd within_;
};

// Area of the surface per parameter.
double area_density(const CurveSample& p) {
    return 2 * pi * p.r * std::hypot(p.r1, p.z1);
}

// H0 and its derivatives where area, r and z are such jets.
template <class J>
J value_of(const Formula& formula, const J& area, const J& r, const J& z) {
    const J variables[]{area, r, z};
    return evaluate(formula, variables);
}

void require_number(double value, double area) {
    if (!std::isfinite(value))
        throw std::invalid_argument(fmt::format("is no number where {:.4g} of the area is below", area));
}

void require_one_period(const CurveSpace& space, const Formula& formula, const Eigen::VectorXd& x) {
    constexpr double rounding = 1e-6;
    const CurveSample first = space.evaluate(x, 0), last = space.evaluate(x, 1);
    const double from = value_of(formula, 0.0, first.r, first.z), to = value_of(formula, 1.0, last.r, last.z);
    if (std::abs(to - from) > rounding * (1 + std::abs(from)))
        throw std::invalid_argument(fmt::format(
            "must be the same at both ends of the period, but is {:.6g} and {:.6g}; such as -1 + 0.1*cos(2*pi*area)",
            from, to));
}

}  // namespace

VaryingH0 fix_H0(const CurveSpace& space, const Formula& formula, const Eigen::VectorXd& x) {
    using J = Jet<double, 1, 1>;
    const SplineSpace& splines = space.splines();
    const int points = splines.elements() * splines.groups() * lanes;
    Eigen::VectorXd areas(points);
    std::vector<CurveSample> curve;
    const auto each = [&](auto&& visit) {
        for (int e = 0, i = 0; e < splines.elements(); ++e)
            for (int g = 0; g < splines.groups(); ++g)
                for (int q = 0; q < lanes; ++q, ++i) visit(i, splines.basis(e, g), q);
    };
    each([&](int i, const SplineSpace::Basis& basis, int q) {
        curve.push_back(space.evaluate(x, basis.z[q]));
        areas[i] = basis.weight[q] * area_density(curve.back());
    });
    const double whole = space.images() * areas.sum();
    const Eigen::MatrixXd below = RunningSums(splines).up_to(areas);
    VaryingH0 out;
    out.value.resize(points / lanes), out.slope.resize(points / lanes);
    if (!space.closed() && space.images() == 1) require_one_period(space, formula, x);
    each([&](int i, const SplineSpace::Basis&, int q) {
        const CurveSample& p = curve[i];
        J area(below(i, 0) / whole), r(p.r), z(p.z);
        area.d[0] = area_density(p) / whole, r.d[0] = p.r1, z.d[0] = p.z1;
        const J H0 = value_of(formula, area, r, z);
        require_number(H0.v, area.v);
        out.value[i / lanes][q] = H0.v, out.slope[i / lanes][q] = H0.d[0];
    });
    return out;
}

std::vector<double> area_below(const CurveSpace& space, const Eigen::VectorXd& x, const std::vector<double>& s) {
    const std::vector<double>& breaks = space.splines().breaks();
    static const GaussRule rule = gauss_rule(8);
    const auto between = [&](double from, double to) {
        double sum = 0;
        for (std::size_t q = 0; q < rule.nodes.size(); ++q)
            sum += rule.weights[q] * area_density(space.evaluate(x, from + (to - from) * rule.nodes[q]));
        return (to - from) * sum;
    };
    std::vector<double> at_break{0};
    for (std::size_t e = 0; e + 1 < breaks.size(); ++e)
        at_break.push_back(at_break.back() + between(breaks[e], breaks[e + 1]));
    std::vector<double> out;
    for (const double at : s) {
        const int e = space.splines().element_at(at);
        out.push_back((at_break[e] + between(breaks[e], at)) / (space.images() * at_break.back()));
    }
    return out;
}

H0ByArea::H0ByArea(const CurveSpace& space, const Bending& bending, const double* x)
    : space_(space), bending_(bending), x_(x) {
    using J = Jet<double, 1, 2>;
    const SplineSpace& splines = space.splines();
    const int packs = splines.elements() * splines.groups(), points = packs * lanes;
    std::vector<ProfilePoint<Pack>> at;
    Eigen::VectorXd areas(points);
    for (int i = 0; i < packs; ++i) {
        const CurveLocal p(space, i / splines.groups(), i % splines.groups(), x);
        at.push_back(p.point());
        const Pack area = load(splines.basis(i / splines.groups(), i % splines.groups()).weight) * at.back().area;
        for (int q = 0; q < lanes; ++q) areas[i * lanes + q] = area[q];
    }
    area_ = areas.sum();
    const RunningSums sums(splines);
    const Eigen::MatrixXd below = sums.up_to(areas);
    Eigen::VectorXd push(points);  // area times f_H0 dH0/dalpha
    double mean = 0;
    H0_.value.resize(packs), H0_.tension.resize(packs);
    for (int i = 0; i < packs; ++i) {
        for (int q = 0; q < lanes; ++q) {
            const double label = below(i * lanes + q, 0) / (space.images() * area_);
            const J H0 = value_of(*bending.H0_formula, J::variable(label, 0), J(0.0), J(0.0));
            H0_.value[i][q] = H0.v;
            weight_.push_back(areas[i * lanes + q]), label_.push_back(label);
            in_.push_back(H0.d[0]), in2_.push_back(H0.dd[0]);
        }
        f0_.push_back(slope_in_H0(bending, H0_.value[i], at[i].H, at[i].K));
        for (int q = 0; q < lanes; ++q) {
            const int k = i * lanes + q;
            push[k] = weight_[k] * f0_[i].f[q] * in_[k];
            mean += push[k] * label_[k];
        }
    }
    const Eigen::VectorXd after = sums.transposed(push);
    for (int k = 0; k < points; ++k) H0_.tension[k / lanes][k % lanes] = (after[k] / space.images() - mean) / area_;
}

Eigen::MatrixXd H0ByArea::hessian_beyond() const {
    const SplineSpace& splines = space_.splines();
    const int n = space_.size(), points = static_cast<int>(weight_.size());
    Eigen::MatrixXd areas = Eigen::MatrixXd::Zero(points, n), pushes = areas;
    // The row of a point from a jet in (r, r', r'', z', z'').
    const auto add = [&](Eigen::MatrixXd& to, int k, double factor, const auto& jet) {
        const int e = k / lanes / splines.groups(), g = k / lanes % splines.groups(), q = k % lanes;
        for (int field = 0; field < 2; ++field)
            for (int d = first_derivative[field]; d < 3; ++d) {
                const double c = factor * jet.d[first_variable[field] + d - first_derivative[field]][q];
                for (int a = 0; a < splines.width(); ++a)
                    to(k, space_.dof(e, field, a)) +=
                        c * space_.field(field).signs(e)[a] * splines.basis(e, g).by_spline[q][d][a];
            }
    };
    for (int i = 0; i < points / lanes; ++i) {
        const int e = i / splines.groups(), g = i % splines.groups();
        const auto p = CurveLocal(space_, e, g, x_).point<1>();
        for (int q = 0; q < lanes; ++q) {
            const int k = i * lanes + q;
            add(areas, k, splines.basis(e, g).weight[q], p.area);
            pushes.row(k) = f0_[i].f[q] * in_[k] * areas.row(k);
            add(pushes, k, weight_[k] * in_[k] * f0_[i].H[q], p.H);
            add(pushes, k, weight_[k] * in_[k] * f0_[i].K[q], p.K);
        }
    }
    // d(label) of each point.
    const Eigen::RowVectorXd whole = areas.colwise().sum();
    Eigen::MatrixXd labels = RunningSums(splines).up_to(areas) / (space_.images() * area_);
    Eigen::VectorXd second(points), push(points);
    for (int k = 0; k < points; ++k) {
        labels.row(k) -= label_[k] / area_ * whole;
        const SlopeInH0<Pack>& f0 = f0_[k / lanes];
        const int q = k % lanes;
        second[k] = weight_[k] * (f0.H0[q] * in_[k] * in_[k] + f0.f[q] * in2_[k]);
        push[k] = weight_[k] * f0.f[q] * in_[k];
    }
    pushes -= push / area_ * whole;
    Eigen::MatrixXd out = labels.transpose() * second.asDiagonal() * labels;
    const Eigen::MatrixXd mixed = pushes.transpose() * labels;
    out += mixed + mixed.transpose();
    return space_.images() * out;
}

}  // namespace tubule::axisym
