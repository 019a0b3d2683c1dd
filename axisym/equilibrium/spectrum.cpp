#include "axisym/equilibrium/spectrum.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>
#include <utility>

#include "axisym/curve/bead_forms.hpp"
#include "axisym/splines/breaks.hpp"
#include "common/geometry/profile_point.hpp"
#include "common/solve/dense.hpp"
#include "common/solve/pause.hpp"
#include "common/solve/sparse.hpp"

namespace tubule::axisym {
namespace {

// Condition on the multipliers where the period is free, theory.md (3.19): slopes . multipliers = wanted. No slopes
// where it is fixed.
struct StretchBalance {
    Eigen::VectorXd slopes;
    double wanted = 0;
};

void append(Eigen::VectorXd& v, double value) {
    v.conservativeResize(v.size() + 1);
    v[v.size() - 1] = value;
}

// The multipliers that minimise |force + columns multipliers|, among those that meet the balance.
Eigen::VectorXd multipliers_for(const Eigen::MatrixXd& columns, const Eigen::VectorXd& force,
                                const StretchBalance& balance) {
    // Area and volume are one constraint on a sphere or a tube: least squares of least norm, up to the mesh's error.
    constexpr double mesh_error = 1e-6;
    if (balance.slopes.size() == 0) return least_squares(columns, -force, mesh_error);
    const Eigen::VectorXd& c = balance.slopes;
    Eigen::VectorXd out = c * (balance.wanted / c.squaredNorm());
    if (c.size() == 1) return out;
    const Eigen::Vector2d along(-c[1], c[0]);
    return out + along * least_squares(columns * along, -(force + columns * out), mesh_error)(0);
}

Loads loads_of(const SpectrumSettings& settings) {
    return {settings.sigma.value_or(0), settings.pressure, settings.force.value_or(0), settings.pressure_of_volume};
}

// How far a shape is from rest with these multipliers: Spectrum::unbalanced.
double distance_from_rest(const CurveForms& forms, const std::optional<BeadForms>& beads, const Bending& bending,
                          const Equilibrium& e, const Eigen::VectorXd& force, const Eigen::MatrixXd& mass) {
    const double size = e.observed.length / (2 * pi);
    // A little resistance, for neutral modes: translations, and changes of size of a scale-invariant energy.
    const double resistance = 1e-3 * e.reference_energy / (e.observed.area * size * size);
    Weights weights{.energy = 1, .area = e.sigma, .volume = e.lambda, .M = e.mu};
    weights.gauge = 0.01 * e.reference_energy;
    const Eigen::VectorXd M = forms.gradient({.M = 1}, e.x);
    Eigen::MatrixXd hessian = Eigen::MatrixXd(forms.hessian(weights, e.x)) + resistance * mass +
                              bending.alpha.value_or(0) * M * M.transpose();
    if (beads) {
        Eigen::SparseMatrix<double> of_beads = forms.pattern();
        beads->add_hessian(e.x.data(), e.beads, forms.slots(), of_beads.valuePtr());
        const auto [columns, factors] = beads->equations().following(beads->on(e.x.data()), e.beads);
        hessian += Eigen::MatrixXd(of_beads) + columns * factors.asDiagonal() * columns.transpose();
    }
    const Eigen::VectorXd step = solve_dense(hessian, force);
    return std::sqrt(step.dot(mass * step) / e.observed.area) / size;
}

// The shape on this many elements, with the multipliers that minimise the force in the norm (INT b^2 dS)^(1/2).
Equilibrium balanced(const StationaryProblem& problem, Held kept, const SpectrumSettings& settings, const Curve& shape,
                     int elements, double& unbalanced) {
    const Bending& bending = problem.bending;
    const std::optional<double> sigma = settings.sigma;
    constexpr int degree = 5;
    Equilibrium e;
    std::vector<double> breaks = shape.seams.empty()
                                     ? equal_breaks(elements)
                                     : graded_breaks(ArcLength(shape).seams(), 1.5 / elements, 0.5 / elements);
    if (problem.beads)
        breaks = refined_at_beads(shape.topology, breaks, problem.beads->width, ArcLength(shape).total());
    e.space = std::make_shared<CurveSpace>(shape.topology, breaks, degree, degree - 1, shape.length);
    e.x = fit(*e.space, shape);
    const CurveForms forms(*e.space, bending);
    std::optional<BeadForms> beads;
    if (problem.beads) beads.emplace(bead_forms(*e.space, problem));
    e.observed = forms.observe(e.x), e.length = beads ? beads->distance(e.x.data()) : shape.length;
    e.reference_energy = forms.reference_energy(e.x);

    const bool area = kept == Held::area || kept == Held::area_and_volume || kept == Held::reduced_volume,
               volume = kept == Held::volume || kept == Held::area_and_volume || kept == Held::reduced_volume;
    std::vector<std::pair<Eigen::VectorXd, double*>> unknown;  // forces, and the multipliers of each
    if (area && !sigma) unknown.emplace_back(forms.gradient({.area = 1}, e.x), &e.sigma);
    if (volume) unknown.emplace_back(forms.gradient({.volume = 1}, e.x), &e.lambda);
    Eigen::VectorXd pull = Eigen::VectorXd::Zero(e.x.size());  // of beads under a force of 1
    double pulled = beads ? settings.force.value_or(0) : 0;
    if (beads) beads->add_force(e.x.data(), beads->numbers(e.x.data(), 1), pull.data());
    if (problem.held_distance()) unknown.emplace_back(pull, &pulled);
    const Eigen::MatrixXd mass = forms.mass(e.x);
    const Eigen::LLT<Eigen::MatrixXd> factors(mass);
    const auto scaled = [&](const Eigen::VectorXd& v) { return Eigen::VectorXd(factors.matrixL().solve(v)); };
    e.sigma = sigma.value_or(0), e.lambda = volume ? 0 : -problem.loads.pressure_at(e.observed.volume);
    e.mu = area_difference_force(bending, e.observed.M);
    const auto weights = [&] { return Weights{.energy = 1, .area = e.sigma, .volume = e.lambda, .M = e.mu}; };
    const auto force = [&]() -> Eigen::VectorXd { return forms.gradient(weights(), e.x) + pulled * pull; };
    Eigen::MatrixXd columns(e.x.size(), static_cast<Eigen::Index>(unknown.size()));
    for (std::size_t k = 0; k < unknown.size(); ++k)
        columns.col(static_cast<Eigen::Index>(k)) = scaled(unknown[k].first);
    if (!unknown.empty()) {
        StretchBalance balance;
        if (settings.force && !beads) {
            const auto slope = [&](const Weights& of) { return forms.stretch_slope(of, e.x); };
            if (area && !sigma) append(balance.slopes, slope({.area = 1}));
            if (volume) append(balance.slopes, slope({.volume = 1}));
            balance.wanted = *settings.force * shape.length - slope(weights());
        }
        const Eigen::VectorXd multipliers = multipliers_for(columns, scaled(force()), balance);
        for (std::size_t k = 0; k < unknown.size(); ++k) *unknown[k].second = multipliers[static_cast<Eigen::Index>(k)];
    }
    if (beads) e.beads = beads->numbers(e.x.data(), pulled);
    unbalanced = distance_from_rest(forms, beads, bending, e, force(), mass);
    e.stop = Stop::finished;
    return e;
}

// The largest difference of a rate, relative to the larger of it and the slowest rate of all.
double difference(const std::vector<ModeRates>& a, const std::vector<ModeRates>& b) {
    double slowest = std::numeric_limits<double>::infinity(), largest = 0;
    for (const ModeRates& mode : b)
        for (const double rate : mode.rates)
            if (std::abs(rate) > 0) slowest = std::min(slowest, std::abs(rate));
    for (std::size_t m = 0; m < b.size(); ++m)
        for (std::size_t i = 0; i < std::min(a[m].rates.size(), b[m].rates.size()); ++i)
            largest =
                std::max(largest, std::abs(a[m].rates[i] - b[m].rates[i]) / std::max(std::abs(b[m].rates[i]), slowest));
    return largest;
}

void refuse_what_has_none(const MotionLaw& law, const Curve& shape, const SpectrumSettings& settings) {
    if (is_patch(shape.topology))
        throw std::invalid_argument("a patch is held at its rings: its growth rates are those of equilibrium.modes");
    if (law.inertia != 0)
        throw std::invalid_argument(
            "spectra neglect inertia: use model stokes instead of fluid; its growing modes are the same");
    if (law.free_period && settings.first == 0)
        throw std::invalid_argument("a free period has no spectrum of m = 0: those displacements keep the period");
}

}  // namespace

Held held_by(const MotionLaw& law) {
    if (!law.area_is_free()) return law.keeps_volume ? Held::area_and_volume : Held::area;
    return law.keeps_volume ? Held::volume : Held::nothing;
}

void set_loads(SpectrumSettings& settings, const MotionLaw& law, Held held, double time) {
    const Loads loads = loads_at(law, time);
    if (!holds_area(held) && held != Held::reduced_volume && !settings.sigma) settings.sigma = loads.tension;
    settings.pressure = loads.pressure, settings.pressure_of_volume = loads.of_volume;
    if (law.free_period || (law.beads && !law.beads->extension)) settings.force = loads.force;
}

Spectrum spectrum(const Bending& bending, const MotionLaw& law, Held held, const Curve& shape,
                  const SpectrumSettings& settings) {
    refuse_what_has_none(law, shape, settings);
    StationaryProblem problem{bending, {}, loads_of(settings)};
    if (holds_volume(held) || held == Held::reduced_volume) problem.loads.of_volume.reset();
    problem.beads = law.beads;
    Spectrum out;
    for (int elements = 24; elements <= settings.max_elements; elements += elements / 2) {
        check_pause();
        const Equilibrium e = balanced(problem, held, settings, shape, elements, out.unbalanced);
        Constraints& c = problem.constraints;
        if (held == Held::area || held == Held::area_and_volume) c.area = e.observed.area;
        if (held == Held::volume || held == Held::area_and_volume) c.volume = e.observed.volume;
        if (held == Held::reduced_volume) c.reduced_volume = reduced_volume(e.observed.area, e.observed.volume);
        const bool last = elements + elements / 2 > settings.max_elements;
        if (settings.first == 0 && (held != Held::nothing || law.inextensible || problem.held_distance()) &&
            !out.at_rest()) {
            if (!last) continue;  // perhaps a finer mesh shows it at rest
            throw std::invalid_argument(
                "the shape is not stationary: a moving shape has a spectrum only in gradient flow with free area and "
                "volume");
        }
        const ModeStability stability(problem, e);
        std::vector<ModeRates> modes;
        for (int m = settings.first; m <= settings.last; ++m) modes.push_back(stability.rates(m, law, settings.count));
        const bool first = out.modes.empty();
        out.estimated_error = first ? std::numeric_limits<double>::infinity() : difference(out.modes, modes);
        out.modes = std::move(modes);
        out.sigma = e.sigma, out.lambda = e.lambda, out.area = e.observed.area;
        out.elements = e.space->splines().elements();
        if (out.estimated_error <= settings.accuracy) break;
    }
    return out;
}

}  // namespace tubule::axisym
