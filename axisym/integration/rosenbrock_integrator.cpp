// Rosenbrock's linearly implicit method of order 5 with eight stages: Rodas5P of Steinebach (BIT 63:27, 2023), stiffly
// accurate and L-stable, of full order for parabolic equations too.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "axisym/integration/time_integrator.hpp"
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

// Many fields: the vectors of a step, and what it is to keep.
class RosenbrockIntegrator final : public TimeIntegrator {
public:
    RosenbrockIntegrator(ImplicitSystem s, const Eigen::VectorXd& x0, const Eigen::VectorXd& v0, double t0,
                         const TimeControl& c)
        : system_(std::move(s)),
          control_(c),
          n_(static_cast<int>(x0.size())),
          time_(t0),
          x_(x0),
          v_(v0),
          mass_(*system_.pattern),
          mass_after_(mass_),
          stiffness_(mass_.nonZeros()),
          matrix_(mass_.nonZeros()),
          lu_(*system_.pattern),
          mass_lu_(*system_.pattern),
          begin_(t0),
          x_begin_(x0),
          x_end_(x0) {
        of_x_.setZero(n_, stages), of_v_.setZero(n_, stages), bend_.setZero(n_, 3);
        x_after_ = state_ = rate_ = side_ = residual_ = Eigen::VectorXd::Zero(n_);
        double speed = 0;
        for (int i = 0; i < n_; ++i) speed = std::max(speed, control_.relative * std::abs(v_[i]) / weight(x_[i]));
        next_ = c.first_step > 0 ? c.first_step : speed > 0 ? first_change / speed : 1;
        system_.mass(x_.data(), mass_.valuePtr());
        power_.back() = powers(t0, x_.data(), v_.data());
    }

    Outcome advance(double t_end) override {
        check_pause();
        if (control_.relative < std::numeric_limits<double>::epsilon()) {
            message_ = fmt::format("errors of {:.3g} a step are too much accuracy for this machine", control_.relative);
            return Outcome::failed;
        }
        done_ = done_now_, cut_ = false;
        const double left = t_end - time_;
        for (;;) {
            // Two steps share what is left: none is as short as nothing.
            const bool last = next_ >= left;
            const double h = last ? left : std::min(next_, std::max(left / 2, 0.1 * next_));
            if (!(time_ + h > time_)) {
                message_ = fmt::format("the step became as short as {:.3g} at t = {:.6g}", h, time_);
                return Outcome::failed;
            }
            if (take(h)) {
                accept(h, last ? t_end : time_ + h);
                return ends_at_guard() ? Outcome::guard : last ? Outcome::end : Outcome::step;
            }
        }
    }

    void interpolate(double t, double* at, double* slope) const override {
        const double a = length_ > 0 ? (t - begin_) / length_ : 1, b = 1 - a;
        Eigen::Map<Eigen::VectorXd>(at, n_) = b * x_begin_ + a * x_end_ + (a * b) * bend_.col(0) +
                                              (a * a * b) * bend_.col(1) + (a * a * a * b) * bend_.col(2);
        Eigen::Map<Eigen::VectorXd>(slope, n_) =
            (x_end_ - x_begin_ + (1 - 2 * a) * bend_.col(0) + (a * (2 - 3 * a)) * bend_.col(1) +
             (a * a * (3 - 4 * a)) * bend_.col(2)) /
            (length_ > 0 ? length_ : 1);
    }

    void state_within_step(double t, double* at, double* slope) override {
        if (!(t > begin_) || !step_again(t)) return interpolate(t, at, slope);
        Eigen::Map<Eigen::VectorXd>(at, n_) = x_after_;
        Eigen::Map<Eigen::VectorXd>(slope, n_) = rate_;
    }

    double time() const override { return time_; }
    const double* x() const override { return x_.data(); }
    const double* v() const override { return v_.data(); }
    double dissipated(double t) const override { return done_until(t)[0]; }
    double work(double t) const override { return done_until(t)[1]; }
    double step_size() const override { return time_ - begin_; }
    int order() const override { return 5; }
    int tripped() const override { return guard_; }
    std::string failure() const override { return message_; }
    IntegratorCounters counters() const override { return counters_; }

private:
    using Powers = std::array<double, 2>;  // dissipation and work

    Powers powers(double t, const double* at, const double* slope) const {
        return {system_.dissipation(t, at, slope), system_.work ? system_.work(t, at, slope) : 0};
    }

    double weight(double value) const { return control_.relative * std::abs(value) + control_.absolute; }

