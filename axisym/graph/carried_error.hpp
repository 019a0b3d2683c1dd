// The error e of the profile, carried along with the run. On halved elements it obeys the linearised flow
// M e_t + J e = -(residual of the computed path). A second one, on the mesh of the run, is driven only by the residual
// in excess of that at the end of a step: the part of e due to time steps. Both advance by linearly implicit Euler
// steps, each over several steps of the run.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <optional>

#include "axisym/graph/graph_forms.hpp"
#include "axisym/integration/time_integrator.hpp"
#include "axisym/splines/band_lu.hpp"

namespace tubule::axisym {

// Many fields: most are vectors that every step uses again.
class ErrorTransport {
public:
    // coarse must outlive the transport.
    explicit ErrorTransport(const Forms& coarse);
    ErrorTransport(ErrorTransport&&) = delete;

    const SplineSpace& space() const { return fine_space_; }

    // Errors (exact minus computed) as coefficients: of space and time in space(), and the part of time in the space of
    // the run.
    Eigen::VectorXd total, temporal;

    // The part of space, and the other way round.
    Eigen::VectorXd spatial() const { return total - prolongation_ * temporal; }
    void set(const Eigen::VectorXd& all, const Eigen::VectorXd& of_space);

    // Takes the error over from another mesh; x_old and x_new are the profile before and after remeshing.
    void inherit(const ErrorTransport& other, const Eigen::VectorXd& x_old, const Eigen::VectorXd& x_new);

    // Starts the path here, with the errors that are set in total and temporal.
    void begin(const double* x, const double* v);
    // The last step of the run, which began at time `from`: integrates the residual of its path. A long step takes the
    // polynomial of its method and Gauss' rule. (The error estimate of the method cannot replace it: it is that of a
    // method of lower order.) A short one takes the cubic through states and rates at its ends and Simpson's rule, as
    // at the ends only the residual of space is left.
    void add_step(const TimeIntegrator& integrator, double from, bool rosenbrock);
    // Brings the errors to the time of the last step.
    void advance();
    // dF/dx of the run at x where the last advance() has it, else null.
    const double* stiffness_at(const double* x) const;

    // Energy of the exact profile minus that of the computed one, `energy`, at the time of the last advance().
    struct EnergyError {
        double total = 0, spatial = 0;
    };
    EnergyError energy_error(double energy) const;

private:
    const Forms& coarse_;
    SplineSpace fine_space_;
    Forms fine_;
    Eigen::SparseMatrix<double> prolongation_;
    // On the fine mesh and on that of the run.
    struct Level {
        const Forms& forms;
        std::vector<double> matrix;
        BandLu lu;
        Eigen::VectorXd state, rate, middle, slope, residual, driven;
        explicit Level(const Forms& f);
        void advance(double time, Eigen::VectorXd& error);
    };
    Level on_fine_, on_coarse_;
    std::vector<double> stiffness_;  // on the mesh of the run, like the mass
    Eigen::SparseMatrix<double> mass_;
    bool linearised_ = false;  // since the last step
    void add_residual(double weight);
    double elapsed_ = 0;
    double sampled_ = 0;  // weights of samples within steps; the rest of `elapsed_` has the residual of its end
};

// The error of the energy along a run, computed at intervals.
class GraphError {
public:
    // The transport begins anew with this observation.
    void begin(const Observation& o) { dissipation_last_ = o.dissipation, steps_since_ = 0; }
    // Whether to transport the error after a step: after each long step of a one-step method, or when some short
    // ones of backward differences have changed the shape.
    bool due(const Observation& o, bool rosenbrock);
    void transport(ErrorTransport& transport, const Observation& o);
    // Whether it exceeds what is allowed, for a reason that a finer mesh or a smaller tolerance in time remedies, where
    // they are free.
    bool is_curable(double allowed, bool free_mesh, bool free_time) const;

    double now() const { return std::abs(latest.total); }

    ErrorTransport::EnergyError latest;
    double largest = 0;

private:
    double dissipation_last_ = 0;
    int steps_since_ = 0;
};

}  // namespace tubule::axisym
