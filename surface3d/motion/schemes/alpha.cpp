// The generalised alpha method, which hardly damps waves that its steps resolve.
#include <cmath>

#include "surface3d/motion/schemes/alpha_numbers.hpp"
#include "surface3d/motion/schemes/one_stage.hpp"

namespace tubule::surface3d {
namespace {

constexpr double fastest_waves = 0.9;    // the factor by which a short step damps them
constexpr double miss_relaxation = 0.5;  // of the expected defect of area and volume in a step, towards the last one

// Pressure and the multiplier of the volume at the time where a step was solved.
struct Multipliers {
    double time = 0;
    Eigen::VectorXd p;
    double lambda = 0, tension = 0, force = 0;
};

struct AlphaMemory : ListedMemory<AlphaMemory> {
    PastState past;
    VectorField X_rate;  // the rates that are carried on
    Eigen::VectorXd u_rate;
    double period_rate = 0;
    double lag = 0;  // by how much their time precedes that of the state
    Multipliers solved;
    Extent missed;  // expected defect of area and volume after the linear system of a step

    template <class Fields, class Own>
    static void fields(Fields& f, Own& own, const MotionState& state) {
        PastState::fields(f, own.past, state);
        f.array("restart_X_rate", own.X_rate, state.X.cols());
        f.array("restart_u_rate", own.u_rate, state.u.size());
        f.number("restart_period_rate", own.period_rate);
        f.number("restart_lag", own.lag);
        f.number("restart_solved_time", own.solved.time);
        f.optional_array("restart_solved_p", own.solved.p, state.p.size());
        f.number("restart_solved_lambda", own.solved.lambda);
        f.number("restart_solved_tension", own.solved.tension);
        f.optional_number("restart_solved_force", own.solved.force);
        f.number("restart_missed_area", own.missed.area);
        f.number("restart_missed_volume", own.missed.volume);
    }
};

class Alpha : public OneStageScheme {
public:
    using OneStageScheme::OneStageScheme;

    MotionStep step(const MotionState& from, double tau) override {
        const auto* memory = memory_of<AlphaMemory>(from);
        return memory ? next_step(from, *memory, tau) : first_step(from, tau);
    }

private:
    MotionStep first_step(const MotionState& from, double tau) {
        const OneStage stage = euler(from, tau);
        const StageSolution solved = solve(from, nullptr, stage, tau);
        auto next = std::make_shared<AlphaMemory>();
        next->past = PastState(from);
        next->X_rate = (solved.X - stage.Xbar) / stage.te;
        next->u_rate = (solved.u - stage.ubar) / stage.te;
        next->period_rate = (solved.period - stage.period_bar) / stage.te;
        next->solved = {from.time + tau, solved.p, solved.lambda, solved.tension, solved.force};
        MotionStep out = finish(from, nullptr, stage, solved, end_of(from, solved, stage, tau)).step;
        out.state.memory = std::move(next);
        return out;
    }

    MotionStep next_step(const MotionState& from, const AlphaMemory& memory, double tau) {
        const AlphaNumbers a = alpha_numbers(tau, memory.lag, wave_factor(from, tau));
        const OneStage stage{a.level,
                             a.te,
                             from.X + a.kept * memory.X_rate,
                             from.period + a.kept * memory.period_rate,
                             from.u + a.kept * memory.u_rate,
                             a.error};
        const double again = std::pow(tau / from.step, 3);  // the defect of a step is of third order
        const Extent missed{again * memory.missed.area, again * memory.missed.volume};
        const StageSolution solved = solve(from, &memory.past, stage, tau, missed);

        auto next = std::make_shared<AlphaMemory>();
        next->past = PastState(from);
        const auto renewed = [&](const auto& old, const auto& end, const auto& bar) {
            return (old + a.renewing * ((end - bar) / stage.te - old));
        };
        next->X_rate = renewed(memory.X_rate, solved.X, stage.Xbar);
        next->u_rate = renewed(memory.u_rate, solved.u, stage.ubar);
        next->period_rate = renewed(memory.period_rate, solved.period, stage.period_bar);
        next->lag = a.lag;
        next->solved = {from.time + stage.level * tau, solved.p, solved.lambda, solved.tension, solved.force};
        MotionState to = end_of(from, solved, stage, tau);
        if (stage.level < 1) {  // from there to the end, linearly
            const double ahead = (to.time - next->solved.time) / (next->solved.time - memory.solved.time);
            to.lambda += ahead * (to.lambda - memory.solved.lambda);
            to.tension += ahead * (to.tension - memory.solved.tension);
            to.force += ahead * (to.force - memory.solved.force);
            if (to.p.size() > 0) to.p += ahead * (to.p - memory.solved.p);
        }
        Finished done = finish(from, &memory.past, stage, solved, std::move(to));
        next->missed = {missed.area + miss_relaxation * done.lacking.area,
                        missed.volume + miss_relaxation * done.lacking.volume};
        done.step.state.memory = std::move(next);
        return std::move(done.step);
    }

    // A bending wave, with only the tangential flow that inextensibility requires, is damped by 2 viscosity
    // k^2/inertia, k the curvature across it, and by half of the friction. A step may damp the fastest waves by this
    // much in addition: long steps, which do not resolve them, need it.
    double wave_factor(const MotionState& from, double tau) {
        const SurfaceLaw& law = surface().law();
        if (law.inertia == 0) return 0;
        const CurvedMesh m = surface().mesh(from);
        const Extent e = extent(surface().space(), m);
        const double curvature = e.area / ((m.period > 0 ? 2 : 3) * e.volume);
        const double rate = (2 * law.viscosity * curvature * curvature + law.friction / 2) / law.inertia;
        return fastest_waves * std::exp(-rate * tau);
    }
};

}  // namespace

template <>
SchemeType scheme_type<scheme_named("alpha")>() {
    return scheme_type_of<Alpha, AlphaMemory>();
}

}  // namespace tubule::surface3d
