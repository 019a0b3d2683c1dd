// Energy, area and volume of a closed profile given by points, and the force on it.
#include <cmath>
#include <cstdio>
#include <memory>
#include <vector>

#include "axisym/curve/curve_forms.hpp"
#include "axisym/graph/graph_mesh.hpp"
#include "axisym/splines/arc_length.hpp"
#include "axisym/splines/breaks.hpp"
#include "common/shapes/perturbed_curve.hpp"

using namespace tubule;
using namespace tubule::axisym;

int main() {
    // A spheroid, from its south pole to its north pole.
    const double a = 1.2, c = 0.6;
    std::vector<double> r, z;
    for (int i = 0; i <= 60; ++i) {
        const double angle = pi * i / 60;
        r.push_back(i % 60 == 0 ? 0 : a * std::sin(angle)), z.push_back(-c * std::cos(angle));
    }
    const Curve profile = meridian(curve_through(r, z, 0));

    // f(H, K) = k20 (H - H0)^2 + k40 (H - H0)^4 + k42 K^2, with H = -2/R on a sphere.
    const Bending bending{.k = {0.5, 0, 0.05}, .H0 = -1};

    // A quintic spline of 40 elements along the profile; x holds its coefficients.
    const CurveSpace space(Topology::cell, equal_breaks(40), 5, 4, 0);
    const Eigen::VectorXd x = fit(space, profile);
    const CurveForms forms(space, bending);
    const CurveObservation o = forms.observe(x);
    std::printf("area   %.8f\nvolume %.8f\nenergy %.8f\n", o.area, o.volume, o.energy);
    std::printf("    of which k42 K^2: %.8f\n", o.energy_term[term_number("k42")]);

    // The derivative of the energy in the coefficients: along x itself it is that of a change of size.
    const double scaling = forms.gradient({.energy = 1}, x).dot(x);
    const double h = 1e-6,
                 difference =
                     (forms.value({.energy = 1}, (1 + h) * x) - forms.value({.energy = 1}, (1 - h) * x)) / (2 * h);
    std::printf("dE/d log(size) %.6f, by differences %.6f\n", scaling, difference);
}
