#include "axisym/integration/rosenbrock_integrator.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "axisym/splines/band_lu.hpp"
#include "common/solve/pause.hpp"
#include "common/solve/sparse.hpp"

namespace tubule::axisym {
namespace {

constexpr int stages = 8;
constexpr double diagonal = 0.21193756319429014;
// Row i: what stage i takes of the increments before it, into its state and into its right-hand side. The last three
// stages end at the new state, each with one increment more.
constexpr double into_state[6][5] = {
    {},
    {3.0},
    {2.849394379747939, 0.45842242204463923},
    {-6.954028509809101, 2.489845061869568, -10.358996098473584},
    {2.8029986275628964, 0.5072464736228206, -0.3988312541770524, -0.04721187230404641},
    {-7.502846399306121, 2.561846144803919, -11.627539656261098, -0.18268767659942256, 0.030198172008377946}};
constexpr double into_side[stages][stages - 1] = {
    {},
    {-14.155112264123755},
    {-17.97296035885952, -2.859693295451294},
    {147.12150275711716, -1.41221402718213, 71.68940251302358},
    {165.43517024871676, -0.4592823456491126, 42.90938336958603, -5.961986721573306},
    {24.854864614690072, -3.0009227002832186, 47.4931110020768, 5.5814197821558125, -0.6610691825249471},
    {30.91273214028599, -3.1208243349937974, 77.79954646070892, 34.28646028294783, -19.097331116725623,
     -28.087943162872662},
    {37.80277123390563, -3.2571969029072276, 112.26918849496327, 66.9347231244047, -40.06618937091002,
     -54.66780262877968, -9.48861652309627}};
constexpr double into_bend[3][stages] = {
    {25.948786856663858, -2.5579724845846235, 10.433815404888879, -2.3679251022685204, 0.524948541321073,
     1.1241088310450404, 0.4272876194431874, -0.17202221070155493},
    {-9.91568850695171, -0.9689944594115154, 3.0438037242978453, -24.495224566215796, 20.176138334709044,
     15.98066361424651, -6.789040303419874, -6.710236069923372},
    {11.419903575922262, 2.8879645146136994, 72.92137995996029, 80.12511834622643, -52.072871366152654,
     -59.78993625266729, -0.15582684282751913, 4.883087185713722}};

constexpr double most_growth = 6, least_growth = 0.2, safety = 0.9;  // of steps
constexpr double first_change = 1e-3;                                // of the state in the first step
constexpr int bisections = 50;                                       // to find where a guard trips

// Where powers are known in a step, and the polynomial that is 1 at one of these places and 0 at the others.
constexpr std::array nodes{0.0, path_points[0], path_points[1], path_points[2], 1.0};
constexpr auto scales = [] {
    std::array<double, nodes.size()> out{};
    for (std::size_t j = 0; j < nodes.size(); ++j) {
        double product = 1;
        for (std::size_t i = 0; i < nodes.size(); ++i)
            if (i != j) product *= nodes[j] - nodes[i];
        out[j] = 1 / product;
    }
    return out;
}();
double lagrange(std::size_t j, double a) {
    double value = scales[j];
    for (std::size_t i = 0; i < nodes.size(); ++i)
        if (i != j) value *= a - nodes[i];
    return value;
}

}  // namespace

// Many fields: the vectors of a step, and what it is to keep.
struct RosenbrockIntegrator::Impl {
    ImplicitSystem system;
    TimeControl control;
    int n;
    double time, next = 0;  // next: length of the step
    Eigen::VectorXd x, v;
    Eigen::VectorXd x_after, state, rate, side, residual;
    Eigen::Matrix<double, Eigen::Dynamic, stages> of_x, of_v;  // increments of the stages
    Eigen::SparseMatrix<double> mass, mass_after;              // at x, x_after
    std::vector<double> stiffness, matrix;
    BandLu lu, mass_lu;
    bool linearised = false;  // stiffness is that at x, v

    // The last step: its path is a polynomial in (t - begin)/length.
    double begin, length = 0;
    Eigen::VectorXd x_begin, v_begin, x_end;
    Eigen::Matrix<double, Eigen::Dynamic, 3> bend;

