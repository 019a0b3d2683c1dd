#include "surface3d/curvature/surface_modes.hpp"

#include <cmath>
#include <complex>
#include <stdexcept>

#include "common/geometry/profile_point.hpp"
#include "common/shapes/sphere.hpp"
#include "surface3d/fem/surface_space.hpp"
#include "surface3d/mesh/reference_triangle.hpp"

namespace tubule::surface3d {

namespace {

constexpr int mode_degree = 12;  // of the rule for the integrals

}  // namespace

double tube_mode_amplitude(const CurvedMesh& tube, int n, int m) {
    if (!(tube.period > 0)) throw std::invalid_argument("a closed surface has no waves along z");
    std::complex<double> with = 0, against = 0;
    for_each_point(tube, mode_degree, [&](int, const SurfacePoint<double>& p, double weight) {
        const auto& [X_xi, X_eta] = p.tangent;
        const Eigen::Vector3d& X = p.x;
        const double r2 = X[0] * X[0] + X[1] * X[1], theta = std::atan2(X[1], X[0]);
        const double theta_xi = (X[0] * X_xi[1] - X[1] * X_xi[0]) / r2,
                     theta_eta = (X[0] * X_eta[1] - X[1] * X_eta[0]) / r2;
        const double part = weight * std::sqrt(r2) * (theta_xi * X_eta[2] - theta_eta * X_xi[2]),
                     phase = 2 * pi * n * X[2] / tube.period;
        with += part * std::polar(1.0, -phase - m * theta);
        against += part * std::polar(1.0, -phase + m * theta);
    });
    const double scale = 1 / (pi * tube.period);
    if (n == 0 && m == 0) return scale / 2 * with.real();
    // A ring wave, and one without waves around, are their own counterparts.
    return scale * (n == 0 || m == 0 ? std::abs(with) : std::hypot(std::abs(with), std::abs(against)));
}

double sphere_mode_amplitude(const CurvedMesh& surface, int l, int m) {
    if (surface.period > 0) throw std::invalid_argument("a tube has no spherical harmonics");
    if (l == 1 || l < 0 || m < 0 || m > l)
        throw std::invalid_argument(
            "a wave of a closed surface must have l >= 2 and 0 <= m <= l; l = 1 is a translation");
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    double area = 0;
    for_each_point(surface, mode_degree, [&](int, const SurfacePoint<double>& p, double weight) {
        area += weight * p.area, middle += weight * p.area * p.x;
    });
    middle /= area;
    double mean = 0, re = 0, im = 0;
    for_each_point(surface, mode_degree, [&](int, const SurfacePoint<double>& p, double weight) {
        const Eigen::Vector3d x = p.x - middle;
        const double rho = x.norm(), part = weight * p.area * x.dot(p.normal) / (rho * rho);
        const Eigen::Vector3d at = x / rho;
        mean += part / (4 * pi);
        re += part * real_harmonic(l, m, Vector3<double>(at));
        if (m == 0) return;
        const double c = std::cos(pi / (2 * m)), s = std::sin(pi / (2 * m));  // turned back by a quarter wave: Im Y
        im += part * real_harmonic(l, m, Vector3<double>(c * at[0] + s * at[1], c * at[1] - s * at[0], at[2]));
    });
    if (l == 0) return mean;
    // INT (Re Y)^2 is 1 for m = 0, else 1/2.
    return std::hypot(re, im) * (m == 0 ? 1 : 2) / mean;
}

}  // namespace tubule::surface3d
