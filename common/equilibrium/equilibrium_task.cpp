#include "common/equilibrium/equilibrium_task.hpp"

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>

#include "common/case/read.hpp"
#include "common/geometry/profile_point.hpp"

namespace tubule {

double volume_at(double area, double reduced_volume) {
    return reduced_volume * area * std::sqrt(area) / (6 * std::sqrt(pi));
}

namespace {

// Where the problem has the number; none if it follows from others.
double* number_of(int parameter, StationaryProblem& p) {
    const auto held = [](std::optional<double>& value) { return &(value ? *value : value.emplace(0)); };
    if (parameter >= 0) return &modulus(p.bending, parameter);
    if (parameter <= vary_strength) return &p.bending.potentials[vary_strength - parameter].strength;
    switch (parameter) {
        case vary_H0:
            return &p.bending.H0;
        case vary_kg:
            return &p.bending.kg;
        case vary_alpha:
            return held(p.bending.alpha);
        case vary_M0:
            return &p.bending.M0;
        case vary_area:
            return held(p.constraints.area);
        case vary_volume:
            return held(p.constraints.volume);
        case vary_tension:
            return &p.loads.tension;
        case vary_pressure:
            return &p.loads.pressure;
        case vary_force:
            return &p.loads.force;
        default:
            return nullptr;
    }
}

}  // namespace

SetParameter setter(int parameter) {
    return [parameter](StationaryProblem& p, double value) {
        Constraints& c = p.constraints;
        if (double* number = number_of(parameter, p))
            *number = value;
        else if (parameter == vary_extension)
            p.beads->extension = Ramp(value);
        else if (parameter == vary_height)
            p.rings.back().z = p.rings.front().z + value;
        else if (c.area)
            c.volume = volume_at(*c.area, value);
        else
            c.reduced_volume = value;
    };
}

double parameter_value(int parameter, StationaryProblem p) {
    const Constraints& c = p.constraints;
    if (const double* number = number_of(parameter, p)) return *number;
    if (parameter == vary_extension) return p.beads->extension->at(0);
    if (parameter == vary_height) return p.rings.back().z - p.rings.front().z;
    return c.reduced_volume ? *c.reduced_volume : reduced_volume(*c.area, *c.volume);
}

StationaryProblem stationary_problem(const Problem& c, double area, double volume) {
    const EquilibriumChoices& e = *c.equilibrium;
    StationaryProblem out{.bending = c.energy, .constraints = {}, .loads = loads_at(c.law, 0)};
    out.free_period = c.model.free_period, out.beads = c.law.beads;
    Constraints& held = out.constraints;
    if (holds_area(c.held)) held.area = e.area.value_or(area);
    if (holds_volume(c.held)) held.volume = e.volume.value_or(volume);
    if (c.held == Held::area_and_volume && e.reduced_volume) held.volume = volume_at(*held.area, *e.reduced_volume);
    if (c.held != Held::reduced_volume) return out;
    const double reduced = e.reduced_volume.value_or(reduced_volume(area, volume));
    // Where nothing determines the size the first one stays: Newton's method needs one.
    if (scale_free(out) && e.branch.parameter.value_or(vary_reduced_volume) == vary_reduced_volume)
        held.area = area, held.volume = volume_at(area, reduced);
    else
        held.reduced_volume = reduced;
    return out;
}

std::vector<double> branch_outputs(const Problem& c, const StationaryProblem& problem) {
    const BranchChoices& b = c.equilibrium->branch;
    const double from = parameter_value(*b.parameter, problem), way = *b.to - from;
    if (const std::string wrong = wrong_branch(from, *b.to, *b.step); !wrong.empty())
        throw complaint(c, "equilibrium.branch", wrong);
    const int steps = static_cast<int>(std::ceil(std::abs(way) / *b.step - 1e-9));
    std::vector<double> out;
    for (int i = 0; i < steps; ++i) out.push_back(from + i * std::copysign(*b.step, way));
    out.push_back(*b.to);
    return out;
}

void check_problem(const Problem& c, const StationaryProblem& problem, double period) {
    try {
        check_problem(problem, period);
    } catch (const std::invalid_argument& error) {
        const EquilibriumChoices& e = *c.equilibrium;
        const char* key = e.reduced_volume ? ".reduced_volume" : e.volume ? ".volume" : e.area ? ".area" : "";
        throw CaseError(fmt::format("{}: equilibrium{}: {}", c.path, key, error.what()));
    }
}

}  // namespace tubule
