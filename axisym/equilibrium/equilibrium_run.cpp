#include "axisym/equilibrium/equilibrium_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "axisym/curve/curve_measures.hpp"
#include "axisym/curve/curve_requirements.hpp"
#include "axisym/curve/curve_samples.hpp"
#include "axisym/curve/curve_setup.hpp"
#include "axisym/curve/shape_integrals.hpp"
#include "axisym/curve/vesicle_families.hpp"
#include "axisym/equilibrium/continuation.hpp"
#include "axisym/equilibrium/equilibrium.hpp"
#include "axisym/equilibrium/mode_stability.hpp"
#include "common/case/read.hpp"
#include "common/equilibrium/equilibrium_task.hpp"
#include "common/geometry/profile_point.hpp"
#include "common/run/energy_checks.hpp"
#include "common/run/shape_run.hpp"

namespace tubule::axisym {
namespace {

struct Task : ShapeTask<Equilibrium, EquilibriumSettings> {
    Curve start;
};

constexpr double largest_of_family = 0.99;  // reduced volume where the search begins

// The first shape of a family, of this reduced volume and about this area.
Curve start_of(Family family, double reduced, double area) {
    // Spheres have no family: nearly all of them are found from a little below.
    const double v = std::min(reduced, largest_of_family);
    const Curve shape = family == Family::stomatocyte ? bowl(0.3, 2.3)
                        : family == Family::pear      ? pear(std::max(v, 0.72))
                                                      : spheroid(v, family == Family::prolate);
    return scaled(shape, std::sqrt(area / area_and_volume(shape)[0]));
}

// H0 of the area is a number everywhere, and the same on both sides of a plane of symmetry.
void check_varying_H0(const Problem& c, const Curve& start) {
    if (!c.energy.H0_varies()) return;
    constexpr int points = 256;
    const auto H0 = [&](double area) {
        const double variables[]{area, 0, 0};
        return evaluate(*c.energy.H0_formula, variables);
    };
    const bool symmetric = start.topology == Topology::half_tube || start.topology == Topology::half_cell;
    for (int i = 0; i <= points; ++i) {
        const double area = static_cast<double>(i) / points, here = H0(area), there = H0(1 - area);
        if (!std::isfinite(here))
            throw complaint_about_H0(c, fmt::format("is no number where {:.4g} of the area is below", area));
        if (symmetric && std::abs(here - there) > 1e-6 * (1 + std::abs(here)))
            throw complaint_about_H0(
                c, fmt::format("must be mirror-symmetric as this shape is, but at {:.4g} and {:.4g} of the area it is "
                               "{:.6g} and {:.6g}",
                               area, 1 - area, here, there));
    }
}

// What the constraints ask for.
double wanted_reduced_volume(const Constraints& held) {
    return held.reduced_volume ? *held.reduced_volume : reduced_volume(*held.area, *held.volume);
}

Task task_of(const Problem& c) {
    const EquilibriumChoices& e = *c.equilibrium;
    Task task;
    try {
        task.start = initial_curve(c);
        if (task.start.topology == Topology::tube) {
            const double z = task.start.at(0)[2];
            if (std::ranges::any_of(c.energy.potentials, &Potential::acts_along_axis) &&
                std::abs(z) > 1e-9 * task.start.length)
                throw complaint(c, "shape",
                                fmt::format("must begin at z = 0 where a potential depends on z, not {:.4g}", z));
            task.start = half(task.start);
        }
    } catch (const std::invalid_argument& error) {
        throw CaseError(fmt::format("{}: shape: {}", c.path, error.what()));
    }
    check_varying_H0(c, task.start);
    const auto [area, volume] = area_and_volume(task.start);
    require_pressure(c, volume);
    require_place(c, task.start);
    require_patch(c, task.start);
    task.problem = stationary_problem(c, area, volume);
    task.problem.rings = rings_of(task.start, c.law.rim);
    const Constraints& held = task.problem.constraints;
    if (e.family) {
        if (task.start.topology != Topology::cell)
            throw complaint(c, "equilibrium.family",
                            "is of closed cells, and [shape] is none: leave it out, or start from an ellipsoid");
        task.start = start_of(*e.family, wanted_reduced_volume(held), held.area.value_or(area));
    }
    task.settings.accuracy = c.accuracy.energy;
    task.settings.degree = c.discretisation.order;
    task.settings.descend = e.descend;
    task.settings.elements =
        std::max(task.settings.elements, elements_for(c.energy.potentials, ArcLength(task.start).total()));
    task.settings.max_elements = std::max(task.settings.max_elements, 2 * task.settings.elements);
    if (c.law.beads) task.problem.bead_distance = bead_distance(c, task.start);
    task.resolve_branch(c);
    check_problem(c, task.problem, task.start.length);
    return task;
}

// One point of the profile.
struct Sample {
    double r, z, H, K;
};

Sample sample(const CurveSpace& space, const Eigen::VectorXd& x, double s) {
    const double beside = beside_pole(space, s);
    const CurveSample at = space.evaluate(x, s), c = space.evaluate(x, beside);
    const auto p = profile_point(c.r, c.r1, c.r2, c.z1, c.z2);
    return {beside != s ? 0 : at.r, at.z, p.H, p.K};
}

struct Row : ShapeRow<Equilibrium> {
    const CurveObservation& o;
    const ShapeMeasures& measures;
    const std::vector<ModeRates>& modes;
    double distance_to_start;
};

// The first mode whose growth is found: with a free period, axisymmetric displacements change the period, too, and
// only negative_directions counts them.
int first_mode(const Problem& c) {
    return c.model.free_period ? 1 : 0;
}

bool has_force(const Problem& c) {
    return std::holds_alternative<Tube>(c.shape) || std::holds_alternative<ResultFrame>(c.shape) || c.law.beads ||
           has_two_rings(c.shape);
}

SeriesTable<Row> shape_series(const Problem& c) {
    SeriesTable<Row> table;
    add_first_columns(table, c.equilibrium->branch);
    table.add_family("energy_<kl>", term_names(c.energy),
                     [](const Row& r, std::size_t term) { return r.o.energy_term[term]; });
    if (c.energy.kg > 0 || c.equilibrium->branch.parameter == vary_kg)
        table.add({{"energy_kg", [](const Row& r) { return r.o.energy_kg; }}});
    if (c.energy.alpha)
        table.add({{"energy_alpha", [](const Row& r) { return r.o.energy_alpha; }},
                   {"M", [](const Row& r) { return r.o.M; }}});
    if (!c.energy.potentials.empty())
        table.add({{"potential_energy", [](const Row& r) { return r.o.potential.energy; }}});
    add_extents(table);
    if (has_force(c)) table.add({{"force", [](const Row& r) { return axial_force(r.problem, r.point.shape); }}});
    if (c.law.beads) table.add({{"bead_distance", [](const Row& r) { return r.point.shape.length; }}});
    if (!c.energy.potentials.empty())
        table.add({{"potential_force", [](const Row& r) { return r.o.potential.force; }}});
    table.add({{"negative_directions", [](const Row& r) { return static_cast<double>(r.point.index); }},
               {"meridian_length", [](const Row& r) { return r.o.length; }},
               {"height", [](const Row& r) { return r.measures.height; }},
               {"r_middle", [](const Row& r) { return r.measures.r_middle; }},
               {"r_max", [](const Row& r) { return r.measures.r_max; }},
               {"pole_curvature", [](const Row& r) { return r.measures.pole_curvature; }},
               {"distance_to_start", [](const Row& r) { return r.distance_to_start; }}});
    std::vector<std::string> waves;
    for (int m = first_mode(c); m <= c.equilibrium->modes.value_or(-1); ++m) waves.push_back(std::to_string(m));
    table.add_family("growth_<m>", waves,
                     [](const Row& r, std::size_t m) { return r.modes[m].rates.empty() ? 0 : r.modes[m].rates[0]; });
    add_last_columns(table);
    return table;
}

bool meets(const Constraints& held, const CurveObservation& o) {
    const auto is = [](const std::optional<double>& wanted, double value) {
        return !wanted || std::abs(value / *wanted - 1) < 0.01;
    };
    return is(held.area, o.area) && is(held.volume, o.volume) &&
           is(held.reduced_volume, reduced_volume(o.area, o.volume));
}

std::optional<theory::LimitShape> limit_of(const Task& task) {
    const Constraints& held = task.problem.constraints;
    const bool closed = is_closed(task.start.topology);
    const bool at_places = !task.problem.bending.potentials.empty() || task.problem.beads;
    if (!closed || !held.area || !held.volume || at_places) return std::nullopt;
    return theory::vesiculated_limit(task.problem.bending, *held.area, *held.volume);
}

// Moved along the axis such that the mean height over the arc length is zero.
Curve centred(Curve m) {
    if (m.topology != Topology::cell) return m;
    const ArcLength arc(m);
    constexpr int points = 400;
    double mean = 0;
    for (int i = 0; i < points; ++i) mean += arc.point((i + 0.5) / points)[1] / points;
    m.at = [at = m.at, mean](double t) {
        auto p = at(t);
        p[2] -= mean;
        return p;
    };
    return m;
}

// What run_shapes() asks for.
class CurveShapes {
public:
    using Shape = Equilibrium;

