#include "axisym/curve/curve_snapshot.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "axisym/curve/curve_measures.hpp"
#include "common/geometry/profile_point.hpp"

namespace tubule::axisym {
namespace {

// Newton's method for r' = 0 between these parameters, from a point nearby, as long as radii decrease.
CurveSample minimum_near(const CurveSpace& space, const Eigen::VectorXd& x, double s, double low, double high) {
    CurveSample best = space.evaluate(x, s);
    for (int i = 0; i < 4 && best.r2 > 0; ++i) {
        s = std::clamp(s - best.r1 / best.r2, low, high);
        const CurveSample next = space.evaluate(x, s);
        if (!(next.r < best.r)) break;
        best = next;
    }
    return best;
}

// The narrowest place other than a pole: a minimum of r, found between the ends of elements and their midpoints. Radius
// infinity if there is none.
Neck narrowest(const CurveSpace& space, const double* y) {
    const std::vector<double>& breaks = space.splines().breaks();
    const Eigen::VectorXd x = Eigen::Map<const Eigen::VectorXd>(y, space.size());
    std::vector<double> s_at, r;
    for (std::size_t i = 0; i < 2 * breaks.size() - 1; ++i) {
        const double s = i % 2 ? (breaks[i / 2] + breaks[i / 2 + 1]) / 2 : breaks[i / 2];
        s_at.push_back(s), r.push_back(space.evaluate(x, s).r);
    }
    const int n = static_cast<int>(r.size());
    const bool whole = space.ends_at_pole() || space.topology() == Topology::strip;
    int lowest = -1;
    for (int i = space.closed() || space.is_patch() ? 1 : 0; i < n; ++i) {  // neither poles nor rings
        if (whole && i == n - 1) continue;
        const double before = i > 0 ? r[i - 1] : r[1], after = i + 1 < n ? r[i + 1] : r[n - 2];
        if (r[i] <= before && r[i] <= after && (lowest < 0 || r[i] < r[lowest])) lowest = i;
    }
    if (lowest < 0) return {0, std::numeric_limits<double>::infinity()};
    const CurveSample p =
        minimum_near(space, x, s_at[lowest], s_at[std::max(lowest - 1, 0)], s_at[std::min(lowest + 1, n - 1)]);
    return {p.z, p.r};
}

}  // namespace

Snapshot measure(const CurveMotion& motion, double t, const double* y, const double* rate) {
    const CurveSpace& space = motion.space();
    const Eigen::VectorXd x = Eigen::Map<const Eigen::VectorXd>(y, space.size());
    Snapshot out{motion.forms().observe(x), motion.balance(t, y, rate), narrowest(space, y)};
    out.o.r_max = measures(space, x).r_max;
    out.length = motion.length(y);
    out.coarse_bead = motion.bead_coarseness(y);
    out.free_energy = out.o.energy + loads_at(motion.law(), t).energy(out.o.area, out.o.volume, out.length);
    if (const auto source = motion.source_domain(t, y); source.value < out.o.domain.value) out.o.domain = source;
    out.pressure_domain = pressure_domain(motion.law(), out.o.volume);
    return out;
}

double mode_amplitude(const CurveSpace& space, const double* y, int n) {
    const Eigen::VectorXd x = Eigen::Map<const Eigen::VectorXd>(y, space.size());
    const SplineSpace& splines = space.splines();
    double re = 0, im = 0;
    for (int e = 0; e < splines.elements(); ++e)
        for (int g = 0; g < splines.groups(); ++g)
            for (int q = 0; q < SplineSpace::lanes; ++q) {
                const auto& basis = splines.basis(e, g);
                const CurveSample p = space.evaluate(x, basis.z[q]);
                const double angle = 2 * pi * n * p.z / space.length(y), part = basis.weight[q] * p.r * p.z1;
                re += part * std::cos(angle), im += part * std::sin(angle);
            }
    const bool whole = space.images() == 1;
    return 2 / space.length(y) * (whole ? std::hypot(re, im) : 2 * std::abs(re));
}

}  // namespace tubule::axisym
