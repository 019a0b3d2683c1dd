// Estimates how far the computed profile is from the exact one. The error obeys the linearised flow, driven by
// the residual of the flow along a smooth curve through the
// computed states, tested with splines on halved elements. It is carried along with the run by linearly
// implicit Euler steps, each spanning several steps of the run.
#pragma once

#include <Eigen/Core>

#include "axisym/graph/graph_forms.hpp"
#include "common/solve/sparse.hpp"

namespace tubule::axisym {

// Many fields: most are vectors that every step uses again.
class ErrorTransport {
public:
    // coarse must outlive the transport.
    explicit ErrorTransport(const Forms& coarse);
    ErrorTransport(ErrorTransport&&) = delete;

    const ProfileSpace& space() const { return fine_space_; }

    // Errors (exact minus computed) as coefficients in space(): total, and the part due to the mesh alone.
    Eigen::VectorXd total, spatial;

    // Takes the error over from another mesh; x_old and x_new are the profile before and after remeshing.
    void inherit(const ErrorTransport& other, const Eigen::VectorXd& x_old, const Eigen::VectorXd& x_new);

    // Starts the path here, with the errors that are set in total and spatial.
    void begin(const double* x, const double* v);
    // One step of the run, of size h, to the state x with rates v. The cubic through both states with their
    // rates solves the flow at its ends; Simpson's rule leaves its residual in the middle as the local error.
    // (IDA's own estimates cannot replace it: after changes of step or order they are off by a factor of 3.)
    void add_step(double h, const double* x, const double* v);
    // Brings the errors to the time of the last step.
    void advance();

    // Energy of the exact profile minus that of the computed one, `energy`, at the time of the last advance().
    struct EnergyError {
        double total = 0, spatial = 0;
    };
    EnergyError energy_error(double energy) const;

private:
    const Forms& coarse_;
    ProfileSpace fine_space_;
    Forms fine_;
    Eigen::SparseMatrix<double> prolongation_, matrix_;
    SparseLu lu_;
    Eigen::VectorXd state_, rate_, next_state_, next_rate_, middle_, slope_, residual_, defect_;
    double elapsed_ = 0;
};

}  // namespace tubule::axisym
