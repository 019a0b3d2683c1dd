// Backward differences of variable order: the one place that sees IDA (its variant IDAS, which also integrates the
// dissipation).

#include <fmt/format.h>
#include <idas/idas.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_context.h>
#include <sunlinsol/sunlinsol_klu.h>
#include <sunmatrix/sunmatrix_sparse.h>
#include <sunnonlinsol/sunnonlinsol_newton.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "axisym/integration/time_integrator.hpp"
#include "common/solve/pause.hpp"

namespace tubule::axisym {
namespace {

double* data(N_Vector n) {
    return N_VGetArrayPointer(n);
}

void set_pattern(const Eigen::SparseMatrix<double>& pattern, SUNMatrix J) {
    std::copy_n(pattern.outerIndexPtr(), pattern.cols() + 1, SUNSparseMatrix_IndexPointers(J));
    std::copy_n(pattern.innerIndexPtr(), pattern.nonZeros(), SUNSparseMatrix_IndexValues(J));
}

void require(int status, const char* what) {
    if (status < 0) throw std::runtime_error(fmt::format("IDA rejected {} (status {})", what, status));
}

// Many fields: the objects of IDA, each to be freed.
class IdaIntegrator final : public TimeIntegrator {
public:
    IdaIntegrator(ImplicitSystem system, const Eigen::VectorXd& x0, const Eigen::VectorXd& v0, double t0,
                  const TimeControl& control)
        : IdaIntegrator(std::move(system)) {  // from there on the destructor frees what there is
        static_assert(sizeof(sunindextype) == sizeof(std::int64_t) || sizeof(sunindextype) == sizeof(int));
        time_ = t0;
        const int n = static_cast<int>(x0.size());
        require(SUNContext_Create(nullptr, &context_), "a context");
        x_ = N_VNew_Serial(n, context_);
        v_ = N_VNew_Serial(n, context_);
        slope_ = N_VNew_Serial(n, context_);
        scratch_ = N_VNew_Serial(n, context_);
        std::copy_n(x0.data(), n, data(x_));
        std::copy_n(v0.data(), n, data(v_));
        ida_ = IDACreate(context_);
        IDASetErrHandlerFn(ida_, keep_message, this);
        require(IDASetUserData(ida_, this), "the user data");
        require(IDAInit(ida_, residual, t0, x_, v_), "the initial state");
        weights_ = N_VNew_Serial(n, context_);
        N_VConst(control.absolute, weights_);
        for (Eigen::Index i = 0; i < system_.scale.size(); ++i) data(weights_)[i] *= system_.scale[i];
        require(IDASVtolerances(ida_, control.relative, weights_), "the tolerances");
        if (system_.differential.size() > 0) {
            std::copy_n(system_.differential.data(), n, data(scratch_));
            require(IDASetId(ida_, scratch_), "the kinds of unknowns");
            require(IDASetSuppressAlg(ida_, true), "the error test");
        }
        require(IDASetMaxOrd(ida_, control.max_order), "the order");
        // Newton much more exact than the error test asks, and a Jacobian never far off: fewer steps and fewer
        // failures, and errors that follow the tolerance (docs/decisions/graphs.md).
        require(IDASetNonlinConvCoef(ida_, control.newton), "the Newton tolerance");
        require(IDASetDeltaCjLSetup(ida_, 0.1), "the lifetime of the Jacobian");
        require(IDASetInitStep(ida_, control.first_step), "the first step");
        require(IDASetEtaMax(ida_, control.growth), "the growth of steps");
        jacobian_ = SUNSparseMatrix(n, n, system_.pattern->nonZeros(), CSC_MAT, context_);
        set_pattern(*system_.pattern, jacobian_);
        solver_ = SUNLinSol_KLU(x_, jacobian_, context_);
        require(SUNLinSol_KLUSetOrdering(solver_, system_.banded ? 2 : 0), "the ordering");
        require(IDASetLinearSolver(ida_, solver_, jacobian_), "the linear solver");
        require(IDASetJacFn(ida_, jacobian), "the Jacobian");
        if (control.two_iterations) {
            newton_ = SUNNonlinSol_Newton(x_, context_);
            require(IDASetNonlinearSolver(ida_, newton_), "the nonlinear solver");
            require(SUNNonlinSolSetConvTestFn(newton_, has_converged, this), "the convergence test");
        }
        may_grow_ = control.second_may_grow;
        require(IDASetMaxNonlinIters(ida_, may_grow_ ? 8 : 4), "the number of iterations");
        require(IDARootInit(ida_, static_cast<int>(system_.n_guards), guard_values), "the guards");
        require(IDASetNoInactiveRootWarn(ida_), "the guards");
        dissipated_ = N_VNew_Serial(2, context_);  // and the work
        N_VConst(0, dissipated_);
        require(IDAQuadInit(ida_, dissipation, dissipated_), "the dissipation integral");
    }