    explicit CurveShapes(const Problem& c) : c_(c), task_(task_of(c)), series_(shape_series(c)) {}

    const Task& task() const { return task_; }
    Equilibrium find() const { return find_equilibrium(task_.problem, task_.start, task_.settings); }
    static int negative_directions(const Equilibrium& e) { return e.negative_directions; }
    static double energy(const Equilibrium& e) { return e.observed.energy; }
    static Extents extents(const StationaryProblem&, const Equilibrium& e) {
        return {e.observed.area, e.observed.volume, e.length};
    }
    static int elements(const Equilibrium& e) { return e.space->images() * e.space->splines().elements(); }

    void write(const ShapeRow<Equilibrium>& row, RunObserver& observer) const {
        const Equilibrium& e = row.point.shape;
        std::vector<ModeRates> modes;
        if (const auto last = c_.equilibrium->modes) {
            const bool known = e.stop == Stop::finished;
            const ModeStability stability(row.problem, e);
            for (int m = first_mode(c_); m <= *last; ++m)
                modes.push_back(known ? stability.rates(m, c_.law) : ModeRates{.m = m});
        }
        const double moved = hausdorff_distance(centred(task_.start), centred(meridian(*e.space, e.x)));
        observer.row(series_.values({row, e.observed, measures(*e.space, e.x), modes, moved}));
        observer.frame([&] { return frame(row, modes); });
    }

