#include "axisym/equilibrium/profile_modes.hpp"

#include <cmath>
#include <complex>
#include <stdexcept>

#include "common/geometry/profile_point.hpp"
#include "common/shapes/sphere.hpp"

namespace tubule::axisym {
namespace {

// INT f(t) dt over [0, 1] by Gauss points on many equal parts, so that it does not matter where a spline has its knots.
template <class F>
auto integral(const F& f) {
    constexpr int parts = 1024;
    static const GaussRule rule = gauss_rule(4);
    decltype(f(0.0)) sum = 0;
    for (int i = 0; i < parts; ++i)
        for (std::size_t k = 0; k < rule.nodes.size(); ++k)
            sum += rule.weights[k] / parts * f((i + rule.nodes[k]) / parts);
    return sum;
}

void require_whole(const Curve& profile) {
    const bool tube = profile.topology == Topology::tube && profile.length > 0;
    if (!tube && profile.topology != Topology::cell)
        throw std::invalid_argument("wave amplitudes are defined on whole tubes and closed cells only");
}

// (1/L) INT r exp(-i q z) dz over a period.
std::complex<double> tube_mode(const Curve& profile, int n) {
    return integral([&](double t) {
        const auto [r, r1, z, z1] = profile.at(t);
        return r * z1 / profile.length * std::polar(1.0, -2 * pi * n * z / profile.length);
    });
}

// Height of the middle of the volume.
double middle(const Curve& cell) {
    const auto moment = [&](int power) {
        return integral([&](double t) {
            const auto [r, r1, z, z1] = cell.at(t);
            return r * r * z1 * (power > 0 ? z : 1.0);
        });
    };
    return moment(1) / moment(0);
}

// INT rho Y_l^0 over all directions.
double cell_mode(const Curve& cell, int l) {
    const double z0 = middle(cell);
    return integral([&](double t) {
        const auto [r, r1, z_axis, z1] = cell.at(t);
        const double z = z_axis - z0, rho = std::hypot(r, z);
        const double solid_angle = 2 * pi * r * (r * z1 - z * r1) / (rho * rho * rho);
        return rho * real_harmonic(l, 0, Vector3<double>(r / rho, 0, z / rho)) * solid_angle;
    });
}

}  // namespace

double mean_radius(const Curve& profile) {
    require_whole(profile);
    return profile.topology == Topology::tube ? tube_mode(profile, 0).real()
                                              : cell_mode(profile, 0) / std::sqrt(4 * pi);
}

double mode_amplitude(const Curve& profile, int n) {
    require_whole(profile);
    if (profile.topology == Topology::tube) {
        if (n < 1) throw std::invalid_argument("a wave along a tube must have n >= 1");
        return 2 * std::abs(tube_mode(profile, n));
    }
    if (n < 2)
        throw std::invalid_argument(
            "a wave of a cell must have l >= 2: l = 1 is a translation, l = 0 a change of size");
    return std::abs(cell_mode(profile, n)) / mean_radius(profile);
}

}  // namespace tubule::axisym
