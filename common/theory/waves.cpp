#include "common/theory/waves.hpp"

#include <fmt/format.h>
#include <gsl/gsl_errno.h>
#include <gsl/gsl_odeiv2.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <map>
#include <memory>
#include <set>
#include <stdexcept>
#include <utility>
#include <variant>

#include "common/geometry/profile_point.hpp"
#include "common/solve/pause.hpp"
#include "common/solve/sparse.hpp"

namespace tubule::theory {

namespace {

// One wave's coefficients in theory.md (5.16), (5.18): Z, G without tension, the mobility M; with inertia
//   a'' = -(gamma + drag) a' + swirl y - M (G0 - p0 Z) a,     y' = a' - (gamma + decay) y.
struct Coefficients {
    double Z, G0, M, drag, swirl, decay;
};

struct Motion {
    MotionLaw law;
    UniformTube tube;
    double length;
    std::vector<Wave> waves;
    std::vector<Coefficients> of;  // unless the radius drifts
    bool drifts, tension_is_outcome;
    SharedPause* pause = nullptr;  // of the integration that is under way

    bool swings() const { return law.inertia != 0; }
    std::size_t per_wave() const { return swings() ? 3 : 1; }
    double q(const Wave& wave) const { return 2 * pi * wave.n / length; }
};

Coefficients coefficients(const Motion& motion, const Wave& wave) {
    UniformTube slack = motion.tube;
    slack.tension = 0;
    const double R = slack.radius, q = motion.q(wave), Q = q * q + wave.m * wave.m / (R * R), A = Q * R * R + 1,
                 mu = motion.law.viscosity;
    const int m = std::abs(wave.m);
    return {Q - 1 / (R * R),
            stiffness(slack, m)(q),
            mobility(slack, motion.law, q, m),
            4 * mu * q * q / A,
            4 * mu * mu * q * q * m * m / (R * R) / A,
            mu * Q};
}

Motion prepared(const UniformTube& tube, const MotionLaw& law, double length, const std::vector<Wave>& waves) {
    const std::optional<double> tension = tension_of(law, tube.energy, tube.radius);
    Motion motion{law, tube, length, waves, {}, law.unconstrained(), !tension};
    if (!law.area_is_free()) motion.tube.tension = tension.value_or(0);
    std::set<std::pair<int, int>> seen;
    double moves = 0;
    for (const Wave& wave : waves) {
        check_pause();
        if (wave.n < 0 || (wave.n == 0 && wave.m == 0))
            throw std::invalid_argument(fmt::format("there is no wave with n = {}, m = {}", wave.n, wave.m));
        if (!seen.insert({wave.n, wave.m}).second)
            throw std::invalid_argument(fmt::format("the wave n = {}, m = {} occurs twice", wave.n, wave.m));
        motion.of.push_back(coefficients(motion, wave));
        const Coefficients& k = motion.of.back();
        if (!std::isfinite(k.M) && k.G0 != 0)
            throw std::invalid_argument(fmt::format(
                "the growth rate of the wave n = 0, m = {} is infinite in Stokes flow without friction", wave.m));
        if (!std::isfinite(k.M)) motion.of.back().M = 0;
        moves += k.Z * k.Z * motion.of.back().M * wave.amplitude * wave.amplitude;
    }
    if (motion.tension_is_outcome && !(moves > 0))
        throw std::invalid_argument("the tension that keeps area and volume is undetermined: no wave has an amplitude");
    return motion;
}

// -p0 of theory.md (5.17), (5.19).
double tension(const Motion& motion, const double* y) {
    if (!motion.tension_is_outcome) return motion.tube.tension;
    double above = 0, below = 0;
    for (std::size_t k = 0; k < motion.of.size(); ++k) {
        const auto& [Z, G0, M, drag, swirl, decay] = motion.of[k];
        const double* at = y + k * motion.per_wave();
        const double a = at[0];
        above += Z * M * G0 * a * a;
        if (motion.swings()) above += Z * (a * ((motion.law.friction + drag) * at[1] - swirl * at[2]) - at[1] * at[1]);
        below += Z * Z * M * a * a;
    }
    return -above / below;
}

// The unknowns: the radius and log of each amplitude over the initial one; or amplitudes; or of each wave (a, a', y).
int slope(double, const double* y, double* dy, void* parameters) {
    Motion& motion = *static_cast<Motion*>(parameters);
    if (motion.pause && motion.pause->look()) return GSL_EBADFUNC;
    if (motion.drifts) {
        UniformTube tube = motion.tube;
        tube.radius = y[0];
        if (!(tube.radius > 0)) return GSL_EBADFUNC;
        dy[0] = radius_rate_of(motion.law, tube);
        Stiffness G;  // of all waves of one m, which follow each other where there are many
        for (std::size_t k = 0; k < motion.waves.size(); ++k) {
            const int m = std::abs(motion.waves[k].m);
            if (k == 0 || m != std::abs(motion.waves[k - 1].m)) G = stiffness(tube, m);
            dy[k + 1] = -G(motion.q(motion.waves[k]));
        }
        return GSL_SUCCESS;
    }
    const double p0 = -tension(motion, y);
    for (std::size_t k = 0; k < motion.of.size(); ++k) {
        const auto& [Z, G0, M, drag, swirl, decay] = motion.of[k];
        const std::size_t at = k * motion.per_wave();
        const double force = -M * (G0 - p0 * Z) * y[at];
        if (!motion.swings()) {
            dy[at] = force;
            continue;
        }
        const double gamma = motion.law.friction;
        dy[at] = y[at + 1];
        dy[at + 1] = force - (gamma + drag) * y[at + 1] + swirl * y[at + 2];
        dy[at + 2] = y[at + 1] - (gamma + decay) * y[at + 2];
    }
    return GSL_SUCCESS;
}

std::vector<double> start(const Motion& motion) {
    std::vector<double> y;
    if (motion.drifts) {
        y.assign(motion.waves.size() + 1, 0);
        y[0] = motion.tube.radius;
        return y;
    }
    for (const Wave& wave : motion.waves) {
        y.push_back(wave.amplitude);
        if (motion.swings()) y.insert(y.end(), {wave.rate, 0});
    }
    return y;
}

WaveState state(const Motion& motion, double time, const std::vector<double>& y) {
    std::vector<double> dy(y.size());
    slope(time, y.data(), dy.data(), const_cast<Motion*>(&motion));
    WaveState out{time, motion.drifts ? y[0] : motion.tube.radius, tension(motion, y.data()), {}, {}};
    for (std::size_t k = 0; k < motion.waves.size(); ++k) {
        const std::size_t at = motion.drifts ? k + 1 : k * motion.per_wave();
        const double a = motion.drifts ? motion.waves[k].amplitude * std::exp(y[at]) : y[at];
        out.amplitudes.push_back(a);
        out.rates.push_back(motion.drifts ? a * dy[at] : dy[at]);
    }
    return out;
}

struct FreeDriver {
    void operator()(gsl_odeiv2_driver* driver) const { gsl_odeiv2_driver_free(driver); }
};

}  // namespace

double tension_of_waves(const UniformTube& tube, const MotionLaw& law, double length, const std::vector<Wave>& waves) {
    const Motion motion = prepared(tube, law, length, waves);
    return tension(motion, start(motion).data());
}

std::vector<WaveState> waves_in_time(const UniformTube& tube, const MotionLaw& law, double length,
                                     const std::vector<Wave>& waves, const std::vector<double>& times) {
    Motion motion = prepared(tube, law, length, waves);
    std::vector<double> y = start(motion);
    SharedPause pause;
    motion.pause = &pause;
    double scale = motion.drifts ? 1 : 0;
    for (const double value : y) scale = std::max(scale, std::abs(value));
    if (scale == 0) scale = 1;

    gsl_odeiv2_system system{slope, nullptr, y.size(), &motion};
    const std::unique_ptr<gsl_odeiv2_driver, FreeDriver> driver(
        gsl_odeiv2_driver_alloc_y_new(&system, gsl_odeiv2_step_rk8pd,
                                      times.empty() ? 1 : std::max(times.back(), 1e-300) * 1e-6, 1e-13 * scale, 1e-12));
    gsl_odeiv2_driver_set_nmax(driver.get(), 1000000);
    std::vector<WaveState> out;
    double t = 0;
    for (const double until : times) {
        if (until < t) throw std::invalid_argument(fmt::format("times must increase from 0, but {} does not", until));
        const int status = until > t ? gsl_odeiv2_driver_apply(driver.get(), &t, until, y.data()) : GSL_SUCCESS;
        pause.check();
        if (status != GSL_SUCCESS)
            throw SolveError(fmt::format("the amplitude equations could not be solved beyond t = {:.6g}: {}", t,
                                         status == GSL_EBADFUNC ? "the radius vanishes" : gsl_strerror(status)));
        out.push_back(state(motion, until, y));
    }
    return out;
}

std::optional<TubeStart> tube_start(const Problem& c) {
    const Tube* shape = std::get_if<Tube>(&c.shape);
    if (!shape || c.equilibrium || c.energy.H0_varies()) return std::nullopt;
    TubeStart start{{on_tube(c.energy, shape->length), shape->radius, 0}, shape->length, {}};
    std::map<std::pair<int, int>, std::complex<double>> sums;
    for (const TubeMode& mode : shape->modes)
        if (mode.n == 0 && mode.m == 0)
            start.tube.radius += mode.amplitude * std::cos(mode.phase);
        else
            sums[{mode.n, mode.m}] += std::polar(1.0, mode.phase) * mode.amplitude;
    for (const auto& [wave, sum] : sums)
        if (std::abs(sum) > 0) start.waves.push_back({wave.first, wave.second, std::abs(sum), 0});
    const MotionLaw& law = c.law;
    if (const auto tension = tension_of(law, start.tube.energy, start.tube.radius))
        start.tube.tension = *tension;
    else if (!start.waves.empty())
        start.tube.tension = tension_of_waves(start.tube, law, start.length, start.waves);
    return start;
}

namespace {

// A radius that changes while membrane is supplied: the equations for waves on it are not known.
bool drifts_unknown(const MotionLaw& law, const UniformTube& tube) {
    const double scale = std::abs(density(tube.energy, -1 / tube.radius, 0.0).HH) / std::pow(tube.radius, 3);
    return law.inextensible && std::abs(radius_rate_of(law, tube)) > 1e-9 * scale;
}

}  // namespace

std::optional<double> mean_rate(const Problem& c, int n, int m, double from, double to) try {
    std::optional<TubeStart> start = tube_start(c);
    const MotionLaw& law = c.law;
    if (!start || !(to > from) || law.loads_change() || law.pressure_of_volume || drifts_unknown(law, start->tube))
        return std::nullopt;
    std::vector<Wave>& waves = start->waves;
    auto ours = std::find_if(waves.begin(), waves.end(), [&](const Wave& w) { return w.n == n && std::abs(w.m) == m; });
    if (ours == waves.end()) {
        if (!tension_of(law, start->tube.energy, start->tube.radius)) return std::nullopt;
        ours = waves.insert(ours, {n, m, 1, 0});
    }
    const auto at = ours - waves.begin();
    const auto states = waves_in_time(start->tube, law, start->length, waves, {from, to});
    const double rate = std::log(std::abs(states[1].amplitudes[at] / states[0].amplitudes[at])) / (to - from);
    return std::isfinite(rate) ? std::optional(rate) : std::nullopt;  // else it has decayed below the smallest number
} catch (const std::invalid_argument&) {  // an invalid wave, for example an infinitely fast one
    return std::nullopt;
}

}  // namespace tubule::theory