    static std::string advice(Stop stop) {
        switch (stop) {
            case Stop::solver_failed:
                return "begin with a shape closer to the solution, or use a looser accuracy.energy";
            case Stop::resolution_lost:
                return "use a looser accuracy.energy; a neck that closes cannot be followed to its end";
            case Stop::self_intersection:
                return "the equations can still be solved, but their solution is no longer an embedded surface";
            default:
                return "";
        }
    }

    void describe(const FoundShapes<Equilibrium>& found, RunSummary& s) const {
        const CurveObservation& o = found.last.observed;
        const double energy = o.energy;
        const auto wanted = c_.equilibrium->family;
        const auto family = wanted && !task_.set && s.stop.reason == Stop::finished
                                ? family_of(meridian(*found.last.space, found.last.x), reduced_volume(o.area, o.volume))
                                : std::nullopt;
        if (family && family != wanted)
            s.warnings.push_back(fmt::format("the search began at the family {} and found a shape of the family {}",
                                             name(*wanted), name(*family)));
        if (const auto limit = limit_of(task_);
            limit && !task_.set && s.stop.reason == Stop::finished && limit->energy < energy)
            s.warnings.push_back(
                fmt::format("a vesiculated limit has less energy, {:.6g} for {:.6g}: {}, joined by necks that shrink "
                            "to points. This shape is at best a local minimum",
                            limit->energy, energy, described(*limit)));
        s.effort =
            fmt::format("{} shape{}, {} elements in the last", found.count, found.count == 1 ? "" : "s", s.elements);
    }

private:
    Record frame(const ShapeRow<Equilibrium>& row, const std::vector<ModeRates>& modes) const {
        const Equilibrium& e = row.point.shape;
        std::vector<double> parameters;
        const auto sample_at = [&](double s) {
            parameters.push_back(s);
            return sample(*e.space, e.x, s);
        };
        const std::vector<Sample> samples = sample_profile(*e.space, sample_at, [](Sample&) {});
        Record out;
        out.time = row.number, out.kind = RecordKind::equilibrium;
        out.numbers = {{"energy", row.energy},
                       {"length", e.space->length(e.x.data())},
                       {"tension", e.sigma},
                       {"pressure", -e.lambda}};
        if (task_.set) out.numbers.emplace_back("parameter", row.point.parameter);
        add_columns(out, samples, {{"r", &Sample::r}, {"z", &Sample::z}, {"H", &Sample::H}, {"K", &Sample::K}});
        if (c_.energy.H0_varies()) {
            std::vector<double> H0 = CurveForms(*e.space, c_.energy).H0_at(e.x, parameters);
            if (e.space->images() == 2) H0.insert(H0.end(), H0.rbegin() + 1, H0.rend());
            out.arrays.push_back(array("H0", std::move(H0)));
        }
        for (const ModeRates& mode : modes)
            if (!mode.shape.empty())
                out.arrays.push_back({fmt::format("displacement_{}", mode.m), {mode.shape.size()}, mode.shape});
        return out;
    }

    const Problem& c_;
    const Task task_;
    const SeriesTable<Row> series_;
};

}  // namespace

std::vector<std::string> equilibrium_series_names(const Problem& c) {
    return shape_series(c).names();
}

void check_equilibrium(const Problem& c) {
    task_of(c);
}

CaseShape find_shape(const Problem& c, RunObserver& observer) {
    const RunClock clock(c.time, observer);
    const Task task = task_of(c);
    CaseShape out{find_equilibrium(task.problem, task.start, task.settings), {}, limit_of(task), {}, false};
    if (has_force(c)) out.force = axial_force(task.problem, out.shape);
    out.meets_constraints = meets(task.problem.constraints, out.shape.observed);
    if (out.shape.stop == Stop::finished && c.equilibrium->modes)
        out.modes = mode_stability(task.problem, out.shape, *c.equilibrium->modes, c.law);
    return out;
}

RunSummary run_equilibrium(const Problem& c, RunObserver& observer) {
    const RunClock clock(c.time, observer);
    return clock.pausing([&] {
        CurveShapes shapes(c);
        return run_shapes(c, shapes, clock, observer);
    });
}

}  // namespace tubule::axisym
