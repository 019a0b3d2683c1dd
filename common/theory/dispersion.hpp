// Small waves on straight tubes and on spheres: exact linear theory for any density f(H, K), theory.md 5, theory.md 6.
//
// A tube is r = R + a cos(q z + m theta), a sphere |X| = R + a Y_l^m, with a(t) = a(0) exp(omega t). Density, its
// derivatives and the radius are those of the unperturbed surface.
#pragma once

#include <complex>
#include <limits>
#include <optional>
#include <vector>

#include "common/energy/bending.hpp"
#include "common/model/model.hpp"

namespace tubule::theory {

// A straight tube, and a sphere. The tension is sigma0 of theory.md (5.8). A gradient flow with a tension is that of
// E + sigma0 A. With area-difference elasticity the energy of a tube is on_tube(), since the whole of it counts.
struct UniformTube {
    Bending energy;
    double radius = 1, tension = 0;
};
struct UniformSphere {
    Bending energy;
    double radius = 1, tension = 0;
};

// An energy as it acts on straight tubes of this length, whatever their radius: M = -2 pi length.
Bending on_tube(const Bending& energy, double length);

// dR/dt of the gradient flow without tension.
double radius_rate(const UniformTube& tube);
double radius_rate(const UniformSphere& sphere);

// The equilibrium tension of a tube under a pressure: that of laws that keep the area and leave the volume free.
double tension_of_free_volume(const Bending& energy, double radius, double pressure = 0);
// The equilibrium pressure of the tube and the sphere: theory.md (3.21), (3.23).
double pressure_at_rest(const UniformTube& tube);
double pressure_at_rest(const UniformSphere& sphere);
// The axial force on the tube under a pressure: theory.md (3.21).
double axial_force(const UniformTube& tube, double pressure);

// The tension that a straight tube has in the ensemble of a law, with the loads of t = 0: given, or that of its
// balance, theory.md 5. Empty where area, volume and period are fixed: there its waves determine it.
std::optional<double> tension_of(const MotionLaw& law, const Bending& energy, double radius);
// dR/dt of a straight tube at t = 0 by its law: 0 where a constraint fixes R. A reservoir with free volume: without
// inertia; infinite where nothing resists.
double radius_rate_of(const MotionLaw& law, const UniformTube& tube);
// The radius that it approaches, with the tension of the tube and the pressure of t = 0: the nearest stable one in the
// direction of the rate. Empty where there is none from 1e-3 to 1e3 times the radius.
std::optional<double> radius_at_rest(const MotionLaw& law, const UniformTube& tube);

// Sigma of theory.md (5.20): (f + f_H/R + sigma0) R^2/f_HH. Not finite where f_HH = 0.
double reduced_tension(const UniformTube& tube);

// G of theory.md (5.8), with the gradient term (5.28), as a polynomial of q: the gradient flow's -omega, and what
// drives the other models. A wave grows where G < 0.
struct Stiffness {
    double q6 = 0, q4 = 0, q2 = 0, q0 = 0;
    double operator()(double q) const { return ((q6 * q * q + q4) * q * q + q2) * q * q + q0; }
    bool rises() const { return q6 > 0 || (q6 == 0 && q4 > 0); }  // with q, in the end
};
Stiffness stiffness(const UniformTube& tube, int m);
double stiffness(const UniformSphere& sphere, int l);

// All rates of one wave, the fastest (largest real part) first: one; with inertia two or three. Infinite where a
// viscous flow without inertia and friction meets no resistance (q = 0, m >= 2). Zero where only rounding is left.
struct Growth {
    std::vector<std::complex<double>> roots;
    double rate() const { return roots.front().real(); }
    double frequency() const { return std::abs(roots.front().imag()); }
};
Growth growth(const UniformTube& tube, const MotionLaw& law, double q, int m);
Growth growth(const UniformSphere& sphere, const MotionLaw& law, int l);
// The rate of tangential swirls on a sphere, which do not change its shape, for a law with inertia.
double toroidal_rate(const UniformSphere& sphere, const MotionLaw& law, int l);

// M of theory.md (5.16), (5.18): laws without inertia move as a' = -M G a. With inertia, of a''.
double mobility(const UniformTube& tube, const MotionLaw& law, double q, int m);

// Where the principal symbol f_HH + 2 f_HK x + f_KK x^2 is not positive and kg = 0, waves grow the faster the shorter
// they are: waves along the axis (x = -1/R), or around it (x = 0).
bool ill_posed_along(const UniformTube& tube);
bool ill_posed_around(const UniformTube& tube);

// Wave numbers of one m that grow, q >= 0: none, one band, or two if ill-posed or with kg > 0. The same for all models.
struct Band {
    double from = 0, to = std::numeric_limits<double>::infinity();
};
std::vector<Band> growing_bands(const UniformTube& tube, int m);

// The fastest growing wave of this m, over all q >= 0. Empty if none grows, or if there is no fastest one (ill-posed,
// or infinite rates).
struct FastestWave {
    double q = 0, rate = 0;
};
std::optional<FastestWave> fastest_wave(const UniformTube& tube, const MotionLaw& law, int m);

// The fastest growing wave with m = 0 ... last of those that fit a length, q = 2 pi n/length, rigid motions and the
// change of radius left out. Empty if none grows, or as above.
struct FittingWave {
    int n = 0, m = 0;
    double q = 0, rate = 0;
};
std::optional<FittingWave> fastest_fitting_wave(const UniformTube& tube, const MotionLaw& law, double length, int last);

// Where waves of one m begin to grow as the tension changes: from `lowest` to `highest` none does. `q_...` is the wave
// number that is neutral there, 0 for long waves. Empty if some wave grows at every tension.
struct StableTensions {
    double lowest = -std::numeric_limits<double>::infinity(), highest = std::numeric_limits<double>::infinity();
    double q_lowest = 0, q_highest = 0;
};
std::optional<StableTensions> stable_tensions(const UniformTube& tube, int m);
// The tensions that are stable for all of m = 0 ... last.
std::optional<StableTensions> common_stable_tensions(const UniformTube& tube, int last);

// The f_KK (2 k42) above which no wave of m = 0 grows, all else fixed. Empty if long waves grow for every f_KK.
std::optional<double> least_f_KK(const UniformTube& tube);

}  // namespace tubule::theory
