// Backward differences of second order, with steps that vary.
#include "surface3d/motion/schemes/one_stage.hpp"

namespace tubule::surface3d {
namespace {

struct Bdf2Memory : ListedMemory<Bdf2Memory> {
    PastState past;

    template <class Fields, class Own>
    static void fields(Fields& f, Own& own, const MotionState& state) {
        PastState::fields(f, own.past, state);
    }
};

OneStage bdf2(const MotionState& from, const PastState& past, double tau) {
    const double r = tau / from.step, te = (1 + r) * tau / (1 + 2 * r);
    const auto bar = [&](const auto& now, const auto& before) {
        return ((1 + r) * now - r * r / (1 + r) * before) * (te / tau);
    };
    return {1,
            te,
            bar(from.X, past.X),
            bar(from.period, past.period),
            bar(from.u, past.u),
            -(1 + r) * (1 + r) / (6 * r * (1 + 2 * r))};
}

class Bdf2 : public OneStageScheme {
public:
    using OneStageScheme::OneStageScheme;

    MotionStep step(const MotionState& from, double tau) override {
        const auto* memory = memory_of<Bdf2Memory>(from);
        const PastState* past = memory ? &memory->past : nullptr;
        const OneStage stage = past ? bdf2(from, *past, tau) : euler(from, tau);
        const StageSolution solved = solve(from, past, stage, tau);
        MotionStep out = finish(from, past, stage, solved, end_of(from, solved, stage, tau)).step;
        auto next = std::make_shared<Bdf2Memory>();
        next->past = PastState(from);
        out.state.memory = std::move(next);
        return out;
    }
};

}  // namespace

template <>
SchemeType scheme_type<scheme_named("bdf2")>() {
    return scheme_type_of<Bdf2, Bdf2Memory>();
}

}  // namespace tubule::surface3d
