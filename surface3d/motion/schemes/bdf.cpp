// Backward differences of order 1 to 4 with steps that vary, the order chosen from step to step: theory.md (10.16),
// (10.17). For models without inertia, whose motions decay.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "surface3d/motion/schemes/time_scheme.hpp"
#include "surface3d/motion/step_solver.hpp"

namespace tubule::surface3d {
namespace {

constexpr int most_order = 4, least_order = 2;  // after the first step
// A relaxation of the mesh that depended on te would make paths of nodes kink where steps are uneven.
constexpr double least_relaxation = 4;  // of te
constexpr int most_extrapolated = 3;    // states: through four, waves of the mesh grow

// The states before the one that remembers them, the latest first. Empty where there were none.
struct BdfMemory : ListedMemory<BdfMemory> {
    int order = 0;  // of the next step,
    int made = 0;   // and how many steps had it up to now
    std::array<double, most_order> times{};
    std::array<VectorField, most_order> X;
    std::array<double, most_order> periods{};
    std::array<double, most_extrapolated - 1> stretches{};
    std::array<VectorField, most_extrapolated - 1> w;
    std::array<Eigen::VectorXd, most_extrapolated - 1> u;

    bool knows(std::size_t i) const {
        if (i >= X.size() || X[i].cols() == 0) return false;
        return i >= w.size() || (w[i].cols() > 0 && u[i].size() > 0);
    }

    template <class Fields, class Own>
    static void fields(Fields& f, Own& own, const MotionState& state) {
        const auto name = [](const char* what, std::size_t i) {
            return fmt::format("restart_{}_past_{}", what, i + 1);
        };
        f.number("restart_order", own.order), f.number("restart_order_made", own.made);
        for (std::size_t i = 0; i < own.X.size(); ++i) {
            f.number(name("time", i), own.times[i]);
            f.optional_array(name("X", i), own.X[i], state.X.cols());
            f.number(name("period", i), own.periods[i]);
        }
        for (std::size_t i = 0; i < own.w.size(); ++i) {
            f.optional_array(name("w", i), own.w[i], state.X.cols());
            f.optional_array(name("u", i), own.u[i], state.u.size());
            f.number(name("stretch", i), own.stretches[i]);
        }
    }
};

// What a step to some time can use: the state it begins from and those before it, the latest first. ago: how long
// before the end of the step they were.
struct Past {
    std::vector<double> ago;
    std::vector<const VectorField*> X, w;
    std::vector<const Eigen::VectorXd*> u;
    std::vector<const double*> period, stretch;

    Past(const MotionState& from, const BdfMemory* memory, double tau)
        : ago{tau}, X{&from.X}, w{&from.w}, u{&from.u}, period{&from.period}, stretch{&from.stretch} {
        for (std::size_t i = 0; memory && memory->knows(i); ++i) {
            ago.push_back(from.time + tau - memory->times[i]);
            X.push_back(&memory->X[i]);
            period.push_back(&memory->periods[i]);
            if (i >= memory->w.size()) continue;
            w.push_back(&memory->w[i]);
            u.push_back(&memory->u[i]);
            stretch.push_back(&memory->stretches[i]);
        }
    }
    int points() const { return static_cast<int>(ago.size()); }

    // Weight of state j in the polynomial through the first n states, evaluated at the end of the step.
    double weight(int j, int n) const {
        double out = 1;
        for (int i = 0; i < n; ++i)
            if (i != j) out *= ago[i] / (ago[i] - ago[j]);
        return out;
    }
    template <class Values>
    Values ahead(const std::vector<const Values*>& values, int n) const {
        Values out = weight(0, n) * *values[0];
        for (int j = 1; j < n; ++j) out += weight(j, n) * *values[j];
        return out;
    }
    // X = Xbar + te X_t at the end of the polynomial through X and the first k states.
    double te(int k) const {
        double rate = 0;
        for (int j = 0; j < k; ++j) rate += 1 / ago[j];
        return 1 / rate;
    }
    template <class Values>
    Values bar(const std::vector<const Values*>& values, int k) const {
        Values out = te(k) / ago[0] * weight(0, k) * *values[0];
        for (int j = 1; j < k; ++j) out += te(k) / ago[j] * weight(j, k) * *values[j];
        return out;
    }
    // Velocity of the nodes in state j.
    VectorField rate(int j) const { return *w[j] + stretched(*X[j], *stretch[j]); }
};

double largest_along(const VectorField& normal, const VectorField& change) {
    return change.cwiseProduct(normal).colwise().sum().cwiseAbs().maxCoeff<Eigen::PropagateNaN>();
}

class Bdf : public TimeScheme {
public:
    Bdf(const CurvedMesh& mesh, const SurfaceLaw& law, const Bending& bending, const MotionControl& control)
        : TimeScheme(mesh, law, bending, control), solver_(surface()) {
        if (law.inertia != 0)
            throw std::invalid_argument("scheme bdf is for models without inertia: bending waves grow in its steps");
    }

