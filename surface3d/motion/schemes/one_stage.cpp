#include "surface3d/motion/schemes/one_stage.hpp"

#include <cmath>

namespace tubule::surface3d {
namespace {

// Of the positions along the normal, largest. From a past, by Adams-Bashforth of second order for comparison; the
// constants of both errors are known (Milne).
double estimated_error(const MotionState& from, const PastState* past, const OneStage& stage, const VectorField& normal,
                       const MotionState& to) {
    const double tau = to.step;
    if (!past) {
        const Eigen::RowVectorXd along = (to.X - from.X - tau * from.w).cwiseProduct(normal).colwise().sum();
        return along.cwiseAbs().maxCoeff() / 2;
    }
    const double r = tau / from.step, theirs = (2 * r + 3) / (12 * r);
    const VectorField explicitly = from.X + tau * ((1 + r / 2) * from.w - r / 2 * past->w);
    const Eigen::RowVectorXd along = (to.X - explicitly).cwiseProduct(normal).colwise().sum();
    return std::abs(stage.error / (theirs - stage.error)) * along.cwiseAbs().maxCoeff();
}

}  // namespace

StageSolution OneStageScheme::solve(const MotionState& from, const PastState* past, const OneStage& stage, double tau,
                                    const Extent& missed) {
    const double r = past ? tau / from.step : 0;
    const auto ahead = [&](double level, const auto& now, auto PastState::*before) {
        return past ? ((1 + level * r) * now - level * r * past->*before).eval() : now;
    };
    const Stage expected{from.time + stage.level * tau,
                         stage.te,
                         stage.Xbar,
                         stage.ubar,
                         ahead(stage.level, from.X, &PastState::X),
                         ahead(stage.level, from.w, &PastState::w),
                         ahead(stage.level, from.u, &PastState::u),
                         from.tension,
                         surface().control().relaxation + stage.te};
    const VectorField begin = from.X + (stage.Xbar - from.X) / stage.level, end = ahead(1, from.X, &PastState::X);
    MovingSurface& s = surface();
    return solver_.solve(expected, s.rate_to_keep(s.mesh(expected.X), begin, end, stage.te / stage.level, missed));
}

MotionState OneStageScheme::end_of(const MotionState& from, const StageSolution& solved, const OneStage& stage,
                                   double tau) {
    MotionState to{.time = from.time + tau,
                   .step = tau,
                   .X = solved.X,
                   .w = solved.w,
                   .u = solved.u,
                   .p = solved.p,
                   .lambda = solved.lambda,
                   .tension = solved.tension,
                   .memory = {}};
    if (stage.level == 1) return to;
    to.X = from.X + (to.X - from.X) / stage.level;
    to.w = from.w + (to.w - from.w) / stage.level;
    to.u = from.u + (to.u - from.u) / stage.level;
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