    bool evaluate(const Eigen::VectorXd& at, const Eigen::VectorXd& slope) {
        ++counters_.residuals;
        return system_.residual(time_, at.data(), slope.data(), residual_.data());
    }

    // The increments of a step of length h, and the state after it with the rates of the method. False where a stage is
    // inadmissible. Throws SolveError.
    bool find_increments(double h) {
        const double cj = 1 / (h * diagonal);
        for (std::size_t i = 0; i < matrix_.size(); ++i) matrix_[i] = stiffness_[i] + cj * mass_.valuePtr()[i];
        lu_.factor(matrix_.data());
        for (int i = 0; i < stages; ++i) {
            if (i < 6) {
                state_ = x_, rate_ = v_;
                for (int j = 0; j < i; ++j) {
                    state_ += into_state[i][j] * of_x_.col(j);
                    rate_ += into_state[i][j] * of_v_.col(j);
                }
            } else {
                state_ += of_x_.col(i - 1), rate_ += of_v_.col(i - 1);
            }
            if (!evaluate(state_, rate_)) return false;
            side_ = rate_;
            for (int j = 0; j < i; ++j) side_ += (into_side[i][j] / h) * of_x_.col(j);
            of_x_.col(i) = mass_ * side_ - residual_;
            lu_.solve(of_x_.col(i).data());
            of_v_.col(i) = cj * of_x_.col(i) - side_;
        }
        x_after_ = state_ + of_x_.col(stages - 1);
        rate_ += of_v_.col(stages - 1);
        return x_after_.allFinite();
    }

    // Local error of the method of order 4 beside it, relative to what is allowed.
    double error() const {
        double sum = 0;
        for (int i = 0; i < n_; ++i)
            sum += std::pow(of_x_(i, stages - 1) / weight(std::max(std::abs(x_[i]), std::abs(x_after_[i]))), 2);
        return std::sqrt(sum / n_);
    }

    // The rates that solve the system at x_after, and the mass there. Those of the method do so only to the error of
    // the step. False where x_after is inadmissible. Throws SolveError.
    bool find_rates() {
        if (!evaluate(x_after_, rate_)) return false;
        system_.mass(x_after_.data(), mass_after_.valuePtr());
        mass_lu_.factor(mass_after_.valuePtr());
        mass_lu_.solve(residual_.data());
        rate_ -= residual_;
        return true;
    }

    // Whether a step of length h was taken; sets the length that is good next.
    bool take(double h) {
        if (!linearised_) {
            system_.jacobian(time_, x_.data(), v_.data(), 0, stiffness_.data());
            ++counters_.jacobians;
            linearised_ = true;
        }
        bool admissible = false;
        try {
            admissible = find_increments(h);
        } catch (const SolveError&) {  // shorter steps have better matrices
        }
        const double e = admissible ? error() : std::numeric_limits<double>::infinity();
        next_ = h * std::clamp(safety * std::pow(e, -0.2), least_growth, most_growth);
        if (e <= 1 && find_rates()) return true;
        ++(admissible ? counters_.error_failures : counters_.newton_failures);
        if (e <= 1) next_ = h * least_growth;
        return false;
    }

    void accept(double h, double t_after) {
        begin_ = time_, length_ = h;
        x_begin_ = x_, v_begin_ = v_, x_end_ = x_after_;
        for (int k = 0; k < 3; ++k) {
            bend_.col(k).setZero();
            for (int i = 0; i < stages; ++i) bend_.col(k) += into_bend[k][i] * of_x_.col(i);
        }
        x_ = x_after_, v_ = rate_;
        mass_.swap(mass_after_);
        time_ = t_after;
        linearised_ = false;
        ++counters_.steps;
    }

    // A step from the begin of the last one, whose stiffness is still there, to a time within it.
    bool step_again(double t) {
        x_.swap(x_begin_), v_.swap(v_begin_), mass_.swap(mass_after_);
        bool good = false;
        try {
            good = find_increments(t - begin_);
        } catch (const SolveError&) {  // the path is there, too
        }
        x_.swap(x_begin_), v_.swap(v_begin_), mass_.swap(mass_after_);
        if (!good) return false;
        const Eigen::SparseMatrix<double> before = mass_after_;
        good = find_rates();
        mass_after_ = before;
        return good;
    }