    ~IdaIntegrator() override {
        IDAFree(&ida_);
        if (newton_) SUNNonlinSolFree(newton_);
        SUNLinSolFree(solver_);
        SUNMatDestroy(jacobian_);
        for (N_Vector n : {x_, v_, slope_, dissipated_, scratch_, weights_}) N_VDestroy(n);
        SUNContext_Free(&context_);
    }

    Outcome advance(double t_end) override {
        require(IDASetStopTime(ida_, t_end), "the end time");
        N_VScale(1, v_, scratch_);
        const int status = IDASolve(ida_, t_end, &time_, x_, slope_, IDA_ONE_STEP);
        if (pause_.wanted()) N_VScale(1, scratch_, v_);  // x is again that of the last step
        pause_.check();
        if (status == IDA_TSTOP_RETURN) return Outcome::end;
        if (status == IDA_ROOT_RETURN) {
            N_VScale(1, slope_, v_);  // the corrector's rates are those of the step's end, beyond the guard
            std::vector<int> found(system_.n_guards);
            IDAGetRootInfo(ida_, found.data());
            guard_ = static_cast<int>(std::find_if(found.begin(), found.end(), [](int f) { return f != 0; }) -
                                      found.begin());
            return Outcome::guard;
        }
        return status < 0 ? Outcome::failed : Outcome::step;
    }

    void interpolate(double t, double* x, double* v) const override {
        const auto n = N_VGetLength(x_);
        for (int k = 0; k < 2; ++k) {
            require(IDAGetDky(ida_, t, k, scratch_), "dense output");
            std::copy_n(data(scratch_), n, k == 0 ? x : v);
        }
    }

    double step_size() const override {
        double h = 0;
        IDAGetLastStep(ida_, &h);
        return h;
    }

    int order() const override {
        int k = 0;
        IDAGetLastOrder(ida_, &k);
        return k;
    }

    IntegratorCounters counters() const override {
        IntegratorCounters c;
        IDAGetNumSteps(ida_, &c.steps);
        IDAGetNumResEvals(ida_, &c.residuals);
        IDAGetNumJacEvals(ida_, &c.jacobians);
        IDAGetNumErrTestFails(ida_, &c.error_failures);
        IDAGetNonlinSolvStats(ida_, &c.newton_iterations, &c.newton_failures);
        return c;
    }

    double time() const override { return time_; }
    const double* x() const override { return data(x_); }
    const double* v() const override { return data(v_); }
    void state_within_step(double t, double* x, double* v) override { interpolate(t, x, v); }
    double dissipated(double t) const override { return integral(t, 0); }
    double work(double t) const override { return integral(t, 1); }
    int tripped() const override { return guard_; }
    std::string failure() const override { return message_; }

private:
    explicit IdaIntegrator(ImplicitSystem system) : system_(std::move(system)) {}

    static int residual(double t, N_Vector x, N_Vector v, N_Vector F, void* user) {
        auto* self = static_cast<IdaIntegrator*>(user);
        if (self->pause_.look()) return -1;                                   // give up
        return self->system_.residual(t, data(x), data(v), data(F)) ? 0 : 1;  // 1: try a smaller step
    }

