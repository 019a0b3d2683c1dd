#include "axisym/curve/shape_integrals.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "axisym/curve/varying_H0.hpp"
#include "axisym/splines/spline_space.hpp"

namespace tubule::axisym {
namespace {

constexpr int points = 16;  // of each panel

const GaussRule& rule() {
    static const GaussRule rule = gauss_rule(points);
    return rule;
}

// Calls visit(from, width) for about this number of panels, none of which contains a seam.
template <class Visit>
void each_panel(const Curve& m, int panels, const Visit& visit) {
    std::vector<double> edges{0};
    edges.insert(edges.end(), m.seams.begin(), m.seams.end());
    edges.push_back(1);
    for (std::size_t k = 0; k + 1 < edges.size(); ++k) {
        const double length = edges[k + 1] - edges[k];
        const int n = std::max(1, static_cast<int>(std::ceil(panels * length)));
        for (int i = 0; i < n; ++i) visit(edges[k] + length * i / n, length / n);
    }
}

// D(i, j): the derivative at point i of the polynomial that is 1 at point j and 0 at the others.
Eigen::MatrixXd differentiation() {
    const std::vector<double>& x = rule().nodes;
    Eigen::VectorXd product = Eigen::VectorXd::Ones(points);
    for (int i = 0; i < points; ++i)
        for (int k = 0; k < points; ++k)
            if (k != i) product[i] *= x[i] - x[k];
    Eigen::MatrixXd D = Eigen::MatrixXd::Zero(points, points);
    for (int i = 0; i < points; ++i)
        for (int j = 0; j < points; ++j)
            if (i != j) {
                D(i, j) = product[i] / (product[j] * (x[i] - x[j]));
                D(i, i) -= D(i, j);
            }
    return D;
}

using PanelValues = Eigen::Matrix<double, points, 4>;  // r, r', z, z' at the points of a panel

ShapeEnergy energy_on_panels(const Curve& m, const Bending& bending, int panels, double area) {
    static const Eigen::MatrixXd D = differentiation(), within = partial_sums(points);
    ShapeEnergy sum;
    sum.energy_term.resize(count_terms(bending));
    const std::optional<Formula> W = potential_density(bending.potentials);
    double below = 0;
    each_panel(m, panels, [&](double from, double width) {
        PanelValues at;
        for (int i = 0; i < points; ++i) at.row(i) = Eigen::RowVector4d(m.at(from + width * rule().nodes[i]).data());
        const Eigen::Matrix<double, points, 4> slope = D * at / width;
        Eigen::Matrix<double, points, 1> dA;
        for (int i = 0; i < points; ++i)
            dA[i] = width * rule().weights[i] * 2 * pi * at(i, 0) * std::hypot(at(i, 1), at(i, 3));
        const Eigen::VectorXd label = ((within * dA).array() + below) / area;
        Eigen::Matrix<double, points, 1> H;
        for (int i = 0; i < points; ++i) {
            const auto p = profile_point(at(i, 0), at(i, 1), slope(i, 1), at(i, 3), slope(i, 3));
            H[i] = p.H;
            const double variables[]{label[i], at(i, 0), at(i, 2)};
            const double H0 = bending.H0_varies() ? evaluate(*bending.H0_formula, variables) : bending.H0;
            for_each_value_at(bending, H0, p.H, p.K,
                              [&](std::size_t k, double value) { sum.energy_term[k] += m.images() * value * dA[i]; });
            if (W) {
                const double place[]{at(i, 0), at(i, 2)}, here = m.images() * evaluate(*W, place) * dA[i];
                sum.potential += here, sum.magnitude += std::abs(here);
            }
            sum.M += m.images() * p.H * dA[i];
            sum.magnitude += m.images() * magnitude(bending, H0, p.H, p.K) * dA[i];
        }
        below += dA.sum();
        if (bending.kg == 0) return;
        const Eigen::ArrayXd H_s = D * H / width;
        sum.energy_kg += m.images() * bending.kg *
                         (H_s.square() / (at.col(1).array().square() + at.col(3).array().square()) * dA.array()).sum();
    });
    if (is_patch(m.topology)) sum.magnitude += patch_scale(bending, std::max(m.at(0)[0], m.at(1)[0]));
    sum.energy = sum.energy_alpha = area_difference_energy(bending, sum.M);
    sum.magnitude += sum.energy_alpha + sum.energy_kg;
    sum.energy += sum.potential + sum.energy_kg;
    for (const double term : sum.energy_term) sum.energy += term;
    return sum;
}

}  // namespace

double patch_scale(const Bending& bending, double radius) {
    return 2 * pi * radius * radius * magnitude(bending, bending.H0, -2 / radius, 1 / (radius * radius));
}

std::array<double, 2> area_and_volume(const Curve& m) {
    double area = 0, volume = 0;
    each_panel(m, 64, [&](double from, double width) {
        for (int i = 0; i < points; ++i) {
            const auto [r, r1, z, z1] = m.at(from + width * rule().nodes[i]);
            area += width * rule().weights[i] * 2 * pi * r * std::hypot(r1, z1);
            volume += width * rule().weights[i] * pi * r * r * z1;
        }
    });
    return {m.images() * area, m.images() * volume};
}

ShapeEnergy bending_energy(const Curve& m, const Bending& bending) {
    constexpr int first = 32, most = 1024;
    constexpr double enough = 1e-11;
    const double area = area_and_volume(m)[0];
    ShapeEnergy found = energy_on_panels(m, bending, first, area);
    for (int panels = 2 * first; panels <= most; panels *= 2) {
        const double before = found.energy;
        found = energy_on_panels(m, bending, panels, area);
        if (!(std::abs(found.energy - before) > enough * found.magnitude)) break;
    }
    return found;
}

}  // namespace tubule::axisym
