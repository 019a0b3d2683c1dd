// Surfaces of revolution with modes and velocities on them, against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "common/shapes/perturbed_curve.hpp"

namespace tubule::waved_profile_test {

std::vector<double> tabulated(int last, double (*f)(double s)) {
    std::vector<double> out;
    for (int i = 0; i <= last; ++i) out.push_back(f(static_cast<double>(i) / last));
    return out;
}

PerturbedCurve sphere() {
    auto r = tabulated(60, [](double s) { return std::sin(pi * s); });
    r.front() = r.back() = 0;
    return curve_through(r, tabulated(60, [](double s) { return -std::cos(pi * s); }), 0);
}
PerturbedCurve tube() {
    const auto r = tabulated(60, [](double) { return 1.5; }), z = tabulated(60, [](double s) { return 3 * s; });
    return curve_through(r, z, 3);
}
// Centre radius 2, tube radius 1, from the outside up.
PerturbedCurve ring() {
    auto r = tabulated(80, [](double s) { return 2 + std::cos(2 * pi * s); });
    auto z = tabulated(80, [](double s) { return std::sin(2 * pi * s); });
    r.back() = r.front(), z.back() = z.front();
    return curve_through(r, z, 0);
}

Eigen::Vector3d direction(double angle, double phi) {
    return {std::sin(angle) * std::cos(phi), std::sin(angle) * std::sin(phi), -std::cos(angle)};
}

// Points of a base surface, poles and their neighbourhood included.
template <class Visit>
void for_each_direction(const Visit& visit) {
    for (const double angle : {0.0, 1e-3, 0.4, 1.3, pi / 2, 2.5, pi})
        for (const double phi : {0.0, 0.7, 2.0, 4.1}) visit(angle, phi);
}

TEST(PerturbedCurve, modesOfACellAreNormalDisplacements) {
    // On the unit sphere: (1 + a std::sin(angle)^m std::cos(m phi)) n, exactly.
    for (const int m : {1, 2, 5}) {
        PerturbedCurve surface = sphere();
        std::vector<double> w;
        for (int i = 0; i <= 200; ++i) w.push_back(0.1 * std::pow(std::sin(pi * i / 200), m));
        surface.modes = {normal_mode(surface, m, w)};
        for_each_direction([&](double angle, double phi) {
            const Eigen::Vector3d n = direction(angle, phi), x = position(surface, Torus{}, n);
            const double expected = 0.1 * std::pow(std::sin(angle), m) * std::cos(m * phi);
            EXPECT_LT((x - (1 + expected) * n).norm(), 1e-7) << m << ' ' << angle << ' ' << phi;
        });
    }
}

TEST(PerturbedCurve, aCellStaysSmoothAtItsPoles) {
    // The wave std::sin(angle) std::cos(phi) moves the sphere by a along x, to first order: the normal at the pole
    // stays, and H is -2 + O(a^2).
    PerturbedCurve surface = sphere();
    surface.modes = {normal_mode(surface, 1, tabulated(200, [](double s) { return 1e-3 * std::sin(pi * s); }))};
    for (const double angle : {0.0, 1e-4, 0.01, 0.5}) {
        const Eigen::Vector3d n = direction(angle, 0.3), e1 = Eigen::Vector3d(0.2, 1, 0.1).cross(n).normalized();
        const auto p =
            point_of_map<double>([&](const auto& q) { return position(surface, Torus{}, q); }, n, e1, n.cross(e1));
        EXPECT_NEAR(p.H, -2, 2e-5) << angle;
    }
}

TEST(PerturbedCurve, modesOfATubeAndARing) {
    PerturbedCurve straight = tube();
    straight.modes = {
        normal_mode(straight, 3, tabulated(200, [](double s) { return 0.1 * std::cos(4 * pi * s + 0.3); })),
        normal_mode(straight, 1, std::vector<double>(201, 0.02))};
    for (const double phi : {0.0, 1.0, 4.0})
        for (const double z : {-0.4, 0.0, 0.7, 2.9}) {
            const double r = 1.5 + 0.1 * std::cos(4 * pi * z / 3 + 0.3) * std::cos(3 * phi) + 0.02 * std::cos(phi);
            const Eigen::Vector3d x =
                position(straight, Torus{}, Eigen::Vector3d(2 * std::cos(phi), 2 * std::sin(phi), z));
            EXPECT_LT((x - Eigen::Vector3d(r * std::cos(phi), r * std::sin(phi), z)).norm(), 1e-9);
        }
    // A ring thickened by 0.1 std::cos(2 phi): the torus with another tube radius there.
    PerturbedCurve thick = ring();
    thick.modes = {normal_mode(thick, 2, std::vector<double>(201, 0.1))};
    const Torus base{thick.mean_radius, 1};
    for (const double phi : {0.0, 1.0, 4.0})
        for (const double angle : {0.1, 2.0, 5.0}) {
            const double rho = base.radius + std::cos(angle), a = 1 + 0.1 * std::cos(2 * phi),
                         r = 2 + a * std::cos(angle);
            const Eigen::Vector3d p(rho * std::cos(phi), rho * std::sin(phi), std::sin(angle)),
                x = position(thick, base, p);
            EXPECT_LT((x - Eigen::Vector3d(r * std::cos(phi), r * std::sin(phi), a * std::sin(angle))).norm(), 1e-6);
        }
}

TEST(PerturbedCurve, velocities) {
    // A rigid motion of the sphere along and about the axis: u = V e_z + omega x position; at the points of its profile
    // u_n = -V std::cos(angle), u_t = V std::sin(angle) in the direction of the profile, which comes from the south.
    PerturbedCurve surface = sphere();
    VelocityAtPoints u;
    for (int i = 0; i <= 60; ++i) {
        const double angle = pi * i / 60;
        u.normal.push_back(-0.7 * std::cos(angle)), u.along.push_back(0.7 * std::sin(angle));
        u.around.push_back(0.4 * std::sin(angle));
    }
    u.around.front() = u.around.back() = 0;
    surface.velocity = curve_velocity(surface, u);
    for_each_direction([&](double angle, double phi) {
        const Eigen::Vector3d n = direction(angle, phi);
        EXPECT_LT((velocity(surface, Torus{}, n) - Eigen::Vector3d(-0.4 * n[1], 0.4 * n[0], 0.7)).norm(), 1e-8);
    });
    // The tube grows in radius and slides.
    PerturbedCurve straight = tube();
    straight.velocity = curve_velocity(
        straight, {std::vector<double>(61, 0.2), std::vector<double>(61, 0.3), std::vector<double>(61, 0.5)});
    const Eigen::Vector3d found = velocity(straight, Torus{}, Eigen::Vector3d(0, 1.5, 4));
    EXPECT_LT((found - Eigen::Vector3d(-0.5, 0.2, 0.3)).norm(), 1e-9);
}

TEST(PerturbedCurve, refusesWhatIsNoMode) {
    const PerturbedCurve surface = tube();
    EXPECT_THROW(normal_mode(surface, 0, std::vector<double>(201, 1.0)), std::invalid_argument);
    EXPECT_THROW(normal_mode(surface, 1, std::vector<double>(9, 1.0)), std::invalid_argument);
    std::vector<double> rough;
    for (int i = 0; i <= 200; ++i) rough.push_back(i % 2 ? 1 : -1);
    EXPECT_THROW(normal_mode(surface, 1, rough), std::invalid_argument);
    EXPECT_THROW(functions_along(surface, {1.0}, {1.0}), std::invalid_argument);
}

}  // namespace tubule::waved_profile_test
