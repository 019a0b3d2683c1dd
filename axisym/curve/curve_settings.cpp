#include "axisym/curve/curve_settings.hpp"

#include <algorithm>
#include <cmath>

namespace tubule::axisym {
namespace {

// Measured choices: docs/decisions/curves.md, "Curves in motion".
constexpr double finer_mesh = 1.5;  // elements of a pair of runs
// From pair to pair; the least is enough for a pair to see what its mesh costs.
constexpr double least_growth = 1.4, most_growth = 2.5;
constexpr double finer_time = 0.1;  // tolerances of a pair of runs
// Time tolerances of the first run over the accuracy; the waves of a fluid, weakly damped, cost steps.
constexpr double tolerance_per_accuracy = 0.5, tolerance_of_waves = 3;
constexpr int most_pairs = 8, most_elements = 2000;
// First step and growth of steps of a coarser run. Errors of backward Euler steps that grow by g are in proportion to
// (g - 1)/(g + 1): 0.33 for g = 2, the growth of the finer run, and 0.78 for 8.
constexpr double coarser_start = 4, coarser_growth = 8;

}  // namespace

CurveSettings first_settings(const Problem& c, int images) {
    const bool waves = c.law.inertia != 0;
    const double tolerance = (waves ? tolerance_of_waves : tolerance_per_accuracy) * c.accuracy.energy;
    CurveSettings s = finer({first_curve_elements, tolerance, 0}, finer_mesh);
    if (c.discretisation.elements) s.elements = (*c.discretisation.elements + images - 1) / images;
    if (c.discretisation.time_tolerance) s.tolerance = *c.discretisation.time_tolerance;
    return s;
}

double first_step_factor(const CurveSettings& s) {
    return s.is_coarser ? coarser_start : 1;
}

double step_growth_of(const CurveSettings& s) {
    return s.is_coarser ? coarser_growth : 2;
}

CurveSettings coarser(const CurveSettings& s) {
    CurveSettings out = s;
    out.elements = std::max(2, static_cast<int>(std::floor(s.elements / finer_mesh)));
    out.tolerance /= finer_time;
    out.is_coarser = true;
    return out;
}

// The error of the mesh falls at least with the sixth power of its width, unless the shape is not smooth.
double mesh_growth(double excess) {
    return std::clamp(finer_mesh * std::pow(excess, 1.0 / 6), finer_mesh, most_growth);
}

double mesh_growth(double excess_of_mesh, bool error_falls) {
    return std::clamp(least_growth * std::pow(excess_of_mesh, 1.0 / 6), error_falls ? least_growth : finer_mesh,
                      most_growth);
}

CurveSettings finer(const CurveSettings& s, double mesh) {
    CurveSettings out = s;
    out.elements = static_cast<int>(std::ceil(mesh * s.elements));
    out.tolerance = std::max(finer_time * s.tolerance, 1e-13);
    ++out.pair;
    return out;
}

bool can_be_finer(const CurveSettings& s) {
    return s.pair < most_pairs && s.elements <= most_elements;
}

}  // namespace tubule::axisym
