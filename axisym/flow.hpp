// The gradient flow M(x) x_t + grad E(x) = 0 of a discrete profile in time: the one place that sees IDA
// (its variant IDAS, which also integrates the dissipation).
#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <string>

#include "axisym/forms.hpp"

namespace tubule::axisym {

struct TimeControl {
    double relative = 1e-6;  // local error per step relative to the coefficients
    double absolute = 1e-9;  // added to that
    int max_order = 5;       // of the backward differences
    double first_step = 0;   // 0: chosen by IDA
};

struct FlowCounters {
    long steps = 0, residuals = 0, jacobians = 0, newton_iterations = 0, error_failures = 0, newton_failures = 0;
    FlowCounters& operator+=(const FlowCounters& other);
};

class Flow {
public:
    // Guards are functions of the observed state, positive while all is well; a step that takes one of
    // them through zero ends there.
    static constexpr int n_guards = 3;
    using Guards = std::array<double, n_guards>;
    // Called at the end of each step with the time, the coefficients and their rates.
    using Observe = std::function<const Observation&(double t, const double* x, const double* v)>;

    // forms must outlive the flow; v0 are the rates at x0 (Forms::rate).
    Flow(const Forms& forms, const Eigen::VectorXd& x0, const Eigen::VectorXd& v0, double t0,
         const TimeControl& control, Observe observe, std::function<Guards(const Observation&)> guards);
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
