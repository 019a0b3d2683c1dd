// A profile's motion F(t, x, x_t) = 0 in time: what every method of integration is given and gives.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <array>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace tubule {
struct RunSummary;
}

namespace tubule::axisym {

struct TimeControl {
    double relative = 1e-6;  // local error per step relative to the coefficients
    double absolute = 1e-9;  // added to that, times the unknown's scale
    int max_order = 5;       // of the backward differences
    double first_step = 0;   // 0: chosen by IDA
    double growth = 2;       // largest ratio of a step to the one before; at least 2
    double newton = 0.01;    // tolerance of the iteration, relative to that of the error test
    // At least two iterations. IDA accepts one where earlier ones converged quickly; then constraints hold only to
    // the error of the step, because they are nonlinear.
    bool two_iterations = false;
    // Convergence is judged from the second correction where it is the larger: unknowns outside the error norm may
    // push the others only then.
    bool second_may_grow = false;
};

struct IntegratorCounters {
    long steps = 0, residuals = 0, jacobians = 0, newton_iterations = 0, error_failures = 0, newton_failures = 0;
    IntegratorCounters& operator+=(const IntegratorCounters& o);
    // Sets `effort` and `details` of a run, or of its last attempt.
    void describe(RunSummary& summary, double time_tolerance, const char* integrator = "ida", int meshes = 1) const;
};

// Guards are functions of the state, positive while all is well; a step that takes one of them through zero ends there.
using Guards = std::vector<double>;

// What moves, and what is watched. All but `residual` and `jacobian` see accepted states, by time, unknowns and rates.
struct ImplicitSystem {
    // F(t, x, v); false where x is inadmissible: try a smaller step.
    std::function<bool(double t, const double* x, const double* v, double* F)> residual;
    // dF/dx + cj dF/dv, into the values of a matrix with `pattern`, which must outlive the integrator.
    std::function<void(double t, const double* x, const double* v, double cj, double* values)> jacobian;
    const Eigen::SparseMatrix<double>* pattern = nullptr;
    // dF/dv at x, likewise, of a system that is linear in v and does not depend on the time; make_rosenbrock() needs
    // it.
    std::function<void(const double* x, double* values)> mass;
    bool banded = false;           // the unknowns stand in an order that is good for elimination
    Eigen::VectorXd scale;         // of each unknown; empty: 1
    Eigen::VectorXd differential;  // 0 for unknowns without a rate, whose local errors do not count; empty: 1
    std::function<double(double t, const double* x, const double* v)> dissipation;
    std::function<double(double t, const double* x, const double* v)> work;  // its rate; empty: none is done
    std::function<Guards(double t, const double* x, const double* v)> guards;
    std::size_t n_guards = 0;  // their number
};

// Gauss points and weights of a step: what is integrated along its path is so there.
inline constexpr std::array path_points{0.1127016653792583, 0.5, 0.8872983346207417};
inline constexpr std::array path_weights{5.0 / 18, 8.0 / 18, 5.0 / 18};

// The integration of a system in time, by one of several methods.
class TimeIntegrator {
public:
    TimeIntegrator() = default;
    TimeIntegrator(TimeIntegrator&&) = delete;
    virtual ~TimeIntegrator() = default;

    enum class Outcome { step, end, guard, failed };
    // One step, not beyond t_end. After `failed` the state is that of the last good step.
    virtual Outcome advance(double t_end) = 0;

    virtual double time() const = 0;
    virtual const double* x() const = 0;
    virtual const double* v() const = 0;  // rates that solve the equations, not the slope of the path
    // The path through the last step, a polynomial in time, and its slope.
    virtual void interpolate(double t, double* x, double* v) const = 0;
    // State and rates at a time within the last step, as exact as at its end.
    virtual void state_within_step(double t, double* x, double* v) = 0;
    virtual double dissipated(double t) const = 0;  // INT dissipation dt from t0 to a time within the last step
    virtual double work(double t) const = 0;        // INT work dt likewise
    virtual double step_size() const = 0;           // of the last step
    virtual int order() const = 0;
    virtual int tripped() const = 0;          // index of the guard that ended the step
    virtual std::string failure() const = 0;  // why the last step failed
    virtual IntegratorCounters counters() const = 0;
};

// From x0 with rates v0, which solve the system. By backward differences of variable order, of IDA:
std::unique_ptr<TimeIntegrator> make_ida(ImplicitSystem system, const Eigen::VectorXd& x0, const Eigen::VectorXd& v0,
                                         double t0, const TimeControl& control);
// By Rodas5P, for systems M(x) v + G(x) = 0 that do not depend on the time. One Jacobian and one factorisation a step,
// no history: on a new mesh a flow continues with steps as long as before. Of the control, max_order and what concerns
// Newton's method mean nothing.
std::unique_ptr<TimeIntegrator> make_rosenbrock(ImplicitSystem system, const Eigen::VectorXd& x0,
                                                const Eigen::VectorXd& v0, double t0, const TimeControl& control);

}  // namespace tubule::axisym