    using Powers = std::array<double, 2>;  // dissipation and work
    Powers done{}, done_now{};             // INT of them until the begin and the end of the last step
    std::array<Powers, 5> power{};         // at the begin of the last step, its path's points, its end
    bool cut = false;                      // the last step ended at a guard
    int guard = -1;
    std::string message;
    IntegratorCounters counters;

    Impl(ImplicitSystem s, const Eigen::VectorXd& x0, const Eigen::VectorXd& v0, double t0, const TimeControl& c)
        : system(std::move(s)),
          control(c),
          n(static_cast<int>(x0.size())),
          time(t0),
          x(x0),
          v(v0),
          mass(*system.pattern),
          mass_after(mass),
          stiffness(mass.nonZeros()),
          matrix(mass.nonZeros()),
          lu(*system.pattern),
          mass_lu(*system.pattern),
          begin(t0),
          x_begin(x0),
          x_end(x0) {
        of_x.setZero(n, stages), of_v.setZero(n, stages), bend.setZero(n, 3);
        x_after = state = rate = side = residual = Eigen::VectorXd::Zero(n);
        double speed = 0;
        for (int i = 0; i < n; ++i) speed = std::max(speed, control.relative * std::abs(v[i]) / weight(x[i]));
        next = c.first_step > 0 ? c.first_step : speed > 0 ? first_change / speed : 1;
        system.mass(x.data(), mass.valuePtr());
        power.back() = powers(t0, x.data(), v.data());
    }

    Powers powers(double t, const double* at, const double* slope) const {
        return {system.dissipation(t, at, slope), system.work ? system.work(t, at, slope) : 0};
    }

    double weight(double value) const { return control.relative * std::abs(value) + control.absolute; }

    bool evaluate(const Eigen::VectorXd& at, const Eigen::VectorXd& slope) {
        ++counters.residuals;
        return system.residual(time, at.data(), slope.data(), residual.data());
    }

    // The increments of a step of length h, and the state after it with the rates of the method. False where a stage is
    // inadmissible. Throws SolveError.
    bool find_increments(double h) {
        const double cj = 1 / (h * diagonal);
        for (std::size_t i = 0; i < matrix.size(); ++i) matrix[i] = stiffness[i] + cj * mass.valuePtr()[i];
        lu.factor(matrix.data());
        for (int i = 0; i < stages; ++i) {
            if (i < 6) {
                state = x, rate = v;
                for (int j = 0; j < i; ++j) {
                    state += into_state[i][j] * of_x.col(j);
                    rate += into_state[i][j] * of_v.col(j);
                }
            } else {
                state += of_x.col(i - 1), rate += of_v.col(i - 1);
            }
            if (!evaluate(state, rate)) return false;
            side = rate;
            for (int j = 0; j < i; ++j) side += (into_side[i][j] / h) * of_x.col(j);
            of_x.col(i) = mass * side - residual;
            lu.solve(of_x.col(i).data());
            of_v.col(i) = cj * of_x.col(i) - side;
        }
        x_after = state + of_x.col(stages - 1);
        rate += of_v.col(stages - 1);
        return x_after.allFinite();
    }

    // Local error of the method of order 4 beside it, relative to what is allowed.
    double error() const {
        double sum = 0;
        for (int i = 0; i < n; ++i)
            sum += std::pow(of_x(i, stages - 1) / weight(std::max(std::abs(x[i]), std::abs(x_after[i]))), 2);
        return std::sqrt(sum / n);
    }

    // The rates that solve the system at x_after, and the mass there. Those of the method do so only to the error of
    // the step. False where x_after is inadmissible. Throws SolveError.
    bool find_rates() {
        if (!evaluate(x_after, rate)) return false;
        system.mass(x_after.data(), mass_after.valuePtr());
        mass_lu.factor(mass_after.valuePtr());
        mass_lu.solve(residual.data());
        rate -= residual;
        return true;
    }

