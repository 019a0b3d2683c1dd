// A sphere that inflates, with a vortex or a shear flow on it: what force and membrane it takes, and its exact values.
// With R(t), a = R'/R and c(t) the velocity is u = a x + c q(x); q is divergence-free along spheres about the origin,
// and q/R^2 an eigenfunction of 2 div D, of the eigenvalue -decay/R^2: theory.md (6.6).
#pragma once

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <string>

#include "common/geometry/profile_point.hpp"

namespace tubule {

struct InflatingSphere {
    enum class Flow { shear, octahedral };  // q = z e_z x x, the degree 2; (x (y^2 - z^2), ...), the degree 3
    Flow flow = Flow::shear;
    bool inertia = true, flows = true;  // flows: viscosity 1
    double gamma = 0.5, k20 = 0.3, H0 = -1, p0 = -1, p1 = 0.4;

    // R = 1.2 - 0.2 cos(2 t), c = sin(t): at rest at t = 0.
    static double R(double t) { return 1.2 - 0.2 * std::cos(2 * t); }
    static double rate(double t) { return 0.4 * std::sin(2 * t) / R(t); }

    // INT |q|^2 dS over the sphere.
    double square(double R) const {
        return flow == Flow::shear ? 8 * pi / 15 * std::pow(R, 6) : 48 * pi / 105 * std::pow(R, 8);
    }
    double decay() const { return flow == Flow::shear ? 4 : 10; }
    double energy(double t) const { return 4 * pi * k20 * std::pow(2 + H0 * R(t), 2); }
    double kinetic(double t) const {
        const double c = std::sin(t), a = rate(t);
        return inertia ? (4 * pi * std::pow(R(t), 4) * a * a + c * c * square(R(t))) / 2 : 0;
    }
    double dissipation(double t) const {
        const double c = std::sin(t), a = rate(t), r = R(t), viscosity = flows ? 1 : 0;
        return viscosity * (16 * pi * r * r * a * a + decay() / (r * r) * c * c * square(r)) +
               gamma * (4 * pi * std::pow(r, 4) * a * a + c * c * square(r));
    }

    // The keys of [model] but its kind, for components along x, y, z or r, theta, z.
    std::string model(bool in_space) const {
        const std::string R2 = "(1.2-0.2*cos(2*t))^2", a = "(0.4*sin(2*t)/(1.2-0.2*cos(2*t)))", c = "sin(t)",
                          a_t = "((0.8*cos(2*t)-0.4*sin(2*t)*" + a + ")/(1.2-0.2*cos(2*t)))";
        const double rho = inertia, mu = flows;
        // Factors of x: inertia, viscosity, friction; and -b/R, theory.md (3.23).
        const std::string normal = fmt::format("({0}*({1}+{2}^2)+{3}*{2}/{4}+{5}*{2})", rho, a_t, a, 4 * mu, R2, gamma);
        const std::string bending = fmt::format("({})*(2/(1.2-0.2*cos(2*t))+({}))/{}", 2 * k20 * H0, H0, R2);
        const int degree = flow == Flow::shear ? 2 : 3;
        const std::string along = fmt::format("({0}*(cos(t)+{1}*{2}*sin(t))+({3}/{4}+{5})*sin(t))", rho, degree + 1, a,
                                              mu * decay(), R2, gamma);
        const std::string p = flow == Flow::shear ? "z^2" : "x*y";
        // What p = p0 + p1 (z^2 or x y) exerts: grad p + p H nu, along x and beside it.
        const std::string pressing = fmt::format("(({}*2*({}))+2*({}+{}*({})))/{}", p1, p, p0, p1, p, R2);
        const std::string on_x = fmt::format("({}+{}-{})", normal, bending, pressing);
        std::array<std::string, 3> force;
        if (!in_space) {
            force = {fmt::format("r*({}-{}*{}^2*z^2)", on_x, rho, c), fmt::format("{}*z*r", along),
                     fmt::format("z*({}+{})", on_x, 2 * p1)};
            return text({"force_r", inertia ? "force_theta" : "", "force_z"}, force, a);
        }
        if (flow == Flow::shear)
            force = {fmt::format("x*({}-{}*{}^2*z^2)-{}*y*z", on_x, rho, c, along),
                     fmt::format("y*({}-{}*{}^2*z^2)+{}*x*z", on_x, rho, c, along),
                     fmt::format("z*({}+{})", on_x, 2 * p1)};
        else
            for (int i = 0; i < 3; ++i) {
                const char x = "xyz"[i], y = "yzx"[i], z = "zxy"[i];
                force[i] = fmt::format("{0}*({1}+{2}*{3}^2*({4}^2+{5}^2)*({4}^2+{5}^2-2*{0}^2)+{6}*({4}^2-{5}^2))", x,
                                       on_x, rho, c, y, z, along);
                if (i < 2) force[i] += fmt::format("+{}*{}", p1, "yx"[i]);
            }
        return text({"force_x", "force_y", "force_z"}, force, a);
    }

private:
    static std::string text(const std::array<std::string, 3>& keys, const std::array<std::string, 3>& force,
                            const std::string& a) {
        std::string out = "volume = \"free\"\nsource.mass = \"2*" + a + "\"\n";
        for (int i = 0; i < 3; ++i)
            if (!keys[i].empty()) out += fmt::format("source.{} = \"{}\"\n", keys[i], force[i]);
        return out;
    }
};

}  // namespace tubule
