// Backward differences of variable order: the one place that sees IDA (its variant IDAS, which also integrates the
// dissipation).
#pragma once

#include <memory>

#include "axisym/integration/time_integrator.hpp"

namespace tubule::axisym {

class IdaIntegrator : public TimeIntegrator {
public:
    // From x0 with rates v0, which solve the system.
    IdaIntegrator(ImplicitSystem system, const Eigen::VectorXd& x0, const Eigen::VectorXd& v0, double t0,
                  const TimeControl& control);
    ~IdaIntegrator() override;

    Outcome advance(double t_end) override;
    double time() const override;
    const double* x() const override;
    const double* v() const override;
    void interpolate(double t, double* x, double* v) const override;
    void state_within_step(double t, double* x, double* v) override { interpolate(t, x, v); }
    double dissipated(double t) const override;
    double work(double t) const override;
    double step_size() const override;
    int order() const override;
    int tripped() const override;
    std::string failure() const override;
    IntegratorCounters counters() const override;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace tubule::axisym
