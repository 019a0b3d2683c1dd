// Rosenbrock's linearly implicit method of order 5 with eight stages: Rodas5P of Steinebach (BIT 63:27, 2023), stiffly
// accurate and L-stable, of full order for parabolic equations too.
#pragma once

#include <memory>

#include "axisym/integration/time_integrator.hpp"

namespace tubule::axisym {

// For systems M(x) v + G(x) = 0 that do not depend on the time. One Jacobian and one factorisation a step, no history:
// on a new mesh a flow continues with steps as long as before.
class RosenbrockIntegrator : public TimeIntegrator {
public:
    // From x0 with rates v0, which solve the system. Of the control, max_order and what concerns Newton's method mean
    // nothing.
    RosenbrockIntegrator(ImplicitSystem system, const Eigen::VectorXd& x0, const Eigen::VectorXd& v0, double t0,
                         const TimeControl& control);
    ~RosenbrockIntegrator() override;

    Outcome advance(double t_end) override;
    double time() const override;
    const double* x() const override;
    const double* v() const override;
    void interpolate(double t, double* x, double* v) const override;
    void state_within_step(double t, double* x, double* v) override;
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
