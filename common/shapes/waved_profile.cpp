#include "common/shapes/waved_profile.hpp"

#include <fmt/format.h>

#include <Eigen/QR>
#include <cmath>
#include <stdexcept>

namespace tubule {

namespace {

constexpr int terms = ProfileWave::terms;

bool is_cell(const ProfileCurve& curve) {
    return curve.kind == ProfileCurve::Kind::cell;
}

// Unit tangent (r, z) at s.
std::array<double, 2> tangent(const ProfileCurve& curve, double s) {
    const auto [r, z] = profile_at(curve, Jet<double, 1, 1>::variable(s, 0));
    const double speed = std::hypot(r.d[0], z.d[0]);
    return {r.d[0] / speed, z.d[0] / speed};
}

// The sum over terms, times weights, that is nearest to the values at s.
std::array<double, terms> fitted(const ProfileCurve& curve, const std::vector<double>& s,
                                 const std::vector<double>& values, int power_of_sine) {
    const auto n = static_cast<Eigen::Index>(s.size());
    Eigen::MatrixXd functions(n, terms);
    Eigen::VectorXd right(n);
    for (Eigen::Index i = 0; i < n; ++i) {
        const double weight = is_cell(curve) ? std::pow(std::sin(pi * s[i]), power_of_sine) : 1;
        const auto f = wave_functions(curve.kind, is_cell(curve) ? -std::cos(pi * s[i]) : s[i]);
        for (int k = 0; k < terms; ++k) functions(i, k) = weight * f[k];
        right[i] = values[i];
    }
    const Eigen::VectorXd coefficients =
        Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>(functions).solve(right);
    std::array<double, terms> out;
    for (int k = 0; k < terms; ++k) out[k] = coefficients[k];
    return out;
}

}  // namespace

ProfileWave normal_wave(const ProfileCurve& curve, int m, const std::vector<double>& w) {
    if (m < 1 || w.size() < terms) throw std::invalid_argument("a mode needs m >= 1 and enough values");
    std::vector<double> s, radial, axial;
    for (std::size_t i = 0; i < w.size(); ++i) {
        s.push_back(static_cast<double>(i) / static_cast<double>(w.size() - 1));
        const bool pole = is_cell(curve) && (i == 0 || i + 1 == w.size());  // there all functions vanish
        const auto [t_r, t_z] = pole ? std::array{0.0, 0.0} : tangent(curve, s.back());
        radial.push_back(w[i] * t_z), axial.push_back(-w[i] * t_r);
    }
    return {m, fitted(curve, s, radial, m + 1), fitted(curve, s, axial, m)};
}

namespace {

// The surface as it is disturbed must keep off the axis but at poles.
void require_radius(const WavedProfile& surface) {
    constexpr int along = 400, around = 32;
    const bool cell = is_cell(surface.curve);
    for (int i = cell ? 1 : 0; i < along; ++i)
        for (int j = 0; j < around; ++j) {
            const double s = double(i) / along, phi = 2 * pi * j / around;
            const Eigen::Vector3d x = position(surface, Torus{2, 1}, base_point(surface.curve, s, phi));
            if (!(x[0] * std::cos(phi) + x[1] * std::sin(phi) > 0))
                throw std::invalid_argument(fmt::format("moves the surface across its axis at z = {:.4g}", x[2]));
        }
}

}  // namespace

Vector3<double> base_point(const ProfileCurve& curve, double s, double phi) {
    const double x = std::cos(phi), y = std::sin(phi), angle = 2 * pi * s;
    if (is_cell(curve)) return {x * std::sin(pi * s), y * std::sin(pi * s), -std::cos(pi * s)};
    if (curve.kind == ProfileCurve::Kind::tube) return {x, y, curve.length * s};
    return {x * (2 + std::cos(angle)), y * (2 + std::cos(angle)), std::sin(angle)};
}

WavedProfile disturbed(WavedProfile surface, const ResultFrame& frame) {
    const ProfileCurve& curve = surface.curve;
    const double radius = is_cell(curve) ? std::sqrt(curve.mean_radius * curve.arc_length / 2) : curve.mean_radius;
    const bool tube = curve.kind == ProfileCurve::Kind::tube;
    const std::vector<double>& x = curve.functions.x;
    const VelocityAtPoints outward{std::vector<double>(x.size(), 1), std::vector<double>(x.size(), 0), {}};
    surface.modes = NormalModes{disturbed_shape(frame, is_cell(curve), radius, tube ? curve.length : 1),
                                profile_velocity(curve, outward).meridional};
    require_radius(surface);
    return surface;
}

ProfileVelocity profile_velocity(const ProfileCurve& curve, const VelocityAtPoints& points) {
    const std::vector<double>& x = curve.functions.x;
    std::vector<double> radial, axial, around = points.around;
    for (std::size_t i = 0; i < x.size(); ++i) {
        // At a pole the profile is perpendicular to the axis.
        const bool south = is_cell(curve) && i == 0, north = is_cell(curve) && i + 1 == x.size();
        const double s = is_cell(curve) ? std::acos(-std::clamp(x[i], -1.0, 1.0)) / pi : x[i];
        const auto [t_r, t_z] = south ? std::array{1.0, 0.0} : north ? std::array{-1.0, 0.0} : tangent(curve, s);
        radial.push_back(points.normal[i] * t_z + points.along[i] * t_r);
        axial.push_back(-points.normal[i] * t_r + points.along[i] * t_z);
    }
    around.resize(x.size(), 0);
    return {along_curve(curve, radial, axial), along_curve(curve, around, std::vector<double>(x.size(), 0))};
}

Vector3<double> velocity(const WavedProfile& surface, const Torus& base, const Vector3<double>& p) {
    const auto at = place_of(surface.curve, base, p);
    const auto [radial, axial] = value_at(surface.velocity->meridional, at.along);
    const double swirl = value_at(surface.velocity->around, at.along)[0];
    return {radial * at.x - swirl * at.y, radial * at.y + swirl * at.x, axial};
}

}  // namespace tubule
