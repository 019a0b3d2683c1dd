// A profile's motion F(t, x, x_t) = 0 in time: the one place that sees IDA (its variant IDAS, which also integrates the
// dissipation).
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace tubule::axisym {

struct TimeControl {
    double relative = 1e-6;  // local error per step relative to the coefficients
    double absolute = 1e-9;  // added to that, times the unknown's scale
    int max_order = 5;       // of the backward differences
    double first_step = 0;   // 0: chosen by IDA
    double growth = 2;       // a step is at most so many times as long as the one before; at least 2
    double newton = 0.01;    // tolerance of the iteration, relative to that of the error test
    // At least two iterations. IDA accepts one where earlier ones converged quickly; then constraints hold only to
    // the error of the step, because they are nonlinear.
    bool two_iterations = false;
};

struct FlowCounters {
    long steps = 0, residuals = 0, jacobians = 0, newton_iterations = 0, error_failures = 0, newton_failures = 0;
    FlowCounters& operator+=(const FlowCounters& other);
};

// Guards are functions of the state, positive while all is well; a step that takes one of them through zero ends there.
using Guards = std::vector<double>;

// What moves, and what is watched. All but `residual` and `jacobian` see accepted states, by time, unknowns and rates.
struct FlowSystem {
    // F(t, x, v); false where x is inadmissible: try a smaller step.
    std::function<bool(double t, const double* x, const double* v, double* F)> residual;
    // dF/dx + cj dF/dv, into the values of a matrix with `pattern`, which must outlive the flow.
    std::function<void(double t, const double* x, const double* v, double cj, double* values)> jacobian;
    const Eigen::SparseMatrix<double>* pattern = nullptr;
    bool banded = false;           // the unknowns stand in an order that is good for elimination
    Eigen::VectorXd scale;         // of each unknown; empty: 1
    Eigen::VectorXd differential;  // 0 for unknowns without a rate, whose local errors do not count; empty: 1
    std::function<double(double t, const double* x, const double* v)> dissipation;
    std::function<double(double t, const double* x, const double* v)> work;  // its rate; empty: none is done
    std::function<Guards(double t, const double* x, const double* v)> guards;
    std::size_t n_guards = 0;  // how many these are
};

class Flow {
public:
    // From x0 with rates v0, which solve the system.
    Flow(FlowSystem system, const Eigen::VectorXd& x0, const Eigen::VectorXd& v0, double t0,
         const TimeControl& control);
    ~Flow();
    Flow(Flow&&) = delete;

    enum class Outcome { step, end, guard, failed };
    // One step, not beyond t_end. After `failed` the state is that of the last good step.
    Outcome advance(double t_end);

    double time() const;
    const double* x() const;
    const double* v() const;  // the rates that solve the flow's equations, not the slope of the dense output
    // State at a time within the last step (dense output of the order of the step).
    void interpolate(double t, double* x, double* v) const;
    // Second derivative of the coefficients in time at the end of the last step; 0 if that was of order 1.
    Eigen::VectorXd acceleration() const;
    double dissipated(double t) const;  // INT dissipation dt from t0 to a time within the last step
    double work(double t) const;        // INT work dt likewise
    double step_size() const;           // of the last step
    int order() const;
    int tripped() const;          // index of the guard that ended the step
    std::string failure() const;  // what IDA said
    FlowCounters counters() const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace tubule::axisym
