// Backward differences of first order.
#include "surface3d/motion/schemes/one_stage.hpp"

namespace tubule::surface3d {
namespace {

class Euler : public OneStageScheme {
public:
    using OneStageScheme::OneStageScheme;

    MotionStep step(const MotionState& from, double tau) override {
        const OneStage stage = euler(from, tau);
        const StageSolution solved = solve(from, nullptr, stage, tau);
        return finish(from, nullptr, stage, solved, end_of(from, solved, stage, tau)).step;
    }
};

}  // namespace

template <>
SchemeType scheme_type<scheme_named("euler")>() {
    return scheme_type_of<Euler>();
}

}  // namespace tubule::surface3d
