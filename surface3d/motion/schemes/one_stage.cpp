#include "surface3d/motion/schemes/one_stage.hpp"

#include <algorithm>
#include <cmath>

namespace tubule::surface3d {
namespace {

// Largest error of the positions along the normal. With a past, from the difference to Adams-Bashforth of second order,
// since the constants of both errors are known (Milne).
double estimated_error(const MotionState& from, const PastState* past, const OneStage& stage, const VectorField& normal,
                       const MotionState& to) {
    const double tau = to.step;
    if (!past) {
        const VectorField rate = from.w + stretched(from.X, from.stretch);
        const Eigen::RowVectorXd along = (to.X - from.X - tau * rate).cwiseProduct(normal).colwise().sum();
        const double longer = to.period - (1 + tau * from.stretch) * from.period;
        return std::max(along.cwiseAbs().maxCoeff(), std::abs(longer)) / 2;
    }
    const double r = tau / from.step, theirs = (2 * r + 3) / (12 * r);
    const auto ahead = [&](const auto& now, const auto& before) { return tau * ((1 + r / 2) * now - r / 2 * before); };
    const VectorField explicitly =
        from.X + ahead(from.w + stretched(from.X, from.stretch), past->w + stretched(past->X, past->stretch));
    const Eigen::RowVectorXd along = (to.X - explicitly).cwiseProduct(normal).colwise().sum();
    const double longer = to.period - from.period - ahead(from.stretch * from.period, past->stretch * past->period);
    return std::abs(stage.error / (theirs - stage.error)) * std::max(along.cwiseAbs().maxCoeff(), std::abs(longer));
}

}  // namespace

StageSolution OneStageScheme::solve(const MotionState& from, const PastState* past, const OneStage& stage, double tau,
                                    const Extent& missed) {
    // Without a past: with inertia the nodes have moved as they do now, so that a surface that drifts keeps its
    // velocity; without it the first motion of the nodes may be one that fades within a step.
    const bool drifts = !past && surface().law().inertia != 0;
    const double r = past ? tau / from.step : drifts ? 1 : 0;
    const auto ahead = [&](double level, const auto& now, const auto& before) {
        using Value = std::decay_t<decltype(now)>;
        return r != 0 ? Value((1 + level * r) * now - level * r * before) : now;
    };
    PastState before = past ? *past : PastState(from);
    if (drifts) before.X -= tau * from.w;
    const Stage expected{from.time + stage.level * tau,
                         stage.te,
                         stage.Xbar,
                         stage.period_bar,
                         stage.ubar,
                         ahead(stage.level, from.X, before.X),
                         ahead(stage.level, from.w, before.w),
                         ahead(stage.level, from.period, before.period),
                         ahead(stage.level, from.stretch, before.stretch),
                         ahead(stage.level, from.u, before.u),
                         from.tension,
                         from.force,
                         surface().control().relaxation + stage.te};
    MovingSurface& s = surface();
    const CurvedMesh begin = s.mesh(from.X + (stage.Xbar - from.X) / stage.level,
                                    from.period + (stage.period_bar - from.period) / stage.level);
    const CurvedMesh end = s.mesh(ahead(1, from.X, before.X), ahead(1, from.period, before.period));
    return solver_.solve(expected, s.rate_to_keep(s.mesh(expected.X, expected.period), begin, end, from.time + tau,
                                                  stage.te / stage.level, missed));
}

MotionState OneStageScheme::end_of(const MotionState& from, const StageSolution& solved, const OneStage& stage,
                                   double tau) {
    MotionState to = solved.state(from.time + tau, tau);
    if (stage.level == 1) return to;
    to.X = from.X + (to.X - from.X) / stage.level;
    to.w = from.w + (to.w - from.w) / stage.level;
    to.u = from.u + (to.u - from.u) / stage.level;
    to.period = from.period + (to.period - from.period) / stage.level;
    to.stretch = from.stretch + (to.stretch - from.stretch) / stage.level;
    return to;
}

OneStageScheme::Finished OneStageScheme::finish(const MotionState& from, const PastState* past, const OneStage& stage,
                                                const StageSolution& solved, MotionState to) {
    const Eigen::VectorXd momenta = surface().momenta_after(from, to);
    surface().keep_momenta(momenta, stage.te / stage.level, to);
    const double error = estimated_error(from, past, stage, solved.fields.normal, to);
    const KeptExtent kept = solver_.keep_extent(solved, to);
    surface().keep_momenta(momenta, 0, to);  // on the surface as it is now
    return {{.state = std::move(to), .error = error, .correction = kept.energy}, kept.lacking};
}

}  // namespace tubule::surface3d