    static int jacobian(double t, double cj, N_Vector x, N_Vector v, N_Vector, SUNMatrix J, void* user, N_Vector,
                        N_Vector, N_Vector) {
        const ImplicitSystem& system = static_cast<IdaIntegrator*>(user)->system_;
        set_pattern(*system.pattern, J);  // IDA zeroes the whole matrix before each call
        system.jacobian(t, data(x), data(v), cj, SUNSparseMatrix_Data(J));
        return 0;
    }

    static int dissipation(double t, N_Vector x, N_Vector v, N_Vector rate, void* user) {
        auto* self = static_cast<IdaIntegrator*>(user);
        // The only place where IDA shows the rates of the accepted corrector: what it returns are slopes of its dense
        // output.
        N_VScale(1, v, self->v_);
        data(rate)[0] = self->system_.dissipation(t, data(x), data(v));
        data(rate)[1] = self->system_.work ? self->system_.work(t, data(x), data(v)) : 0;
        return 0;
    }

    static int guard_values(double t, N_Vector x, N_Vector v, double* values, void* user) {
        auto* self = static_cast<IdaIntegrator*>(user);
        const Guards guards = self->system_.guards(t, data(x), data(v));
        std::copy(guards.begin(), guards.end(), values);
        return 0;
    }

    // IDA's own test, except that the first correction, which IDA may accept as the last, needs a stricter bound.
    static int has_converged(SUNNonlinearSolver newton, N_Vector, N_Vector correction, double tolerance,
                             N_Vector weights, void* user) {
        auto* self = static_cast<IdaIntegrator*>(user);
        const double size = N_VWrmsNorm(correction, weights);
        int count = 0;
        SUNNonlinSolGetCurIter(newton, &count);
        if (count == 0) {
            self->first_correction_ = size, self->first_count_ = 0;
            return size <= 1e-4 * tolerance ? SUN_NLS_SUCCESS : SUN_NLS_CONTINUE;
        }
        if (size <= 0.1 * tolerance) return SUN_NLS_SUCCESS;  // as small as rounding lets it become, perhaps
        if (count == 1 && self->may_grow_ && size > 0.1 * self->first_correction_) {
            self->first_correction_ = size, self->first_count_ = 1;
            return SUN_NLS_CONTINUE;
        }
        const double rate = std::pow(size / self->first_correction_, 1.0 / (count - self->first_count_));
        if (rate > 0.9) return SUN_NLS_CONV_RECVR;
        return rate / (1 - rate) * size <= tolerance ? SUN_NLS_SUCCESS : SUN_NLS_CONTINUE;
    }

    static void keep_message(int, const char*, const char*, char* text, void* user) {
        static_cast<IdaIntegrator*>(user)->message_ = text;
    }

    double integral(double t, int which) const {
        require(IDAGetQuadDky(ida_, t, 0, dissipated_), "the dissipation integral");
        return data(dissipated_)[which];
    }

    ImplicitSystem system_;
    SUNContext context_ = nullptr;
    N_Vector x_ = nullptr, v_ = nullptr, slope_ = nullptr, dissipated_ = nullptr, scratch_ = nullptr,
             weights_ = nullptr;
    SUNMatrix jacobian_ = nullptr;
    SUNLinearSolver solver_ = nullptr;
    SUNNonlinearSolver newton_ = nullptr;
    double first_correction_ = 0;  // of the iteration that is under way, or the second one where that may be larger
    int first_count_ = 0;
    bool may_grow_ = false;
    void* ida_ = nullptr;
    double time_ = 0;
    int guard_ = -1;
    std::string message_;
    SharedPause pause_;  // of the step that is under way
};

}  // namespace

std::unique_ptr<TimeIntegrator> make_ida(ImplicitSystem system, const Eigen::VectorXd& x0, const Eigen::VectorXd& v0,
                                         double t0, const TimeControl& control) {
    return std::make_unique<IdaIntegrator>(std::move(system), x0, v0, t0, control);
}

}  // namespace tubule::axisym
