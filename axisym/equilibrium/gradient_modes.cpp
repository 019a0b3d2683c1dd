#include "axisym/equilibrium/gradient_modes.hpp"

#include "common/geometry/jet.hpp"

namespace tubule::axisym {
namespace {

using J = Jet<Pack, 10, 2>;  // in the displacement and its derivatives
using S = Jet<J, 2, 1>;      // with the derivatives in s and theta of that

// The number of the variable d_s^i d_theta^j w, i + j <= 3. Those with even j go with cos(m theta), the others with
// sin.
constexpr int variable_of[4][4] = {{0, 4, 7, 9}, {1, 5, 8, -1}, {2, 6, -1, -1}, {3, -1, -1, -1}};
struct Order {
    int s, theta;
};
constexpr Order order_of[10] = {{0, 0}, {1, 0}, {2, 0}, {3, 0}, {0, 1}, {1, 1}, {2, 1}, {0, 2}, {1, 2}, {0, 3}};

J constant(const Pack& value) {
    J out;
    out.v = value;
    return out;
}

// d_s^i d_theta^j of x + w n.
J disturbed(const GradientModes::Derivatives& x, const GradientModes::Derivatives& n, int i, int j) {
    constexpr int binomial[4][4] = {{1, 0, 0, 0}, {1, 1, 0, 0}, {1, 2, 1, 0}, {1, 3, 3, 1}};
    J out = j == 0 ? constant(x[i]) : J(0.0);
    for (int k = 0; k <= i; ++k)
        out += (1.0 * binomial[i][k]) * (J::variable(Pack(0.0), variable_of[k][j]) * constant(n[i - k]));
    return out;
}

// |grad H|^2 dS per ds and dtheta, in the frame (e_r, e_theta, e_z) as in ModeStability.
J density(const GradientModes::Derivatives& r, const GradientModes::Derivatives& z,
          const GradientModes::Derivatives& nr, const GradientModes::Derivatives& nz) {
    const auto at = [&](const auto& x, const auto& n, int i, int j) {
        S out;
        out.v = disturbed(x, n, i, j);
        out.d = {disturbed(x, n, i + 1, j), disturbed(x, n, i, j + 1)};
        return out;
    };
    const S R = at(r, nr, 0, 0), s_r = at(r, nr, 1, 0), s_z = at(z, nz, 1, 0), t_r = at(r, nr, 0, 1),
            t_z = at(z, nz, 0, 1), ss_r = at(r, nr, 2, 0), ss_z = at(z, nz, 2, 0), st_r = at(r, nr, 1, 1),
            st_z = at(z, nz, 1, 1), tt_r = at(r, nr, 0, 2) - R, tt_z = at(z, nz, 0, 2);
    const S n_r = R * s_z, n_t = t_z * s_r - t_r * s_z, n_z = -(R * s_r);
    const S square = n_r * n_r + n_t * n_t + n_z * n_z, inverse_area = inverse_sqrt(square);
    const S E = t_r * t_r + R * R + t_z * t_z, F = t_r * s_r + t_z * s_z, G = s_r * s_r + s_z * s_z;
    const S L = tt_r * n_r + 2.0 * (t_r * n_t) + tt_z * n_z, M = st_r * n_r + s_r * n_t + st_z * n_z,
            N = ss_r * n_r + ss_z * n_z;
    const S H = (L * G - 2.0 * (M * F) + N * E) * (inverse_area * inverse_area * inverse_area);
    const J &H_s = H.d[0], &H_t = H.d[1];
    return inverse_area.v * (E.v * (H_s * H_s) - 2.0 * (F.v * (H_s * H_t)) + G.v * (H_t * H_t));
}

}  // namespace

void GradientModes::add_group(const Derivatives& r, const Derivatives& z, const Derivatives& n_r,
                              const Derivatives& n_z) {
    const J f = density(r, z, n_r, n_z);
    for (std::size_t q = 0; q < SplineSpace::lanes; ++q) {
        Point& p = points_.emplace_back();
        for (int k = 0; k < 4; ++k) p.first[k] = f.d[variable_of[k][0]][q];
        for (std::size_t k = 0; k < p.Q.size(); ++k) p.Q[k] = f.dd[k][q];
    }
}

Eigen::Matrix4d GradientModes::second_variation(std::size_t point, int m) const {
    const std::array<double, 4> factor{1, -1.0 * m, -1.0 * m * m, 1.0 * m * m * m};  // of d_theta^j
    Eigen::Matrix4d out = Eigen::Matrix4d::Zero();
    for (int a = 0; a < variables; ++a)
        for (int b = 0; b < variables; ++b) {
            const auto [i, j] = order_of[a];
            const auto [k, l] = order_of[b];
            if ((j + l) % 2 == 0) out(i, k) += factor[j] * factor[l] * points_[point].Q[packed<variables>(a, b)];
        }
    return out;
}

}  // namespace tubule::axisym
