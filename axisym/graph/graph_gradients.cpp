#include "axisym/graph/graph_gradients.hpp"

#include <algorithm>
#include <array>

#include "axisym/splines/pack.hpp"
#include "common/geometry/jet.hpp"
#include "common/geometry/profile_point.hpp"

namespace tubule::axisym {
namespace {

namespace stdx = std::experimental;
constexpr int lanes = SplineSpace::lanes;
constexpr int wide = SplineSpace::max_width;
using Radii = std::array<Pack, 4>;  // r and its derivatives

// |grad H|^2 dS/dz of a whole turn in r, r', r'', r'''; by Codazzi kappa_theta' = (r'/r) (kappa_s - kappa_theta).
template <int Order>
Jet<Pack, 4, Order> density(const Radii& at) {
    using J = Jet<Pack, 4, Order>;
    const J r = J::variable(at[0], 0), r1 = J::variable(at[1], 1), r2 = J::variable(at[2], 2),
            r3 = J::variable(at[3], 3);
    const J ig = inverse_sqrt(r1 * r1 + 1.0), ig2 = ig * ig, ig3 = ig2 * ig, slope = r1 * inverse(r);
    const J kappa_s = r2 * ig3, kappa_theta = -(ig * inverse(r));
    const J H_z = r3 * ig3 - 3.0 * (kappa_s * (r1 * r2 * ig2)) + slope * (kappa_s - kappa_theta);
    return (2 * pi) * (r * ig * (H_z * H_z));
}

}  // namespace

template <class Visit>
void GraphGradients::each_group(const double* x, const Visit& visit) const {
    for (int e = 0; e < space_.elements(); ++e)
        for (int g = 0; g < space_.groups(); ++g) {
            const auto& basis = space_.basis(e, g);
            const ThirdDerivatives::Group& third = third_.at(e, g);
            Radii r{Pack(0.0), Pack(0.0), Pack(0.0), Pack(0.0)};
            for (int a = 0; a < space_.width(); ++a) {
                const double c = x[space_.dofs(e)[a]];
                for (int d = 0; d < 3; ++d) r[d] += c * load(basis.by_point[d][a]);
                r[3] += c * load(third.by_point[a]);
            }
            const double* splines[lanes][4];
            for (int q = 0; q < lanes; ++q)
                for (int d = 0; d < 4; ++d) splines[q][d] = d < 3 ? basis.by_spline[q][d] : third.by_spline[q];
            visit(e, load(basis.weight), splines, r);
        }
}

double GraphGradients::value(const double* x) const {
    Pack sum{0.0};
    each_group(x, [&](int, const Pack& weight, const auto&, const Radii& r) { sum += weight * density<1>(r).v; });
    return images_ * stdx::reduce(sum);
}

std::vector<double> GraphGradients::stiffness(double weight, const double* x) const {
    std::vector<double> out(space_.elements(), 0.0);
    each_group(x, [&](int e, const Pack& dz, const auto&, const Radii& r) {
        const Pack g2 = r[1] * r[1] + 1.0;
        out[e] += weight * images_ * stdx::reduce(4 * pi * dz * r[0] * stdx::sqrt(g2) / (g2 * g2 * g2 * g2));
    });
    return out;
}

void GraphGradients::add_gradient(double weight, const double* x, double* out) const {
    each_group(x, [&](int e, const Pack& dz, const auto& splines, const Radii& r) {
        const auto f = density<1>(r);
        alignas(32) double c[4][lanes];
        for (int d = 0; d < 4; ++d) store(weight * images_ * dz * f.d[d], c[d]);
        Pack low{0.0}, high{0.0};
        for (int q = 0; q < lanes; ++q)
            for (int d = 0; d < 4; ++d) {
                low += c[d][q] * load(splines[q][d]);
                high += c[d][q] * load(splines[q][d] + lanes);
            }
        alignas(32) double local[wide];
        store(low, local), store(high, local + lanes);
        for (int a = 0; a < space_.width(); ++a) out[space_.dofs(e)[a]] += local[a];
    });
}

void GraphGradients::add_hessian(double weight, const double* x, const std::vector<int>& slots, double* values) const {
    const int w = space_.width();
    each_group(x, [&](int e, const Pack& dz, const auto& splines, const Radii& r) {
        const auto f = density<2>(r);
        alignas(32) double c[4][4][lanes];
        for (int i = 0; i < 4; ++i)
            for (int j = 0; j < 4; ++j) store(weight * images_ * dz * f.dd[packed<4>(i, j)], c[i][j]);
        const int* slot = &slots[static_cast<std::size_t>(e) * w * w];
        for (int half = 0; half * lanes < w; ++half) {
            Pack columns[wide];
            std::fill_n(columns, w, Pack(0.0));
            for (int q = 0; q < lanes; ++q)
                for (int d = 0; d < 4; ++d) {
                    Pack rows{0.0};  // contracted with the splines of the rows
                    for (int k = 0; k < 4; ++k) rows += c[d][k][q] * load(splines[q][k] + half * lanes);
                    for (int b = 0; b < w; ++b) columns[b] += splines[q][d][b] * rows;
                }
            for (int b = 0; b < w; ++b)
                for (int a = half * lanes; a < std::min(w, (half + 1) * lanes); ++a)
                    values[slot[b * w + a]] += columns[b][a - half * lanes];
        }
    });
}

double GraphGradients::stretch_slope(const double* x) const {
    Pack sum{0.0};
    each_group(x, [&](int, const Pack& dz, const auto&, const Radii& r) {
        const auto f = density<1>(r);
        sum += dz * (f.v - r[1] * f.d[1] - 2 * r[2] * f.d[2] - 3 * r[3] * f.d[3]);
    });
    return images_ * stdx::reduce(sum);
}

}  // namespace tubule::axisym