    MotionStep step(const MotionState& from, double tau) override {
        const auto* memory = memory_of<BdfMemory>(from);
        const Past past(from, memory, tau);
        const int order = memory ? std::clamp(memory->order, 1, std::min(most_order, past.points())) : 1;
        const StageSolution solved = solve(from, past, order, tau);
        MotionStep out{.state = solved.state(from.time + tau, tau), .order = order};
        const std::vector<double> misses = missed_by(past, solved);
        out.error = error(past, misses, order, solved);
        out.correction = solver_.keep_extent(solved, out.state).energy;
        out.state.memory = remember(from, memory, next_order(misses, order, memory ? memory->made + 1 : 1));
        return out;
    }

private:
    // Solves order 4 twice, the second time on the surface that the first has found: the extrapolated surface, on which
    // the first is solved, is of order 3.
    StageSolution solve(const MotionState& from, const Past& past, int order, double tau) {
        const int through = std::clamp(order, 1, most_extrapolated);
        Stage stage{from.time + tau,
                    past.te(order),
                    past.bar(past.X, order),
                    past.bar(past.period, order),
                    *past.u[0],
                    past.ahead(past.X, through),
                    past.ahead(past.w, through),
                    past.ahead(past.period, through),
                    past.ahead(past.stretch, through),
                    past.ahead(past.u, through),
                    from.tension,
                    from.force,
                    std::max(surface().control().relaxation, least_relaxation * past.te(order))};
        MovingSurface& s = surface();
        const auto rate = [&] {
            const CurvedMesh at = s.mesh(stage.X, stage.period);
            return s.rate_to_keep(at, s.mesh(stage.Xbar, stage.period_bar), at, stage.time, stage.te, {});
        };
        StageSolution out = solver_.solve(stage, rate());
        if (order <= most_extrapolated) return out;
        stage.X = out.X, stage.w = out.w, stage.u = out.u;
        stage.period = out.period, stage.stretch = out.stretch, stage.force = out.force;
        return solver_.solve(stage, rate());
    }

    // By how much the polynomial through the first n + 1 states misses the end of the step along the normal, largest.
    // [0], where there is no state before: by how much the velocity does.
    std::vector<double> missed_by(const Past& past, const StageSolution& solved) const {
        const VectorField& normal = solved.fields.normal;
        const double longer = solved.period - *past.period[0] * (1 + past.ago[0] * *past.stretch[0]);
        std::vector<double> out{
            std::max(largest_along(normal, solved.X - *past.X[0] - past.ago[0] * past.rate(0)), std::abs(longer))};
        for (int n = 1; n < past.points(); ++n)
            out.push_back(std::max(largest_along(normal, solved.X - past.ahead(past.X, n + 1)),
                                   std::abs(solved.period - past.ahead(past.period, n + 1))));
        return out;
    }

    // Milne: the constants of the errors of the method and of the polynomial are known.
    double error(const Past& past, const std::vector<double>& misses, int order, const StageSolution& solved) const {
        if (past.points() == 1) return misses[0] / 2;
        if (past.points() > order) return misses[order] / (1 + past.ago[order] / past.te(order));
        // The second step: the parabola through two states with the velocity of the first of them.
        const double span = past.ago[1] - past.ago[0], te = past.te(order);
        const VectorField bend = ((*past.X[0] - *past.X[1]) / span - past.rate(1)) / span;
        const VectorField end = past.ahead(past.X, 2) + past.ago[0] * past.ago[1] * bend;
        return largest_along(solved.fields.normal, solved.X - end) / (1 + past.ago[1] / te);
    }

    struct Order {
        int next, made;
    };
    // Higher where differences fall with their order, lower where they do not; but only after enough steps of an
    // order, since the first ones of an order still show the change.
    static Order next_order(const std::vector<double>& misses, int order, int made) {
        const auto known = static_cast<int>(misses.size());
        if (order < least_order) return {least_order, 0};
        if (order >= known) return {order, made};
        if (order > least_order && misses[order - 1] <= misses[order]) return {order - 1, 0};
        const bool higher = order < most_order && order + 1 < known && made > order;
        if (higher && misses[order + 1] < misses[order]) return {order + 1, 0};
        return {order, made};
    }

    static std::shared_ptr<const BdfMemory> remember(const MotionState& from, const BdfMemory* memory, Order order) {
        auto next = std::make_shared<BdfMemory>();
        next->order = order.next, next->made = order.made;
        next->times[0] = from.time;
        next->X[0] = from.X, next->w[0] = from.w, next->u[0] = from.u;
        next->periods[0] = from.period, next->stretches[0] = from.stretch;
        if (!memory) return next;
        std::copy_n(memory->times.begin(), most_order - 1, next->times.begin() + 1);
        std::copy_n(memory->X.begin(), most_order - 1, next->X.begin() + 1);
        std::copy_n(memory->periods.begin(), most_order - 1, next->periods.begin() + 1);
        std::copy_n(memory->stretches.begin(), most_extrapolated - 2, next->stretches.begin() + 1);
        std::copy_n(memory->w.begin(), most_extrapolated - 2, next->w.begin() + 1);
        std::copy_n(memory->u.begin(), most_extrapolated - 2, next->u.begin() + 1);
        return next;
    }

    StepSolver solver_;
};

}  // namespace

template <>
SchemeType scheme_type<scheme_named("bdf")>() {
    return scheme_type_of<Bdf, BdfMemory>();
}

}  // namespace tubule::surface3d