    // INT of dissipation and work from the begin of the last step until t, along its path.
    Powers integrals(double t) const {
        Powers sums{};
        Eigen::VectorXd at(n_), slope(n_);
        for (std::size_t q = 0; q < path_points.size(); ++q) {
            const double when = begin_ + path_points[q] * (t - begin_), weight = path_weights[q] * (t - begin_);
            interpolate(when, at.data(), slope.data());
            const Powers here = powers(when, at.data(), slope.data());
            for (int k = 0; k < 2; ++k) sums[k] += weight * here[k];
        }
        return sums;
    }

    // Dissipated and worked until t. Within a whole step the polynomial through the known powers costs nothing.
    Powers done_until(double t) const {
        if (t == time_) return done_now_;
        Powers out = done_;
        if (cut_) {
            const Powers more = integrals(t);
            for (int k = 0; k < 2; ++k) out[k] += more[k];
            return out;
        }
        const double a = (t - begin_) / length_;
        for (std::size_t j = 0; j < nodes.size(); ++j) {
            double weight = 0;
            for (std::size_t q = 0; q < path_points.size(); ++q)
                weight += path_weights[q] * lagrange(j, a * path_points[q]);
            for (int k = 0; k < 2; ++k) out[k] += a * length_ * weight * power_[j][k];
        }
        return out;
    }

    // Whether a guard trips within the last step, which then ends there. Guards and dissipation look at the same
    // states.
    bool ends_at_guard() {
        Eigen::VectorXd at(n_), slope(n_);
        double low = begin_, high = time_;
        guard_ = -1;
        const auto trips = [&](double t, const double* state_at, const double* slope_at) {
            const Guards guards = system_.guards(t, state_at, slope_at);
            const auto found = std::find_if(guards.begin(), guards.end(), [](double g) { return !(g > 0); });
            if (found == guards.end()) return false;
            guard_ = static_cast<int>(found - guards.begin()), high = t;
            return true;
        };
        const auto trips_at = [&](double t) {
            interpolate(t, at.data(), slope.data());
            return trips(t, at.data(), slope.data());
        };
        bool found = false;
        power_.front() = power_.back();
        for (std::size_t q = 0; q < path_points.size() && !found; ++q) {
            const double t = begin_ + path_points[q] * length_;
            found = trips_at(t);
            power_[1 + q] = powers(t, at.data(), slope.data());
        }
        if (!found && !trips(time_, x_.data(), v_.data())) {
            power_.back() = powers(time_, x_.data(), v_.data());
            done_now_ = done_;
            for (std::size_t q = 0; q < path_points.size(); ++q)
                for (int k = 0; k < 2; ++k) done_now_[k] += path_weights[q] * length_ * power_[1 + q][k];
            return false;
        }
        cut_ = true;
        for (int k = 0; k < bisections; ++k)
            if (const double middle = (low + high) / 2; !trips_at(middle)) low = middle;
        if (high < time_) {
            time_ = high;
            interpolate(time_, x_.data(), v_.data());
        }
        const Powers more = integrals(time_);
        done_now_ = {done_[0] + more[0], done_[1] + more[1]};
        power_.back() = powers(time_, x_.data(), v_.data());
        return true;
    }

    ImplicitSystem system_;
    TimeControl control_;
    int n_;
    double time_, next_ = 0;  // next: length of the step
    Eigen::VectorXd x_, v_;
    Eigen::VectorXd x_after_, state_, rate_, side_, residual_;
    Eigen::Matrix<double, Eigen::Dynamic, stages> of_x_, of_v_;  // increments of the stages
    Eigen::SparseMatrix<double> mass_, mass_after_;              // at x, x_after
    std::vector<double> stiffness_, matrix_;
    BandLu lu_, mass_lu_;
    bool linearised_ = false;  // stiffness is that at x, v

    // The last step: its path is a polynomial in (t - begin)/length.
    double begin_, length_ = 0;
    Eigen::VectorXd x_begin_, v_begin_, x_end_;
    Eigen::Matrix<double, Eigen::Dynamic, 3> bend_;

    Powers done_{}, done_now_{};     // INT of them until the begin and the end of the last step
    std::array<Powers, 5> power_{};  // at the begin of the last step, its path's points, its end
    bool cut_ = false;               // the last step ended at a guard
    int guard_ = -1;
    std::string message_;
    IntegratorCounters counters_;
};

}  // namespace

std::unique_ptr<TimeIntegrator> make_rosenbrock(ImplicitSystem system, const Eigen::VectorXd& x0,
                                                const Eigen::VectorXd& v0, double t0, const TimeControl& control) {
    return std::make_unique<RosenbrockIntegrator>(std::move(system), x0, v0, t0, control);
}

}  // namespace tubule::axisym
