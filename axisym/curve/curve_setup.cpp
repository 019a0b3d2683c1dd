#include "axisym/curve/curve_setup.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "axisym/curve/curve_requirements.hpp"
#include "axisym/splines/breaks.hpp"
#include "common/case/read.hpp"
#include "common/result/frame_profile.hpp"
#include "common/result/start_frame.hpp"
#include "common/run/energy_checks.hpp"
#include "common/run/run_output.hpp"
#include "common/solve/sparse.hpp"

namespace tubule::axisym {
namespace {

// Measured choices: docs/decisions/curves.md, "Curves in motion".
// Elements at a seam, where the curvature jumps: at most this part of those elsewhere and, for the energy that a smooth
// spline loses there, at most the accuracy times `seam_per_accuracy`, of the length of the profile. Those of the run
// are not smaller than `least_seam`, or rounding there prevents the integrator from starting; its first step smooths
// the seam over far more than that.
constexpr double seam_size = 0.15, seam_per_accuracy = 5, least_seam = 3e-4;
// In runs of more elements those at beads are shorter in proportion.
constexpr double bead_elements = 8;
constexpr double most_risen = 0.1;         // of E_ref: the energy of a first step that cannot be believed
constexpr double newton_error = 2e-9;      // of the iteration, relative to the curve: area and volume are kept to that
constexpr double newton_rounding = 1e-13;  // and by rounding, about
// 1 - (INT H)^2/(A INT H^2): below these, area and volume are (nearly) the same condition; see CurveLaw.
constexpr double same_everywhere = 1e-12, nearly_same = 1e-3;

// 1 - (INT H dS)^2/(A INT H^2 dS): zero where H is the same everywhere.
double variation_of_H(const CurveSpace& space, const Eigen::VectorXd& x) {
    const auto squares = [&](double H0) {
        Bending bending{{}, H0};
        bending.k[term_number("k20")] = 1;
        return CurveForms(space, bending).observe(x);
    };
    const CurveObservation o = squares(0);
    const double sum = (o.energy + o.area - squares(1).energy) / 2;
    return 1 - sum * sum / (o.area * o.energy);
}

// Weight of the gauge, in the scale of the rows that it is added to (curve_motion.hpp).
double gauge_of(const Problem& c, double energy, double area) {
    const MotionLaw law = c.law;
    if (law.inertia != 0) return std::sqrt(energy * area);
    return law.viscosity != 0 ? energy * c.model.Re : energy;
}

// Elements of the asked size, small ones at seams. These shrink faster than the rest, since the error is of first order
// there and the difference of a pair must exceed it; but not in a fluid, where they allow shorter waves, which take ten
// times the steps.
std::vector<double> first_breaks(const ArcLength& arc, const CurveSettings& settings, const Problem& c, double least) {
    const double size = 1.0 / settings.elements;
    const std::vector<double> seams = arc.seams();
    const bool inertia = c.law.inertia != 0;
    const double shrunk = std::pow(first_curve_elements * size, 2),
                 largest = seam_size * (inertia ? size : shrunk / first_curve_elements);
    const double at_seam = std::max(std::min(largest, seam_per_accuracy * c.accuracy.energy * shrunk), least);
    const std::vector<double> breaks = !seams.empty()             ? graded_breaks(seams, size, at_seam)
                                       : settings.density.empty() ? equal_breaks(settings.elements)
                                                                  : breaks_of(settings.density, settings.elements);
    if (!c.law.beads) return breaks;
    const Beads& beads = *c.law.beads;
    const double lengthens = beads.extension ? beads.extension->largest() : 0;
    return refined_at_beads(arc.meridian().topology, breaks, beads.width * std::min(1.0, bead_elements * size),
                            arc.total() + lengthens);
}

std::unique_ptr<CurveSpace> space_of(const Problem& c, const Curve& meridian, const std::vector<double>& breaks) {
    const int degree = c.discretisation.order;
    return std::make_unique<CurveSpace>(meridian.topology, breaks, degree,
                                        c.discretisation.smoothness.value_or(degree - 1), meridian.length,
                                        c.law.free_period);
}

// H0 is a property of the points of the initial shape.
void fix_H0(const Problem& c, CurveForms& forms, const Eigen::VectorXd& x) {
    if (!c.energy.H0_varies()) return;
    try {
        forms.fix_H0(x);
    } catch (const std::invalid_argument& error) {
        throw complaint_about_H0(c, error.what());
    }
}

}  // namespace

CurveLaw law_of(const Problem& c) {
    CurveLaw law = c.law;
    law.lagrangian =
        c.energy.H0_varies() || (law.inextensible && c.discretisation.parametrisation != Parametrisation::even);
    law.swirls = c.velocity.initial == InitialVelocity::rotation || law.source.force[1];
    return law;
}

namespace {

struct MakeMeridian {
    const Problem& c;
    template <class Exact>
    Curve operator()(const Exact& shape) const {
        return meridian(shape);
    }
    Curve operator()(const ProfileFile& file) const { return start_profile(c, file).curve; }
    Curve operator()(const MeshFile&) const { throw complaint(c, "shape.kind", "is a mesh, not a profile"); }
    Curve operator()(const ResultFrame&) const {
        try {
            return meridian(disturbed_curve(c, start_frame(c).record));
        } catch (const std::invalid_argument& error) {
            throw complaint(c, "shape.path", fmt::format("cannot be used: {}", error.what()));
        }
    }
};

}  // namespace

std::optional<PerturbedCurve> initial_velocity(const Problem& c) {
    if (c.velocity.initial != InitialVelocity::result) return std::nullopt;
    const Record frame = start_frame(c).record;
    PerturbedCurve out = frame_curve(frame);
    out.velocity = frame_velocity(frame, out);
    if (!out.velocity)
        throw complaint(c, "velocity.initial",
                        "must not be \"result\": the frame of shape.path is no profile with a velocity");
    return out;
}

Curve initial_curve(const Problem& c) {
    return std::visit(MakeMeridian{c}, c.shape);
}

InitialShape initial_shape(const Problem& c) {
    Curve whole = initial_curve(c);
    std::optional<PerturbedCurve> velocity = initial_velocity(c);
    if (!velocity && c.discretisation.symmetry && !c.energy.H0_varies() && c.energy.potentials.empty() &&
        !c.law.beads && !c.law.source.act() && (whole.topology == Topology::cell || whole.topology == Topology::tube)) {
        try {
            whole = half(whole);
        } catch (const std::invalid_argument&) {  // not mirror-symmetric
        }
    }
    require_patch(c, whole);
    require_place(c, whole);
    const auto [area, volume] = area_and_volume(whole);
    const double length = c.law.beads ? bead_distance(c, whole) : whole.length;
    const auto* file = std::get_if<ProfileFile>(&c.shape);
    ShapeEnergy energy = bending_energy(whole, c.energy);
    return {std::move(whole),
            area,
            volume,
            length,
            std::move(energy),
            std::move(velocity),
            file ? start_profile(c, *file).note() : ""};
}

DerivativeCheck check_area_differences(const Problem& c) {
    const Curve shape = meridian(std::get<Tube>(c.shape));
    const CurveSpace space(Topology::tube, equal_breaks(12), 5, 4, shape.length);
    const CurveForms forms(space, c.energy);
    const auto M = [&](const Eigen::VectorXd& x) { return forms.M(x.data()); };
    const auto weights = [&](const Eigen::VectorXd& x) { return Weights{.M = area_difference_force(c.energy, M(x))}; };
    return check_derivatives([&](const Eigen::VectorXd& x) { return area_difference_energy(c.energy, M(x)); },
                             [&](const Eigen::VectorXd& x) { return forms.gradient(weights(x), x); },
                             [&](const Eigen::VectorXd& x, const Eigen::VectorXd& w) -> Eigen::VectorXd {
                                 const Eigen::VectorXd slope = forms.gradient({.M = 1}, x);
                                 return forms.hessian(weights(x), x) * w + *c.energy.alpha * slope.dot(w) * slope;
                             },
                             fit(space, shape));
}

double InitialShape::free_energy(const MotionLaw& law) const {
    return bending.energy + loads_at(law, 0).energy(area, volume, length);
}

CurveSetup::CurveSetup(const Problem& of, const InitialShape& from, const CurveSettings& with)
    : c(of), start(from), settings(with), series(curve_series(of)) {
    const ArcLength arc(start.meridian);
    space = space_of(c, start.meridian, first_breaks(arc, settings, c, least_seam));
    CurveForms forms(*space, c.energy);
    const Eigen::VectorXd x = fit(*space, arc);
    fix_H0(c, forms, x);
    const FormulaDomain::Margin domain = forms.observe(x).domain;
    require_defined(c, domain, fmt::format("s = {:.4g}", domain.place));
    CurveLaw law = law_of(c);
    require_pressure(c, start.volume);
    if (space->topology() == Topology::tube) require_periodic_sources(c, start.meridian.length);
    law.swirls = law.swirls || (start.velocity && start.velocity->velocity->swirls);
    law.open_rim = space->is_patch() && law.reservoir;
    if (law.open_rim) law.lagrangian = false;
    const double energy = start.free_energy(law);
    magnitude = std::max(std::abs(energy), std::max(std::abs(start.bending.energy), start.bending.magnitude) +
                                               load_scale(law, start.area, start.volume, start.length));
    reference_energy = tubule::reference_energy(c, energy, magnitude);
    const double variation =
        is_patch(start.meridian.topology) && is_flat(start.meridian) ? 0 : variation_of_H(*space, x);
    const bool patch_alone = space->is_patch() && !law.keeps_volume;  // a part of a sphere at first, but not later
    law.holds_area = law.conserves_area() &&
                     (patch_alone || (variation > same_everywhere && (variation > nearly_same || !law.keeps_volume)));
    // Where area and volume are the same condition, one multiplier has no value.
    const bool keeps_both = law.keeps_volume && !law.area_is_free() && !law.free_period;
    if (keeps_both && variation <= same_everywhere) {
        refuse_to_deform(c);
        law.keeps_volume = false;
    }
    motion = std::make_unique<CurveMotion>(*space, c.energy, law, gauge_of(c, magnitude, start.area), start.area,
                                           start.volume);
    if (c.energy.H0_varies()) motion->fix_H0(x);
    if (space->is_patch()) motion->hold_rings(x);
    if (law.beads) motion->hold_beads(x);
}

Snapshot CurveSetup::with_exact_shape(Snapshot s) const {
    s.o.energy = start.bending.energy, s.o.energy_term = start.bending.energy_term;
    s.o.energy_kg = start.bending.energy_kg;
    s.o.energy_alpha = start.bending.energy_alpha, s.o.M = start.bending.M;
    s.o.potential.energy = start.bending.potential;
    s.o.area = start.area, s.o.volume = start.volume;
    s.free_energy = start.free_energy(motion->law());
    return s;
}

ImplicitSystem CurveSetup::system() const {
    const CurveMotion& motion = *this->motion;
    const MotionLayout& at = motion.layout();
    ImplicitSystem system;
    system.residual = [&motion](double t, const double* y, const double* v, double* F) {
        return motion.residual(t, y, v, F);
    };
    system.jacobian = [&motion](double t, const double* y, const double* v, double cj, double* J) {
        motion.jacobian(t, y, v, cj, J);
    };
    system.pattern = &motion.pattern();
    system.differential = motion.differential();
    // Velocities without inertia, pressures and numbers follow from the curve; their own errors do not count. Over
    // a very short step rounding alone moves them more than the curve: they do not affect when the iteration ends
    // either.
    const double length = std::sqrt(start.area);
    system.scale = Eigen::VectorXd::Constant(at.size, 1e12 * length / settings.tolerance);
    system.scale.head(space->size()).setConstant(length);
    if (motion.law().inertia != 0)
        for (int i = space->size(); i < at.p; ++i) system.scale[i] = std::sqrt(magnitude / start.area);
    return system;
}

TimeControl CurveSetup::control(double first_step) const {
    TimeControl control;
    control.relative = settings.tolerance;
    control.absolute = 0.1 * settings.tolerance;
    control.max_order = c.time.max_order;
    control.first_step = first_step;
    control.growth = step_growth_of(settings);
    control.newton =
        std::clamp(newton_error / settings.tolerance, 1e-5, std::max(0.01, newton_rounding / settings.tolerance));
    control.two_iterations = true;
    control.second_may_grow = motion->law().open_rim;  // by the velocity, as the normal there turns
    return control;
}

InitialState state_without_velocity(const CurveSetup& setup) {
    InitialState out;
    out.y = out.rate = Eigen::VectorXd::Zero(setup.motion->layout().size);
    out.y.head(setup.space->size()) = fit(*setup.space, ArcLength(setup.start.meridian));
    setup.motion->set_followers(out.y);
    out.shown = out.y;
    return out;
}

CurveSettings settings_for(const Problem& c, const InitialShape& start, CurveSettings s) {
    constexpr double most_lost = 0.1;  // of the energy; what less than that costs, a pair of runs shows
    if (c.profile_resolution_given()) return s;
    const double allowed = most_lost * start.bending.magnitude;
    const ArcLength arc(start.meridian);
    s.elements = std::max(s.elements, elements_for(c.energy.potentials, arc.total()));
    if (!start.meridian.seams.empty()) return s;
    while (can_be_finer(s)) {
        // Waves that only the gradient term holds need elements half as long as their scale.
        const auto space = space_of(c, start.meridian, first_breaks(arc, s, c, least_seam));
        CurveForms forms(*space, c.energy);
        const Eigen::VectorXd x = fit(*space, arc);
        fix_H0(c, forms, x);
        const CurveObservation o = forms.observe(x);
        if (!(std::abs(o.energy - start.bending.energy) > allowed) && o.coarse <= 0.5) break;
        s.elements = static_cast<int>(std::ceil(1.5 * s.elements));
    }
    return s;
}

namespace {

// The velocity of the frame that the run begins with; parameters are fractions of the arc length there and here.
void set_velocity(const CurveSetup& setup, Eigen::VectorXd& y) {
    const PerturbedCurve& curve = *setup.start.velocity;
    const MotionLayout& at = setup.motion->layout();
    const auto project = [&](const SplineSpace& field, int offset, int component) {
        y.segment(offset, field.size()) = field.project([&](double s) {
            // A patch has no base surface: its functions are those of s.
            if (is_patch(curve.topology)) return value_at(curve.velocity->meridional, s)[component == 0 ? 0 : 1];
            return velocity(curve, Torus{2, 1}, base_point(curve, s, 0))[component];
        });
    };
    project(setup.space->r(), at.u_r, 0);
    project(setup.space->z(), at.u_z, 2);
    if (at.swirl >= 0) project(setup.space->r(), at.swirl, 1);
}

}  // namespace

InitialState initial_state(const CurveSetup& setup) {
    const CurveSpace& space = *setup.space;
    const MotionLayout& at = setup.motion->layout();
    Eigen::VectorXd y = Eigen::VectorXd::Zero(at.size);
    y.head(space.size()) = fit(space, ArcLength(setup.start.meridian));
    setup.motion->set_followers(y);
    if (at.swirl >= 0) y.segment(at.swirl, space.r().size()) = setup.c.velocity.omega * y.head(space.r().size());
    if (setup.start.velocity) set_velocity(setup, y);
    InitialState found = state_after(setup, y, 0);
    found.shown = found.y;
    found.shown.head(space.size()) = y.head(space.size());
    return found;
}

// Short, since a shape that is not smooth changes fast, and over before the first output; yet long enough that
// rounding, at the small elements of a seam or where much accuracy is asked for, does not prevent the next step
// (docs/decisions/curves.md).
InitialState state_after(const CurveSetup& setup, const Eigen::VectorXd& y, double time) {
    const double until = std::min(OutputTimes(setup.c.time, time).next(), next_kink(setup.motion->law(), time)) - time;
    const bool tight = setup.c.accuracy.energy < 1e-9 && setup.start.meridian.seams.empty();
    double h = std::min((tight ? 1e-7 : 1e-8) * first_step_factor(setup.settings) * std::min(setup.c.time.end, 1.0),
                        0.1 * until);
    const Eigen::VectorXd rest = Eigen::VectorXd::Zero(y.size());
    const double most =
        measure(*setup.motion, time, y.data(), rest.data()).total() + most_risen * setup.reference_energy;
    for (int tries = 0;; ++tries) try {
            const InitialState found = setup.motion->consistent(y, h, time);
            const Snapshot soon = measure(*setup.motion, found.time, found.y.data(), found.rate.data());
            if (!is_admissible(soon) || !(soon.total() <= most + std::max(found.work, 0.0)))
                throw SolveError("the first step leads to no admissible shape of lower energy");
            return found;
        } catch (const SolveError&) {
            if (tries == 4 || 20 * h > until) throw;
            h *= 10;
        }
}

}  // namespace tubule::axisym