    // Whether a step of length h was taken; sets the length that is good next.
    bool take(double h) {
        if (!linearised) {
            system.jacobian(time, x.data(), v.data(), 0, stiffness.data());
            ++counters.jacobians;
            linearised = true;
        }
        bool admissible = false;
        try {
            admissible = find_increments(h);
        } catch (const SolveError&) {  // shorter steps have better matrices
        }
        const double e = admissible ? error() : std::numeric_limits<double>::infinity();
        next = h * std::clamp(safety * std::pow(e, -0.2), least_growth, most_growth);
        if (e <= 1 && find_rates()) return true;
        ++(admissible ? counters.error_failures : counters.newton_failures);
        if (e <= 1) next = h * least_growth;
        return false;
    }

    void accept(double h, double t_after) {
        begin = time, length = h;
        x_begin = x, v_begin = v, x_end = x_after;
        for (int k = 0; k < 3; ++k) {
            bend.col(k).setZero();
            for (int i = 0; i < stages; ++i) bend.col(k) += into_bend[k][i] * of_x.col(i);
        }
        x = x_after, v = rate;
        mass.swap(mass_after);
        time = t_after;
        linearised = false;
        ++counters.steps;
    }

    void interpolate(double t, double* at, double* slope) const {
        const double a = length > 0 ? (t - begin) / length : 1, b = 1 - a;
        Eigen::Map<Eigen::VectorXd>(at, n) =
            b * x_begin + a * x_end + (a * b) * bend.col(0) + (a * a * b) * bend.col(1) + (a * a * a * b) * bend.col(2);
        Eigen::Map<Eigen::VectorXd>(slope, n) =
            (x_end - x_begin + (1 - 2 * a) * bend.col(0) + (a * (2 - 3 * a)) * bend.col(1) +
             (a * a * (3 - 4 * a)) * bend.col(2)) /
            (length > 0 ? length : 1);
    }

    // A step from the begin of the last one, whose stiffness is still there, to a time within it.
    bool step_again(double t) {
        x.swap(x_begin), v.swap(v_begin), mass.swap(mass_after);
        bool good = false;
        try {
            good = find_increments(t - begin);
        } catch (const SolveError&) {  // the path is there, too
        }
        x.swap(x_begin), v.swap(v_begin), mass.swap(mass_after);
        if (!good) return false;
        const Eigen::SparseMatrix<double> before = mass_after;
        good = find_rates();
        mass_after = before;
        return good;
    }

    // INT of dissipation and work from the begin of the last step until t, along its path.
    Powers integrals(double t) const {
        Powers sums{};
        Eigen::VectorXd at(n), slope(n);
        for (std::size_t q = 0; q < path_points.size(); ++q) {
            const double when = begin + path_points[q] * (t - begin), weight = path_weights[q] * (t - begin);
            interpolate(when, at.data(), slope.data());
            const Powers here = powers(when, at.data(), slope.data());
            for (int k = 0; k < 2; ++k) sums[k] += weight * here[k];
        }
        return sums;
    }

    // Dissipated and worked until t. Within a whole step the polynomial through the known powers costs nothing.
    Powers done_until(double t) const {
        if (t == time) return done_now;
        Powers out = done;
        if (cut) {
            const Powers more = integrals(t);
            for (int k = 0; k < 2; ++k) out[k] += more[k];
            return out;
        }
        const double a = (t - begin) / length;
        for (std::size_t j = 0; j < nodes.size(); ++j) {
            double weight = 0;
            for (std::size_t q = 0; q < path_points.size(); ++q)
                weight += path_weights[q] * lagrange(j, a * path_points[q]);
            for (int k = 0; k < 2; ++k) out[k] += a * length * weight * power[j][k];
        }
        return out;
    }

    // Whether a guard trips within the last step, which then ends there. Guards and dissipation look at the same
    // states.
    bool ends_at_guard() {
        Eigen::VectorXd at(n), slope(n);
        double low = begin, high = time;
        guard = -1;
        const auto trips = [&](double t, const double* x, const double* v) {
            const Guards guards = system.guards(t, x, v);
            const auto found = std::find_if(guards.begin(), guards.end(), [](double g) { return !(g > 0); });
            if (found == guards.end()) return false;
            guard = static_cast<int>(found - guards.begin()), high = t;
            return true;
        };
        const auto trips_at = [&](double t) {
            interpolate(t, at.data(), slope.data());
            return trips(t, at.data(), slope.data());
        };
        bool found = false;
        power.front() = power.back();
        for (std::size_t q = 0; q < path_points.size() && !found; ++q) {
            const double t = begin + path_points[q] * length;
            found = trips_at(t);
            power[1 + q] = powers(t, at.data(), slope.data());
        }
        if (!found && !trips(time, x.data(), v.data())) {
            power.back() = powers(time, x.data(), v.data());
            done_now = done;
            for (std::size_t q = 0; q < path_points.size(); ++q)
                for (int k = 0; k < 2; ++k) done_now[k] += path_weights[q] * length * power[1 + q][k];
            return false;
        }
        cut = true;
        for (int k = 0; k < bisections; ++k)
            if (const double middle = (low + high) / 2; !trips_at(middle)) low = middle;
        if (high < time) {
            time = high;
            interpolate(time, x.data(), v.data());
        }
        const Powers more = integrals(time);
        done_now = {done[0] + more[0], done[1] + more[1]};
        power.back() = powers(time, x.data(), v.data());
        return true;
    }
};

RosenbrockIntegrator::RosenbrockIntegrator(ImplicitSystem system, const Eigen::VectorXd& x0, const Eigen::VectorXd& v0,
                                           double t0, const TimeControl& control)
    : impl_(std::make_unique<Impl>(std::move(system), x0, v0, t0, control)) {}

RosenbrockIntegrator::~RosenbrockIntegrator() = default;

TimeIntegrator::Outcome RosenbrockIntegrator::advance(double t_end) {
    Impl& s = *impl_;
    check_pause();
    if (s.control.relative < std::numeric_limits<double>::epsilon()) {
        s.message = fmt::format("errors of {:.3g} a step are too much accuracy for this machine", s.control.relative);
        return Outcome::failed;
    }
    s.done = s.done_now, s.cut = false;
    const double left = t_end - s.time;
    for (;;) {
        // Two steps share what is left: none is as short as nothing.
        const bool last = s.next >= left;
        const double h = last ? left : std::min(s.next, std::max(left / 2, 0.1 * s.next));
        if (!(s.time + h > s.time)) {
            s.message = fmt::format("the step became as short as {:.3g} at t = {:.6g}", h, s.time);
            return Outcome::failed;
        }
        if (s.take(h)) {
            s.accept(h, last ? t_end : s.time + h);
            return s.ends_at_guard() ? Outcome::guard : last ? Outcome::end : Outcome::step;
        }
    }
}

double RosenbrockIntegrator::time() const {
    return impl_->time;
}
const double* RosenbrockIntegrator::x() const {
    return impl_->x.data();
}
const double* RosenbrockIntegrator::v() const {
    return impl_->v.data();
}

void RosenbrockIntegrator::interpolate(double t, double* x, double* v) const {
    impl_->interpolate(t, x, v);
}

void RosenbrockIntegrator::state_within_step(double t, double* x, double* v) {
    Impl& s = *impl_;
    if (!(t > s.begin) || !s.step_again(t)) return s.interpolate(t, x, v);
    Eigen::Map<Eigen::VectorXd>(x, s.n) = s.x_after;
    Eigen::Map<Eigen::VectorXd>(v, s.n) = s.rate;
}

double RosenbrockIntegrator::dissipated(double t) const {
    return impl_->done_until(t)[0];
}

double RosenbrockIntegrator::work(double t) const {
    return impl_->done_until(t)[1];
}

double RosenbrockIntegrator::step_size() const {
    return impl_->time - impl_->begin;
}
int RosenbrockIntegrator::order() const {
    return 5;
}
int RosenbrockIntegrator::tripped() const {
    return impl_->guard;
}
std::string RosenbrockIntegrator::failure() const {
    return impl_->message;
}
IntegratorCounters RosenbrockIntegrator::counters() const {
    return impl_->counters;
}

}  // namespace tubule::axisym
