#include "axisym/integration/ida_integrator.hpp"

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

#include "common/solve/pause.hpp"

namespace tubule::axisym {

// Many fields: the objects of IDA, each to be freed.
struct IdaIntegrator::Impl {
    ImplicitSystem system;
    SUNContext context = nullptr;
    N_Vector x = nullptr, v = nullptr, slope = nullptr, dissipated = nullptr, scratch = nullptr, weights = nullptr;
    SUNMatrix jacobian = nullptr;
    SUNLinearSolver solver = nullptr;
    SUNNonlinearSolver newton = nullptr;
    double first_correction = 0;  // of the iteration that is under way, or the second one where that may be larger
    int first_count = 0;
    bool may_grow = false;
    void* ida = nullptr;
    double time = 0;
    int guard = -1;
    std::string message;
    SharedPause pause;  // of the step that is under way

    explicit Impl(ImplicitSystem s) : system(std::move(s)) {}
    ~Impl() {
        IDAFree(&ida);
        if (newton) SUNNonlinSolFree(newton);
        SUNLinSolFree(solver);
        SUNMatDestroy(jacobian);
        for (N_Vector n : {x, v, slope, dissipated, scratch, weights}) N_VDestroy(n);
        SUNContext_Free(&context);
    }
};

namespace {

double* data(N_Vector n) {
    return N_VGetArrayPointer(n);
}

template <class Impl>
int residual(double t, N_Vector x, N_Vector v, N_Vector F, void* user) {
    auto* self = static_cast<Impl*>(user);
    if (self->pause.look()) return -1;                                   // give up
    return self->system.residual(t, data(x), data(v), data(F)) ? 0 : 1;  // 1: try a smaller step
}

void set_pattern(const Eigen::SparseMatrix<double>& pattern, SUNMatrix J) {
    std::copy_n(pattern.outerIndexPtr(), pattern.cols() + 1, SUNSparseMatrix_IndexPointers(J));
    std::copy_n(pattern.innerIndexPtr(), pattern.nonZeros(), SUNSparseMatrix_IndexValues(J));
}

template <class Impl>
int jacobian(double t, double cj, N_Vector x, N_Vector v, N_Vector, SUNMatrix J, void* user, N_Vector, N_Vector,
             N_Vector) {
    const ImplicitSystem& system = static_cast<Impl*>(user)->system;
    set_pattern(*system.pattern, J);  // IDA zeroes the whole matrix before each call
    system.jacobian(t, data(x), data(v), cj, SUNSparseMatrix_Data(J));
    return 0;
}

template <class Impl>
int dissipation(double t, N_Vector x, N_Vector v, N_Vector rate, void* user) {
    auto* self = static_cast<Impl*>(user);
    // The only place where IDA shows the rates of the accepted corrector: what it returns are slopes of its dense
    // output.
    N_VScale(1, v, self->v);
    data(rate)[0] = self->system.dissipation(t, data(x), data(v));
    data(rate)[1] = self->system.work ? self->system.work(t, data(x), data(v)) : 0;
    return 0;
}

template <class Impl>
int guard_values(double t, N_Vector x, N_Vector v, double* values, void* user) {
    auto* self = static_cast<Impl*>(user);
    const Guards guards = self->system.guards(t, data(x), data(v));
    std::copy(guards.begin(), guards.end(), values);
    return 0;
}

// IDA's own test, except that the first correction, which IDA may accept as the last, needs a stricter bound.
template <class Impl>
int has_converged(SUNNonlinearSolver newton, N_Vector, N_Vector correction, double tolerance, N_Vector weights,
                  void* user) {
    auto* self = static_cast<Impl*>(user);
    const double size = N_VWrmsNorm(correction, weights);
    int count = 0;
    SUNNonlinSolGetCurIter(newton, &count);
    if (count == 0) {
        self->first_correction = size, self->first_count = 0;
        return size <= 1e-4 * tolerance ? SUN_NLS_SUCCESS : SUN_NLS_CONTINUE;
    }
    if (size <= 0.1 * tolerance) return SUN_NLS_SUCCESS;  // as small as rounding lets it become, perhaps
    if (count == 1 && self->may_grow && size > 0.1 * self->first_correction) {
        self->first_correction = size, self->first_count = 1;
        return SUN_NLS_CONTINUE;
    }
    const double rate = std::pow(size / self->first_correction, 1.0 / (count - self->first_count));
    if (rate > 0.9) return SUN_NLS_CONV_RECVR;
    return rate / (1 - rate) * size <= tolerance ? SUN_NLS_SUCCESS : SUN_NLS_CONTINUE;
}

template <class Impl>
void keep_message(int, const char*, const char*, char* text, void* user) {
    static_cast<Impl*>(user)->message = text;
}

void require(int status, const char* what) {
    if (status < 0) throw std::runtime_error(fmt::format("IDA rejected {} (status {})", what, status));
}

}  // namespace

IdaIntegrator::IdaIntegrator(ImplicitSystem system, const Eigen::VectorXd& x0, const Eigen::VectorXd& v0, double t0,
                             const TimeControl& control)
    : impl_(std::make_unique<Impl>(std::move(system))) {
    Impl& s = *impl_;
    static_assert(sizeof(sunindextype) == sizeof(std::int64_t) || sizeof(sunindextype) == sizeof(int));
    s.time = t0;
    const int n = static_cast<int>(x0.size());
    require(SUNContext_Create(nullptr, &s.context), "a context");
    s.x = N_VNew_Serial(n, s.context);
    s.v = N_VNew_Serial(n, s.context);
    s.slope = N_VNew_Serial(n, s.context);
    s.scratch = N_VNew_Serial(n, s.context);
    std::copy_n(x0.data(), n, data(s.x));
    std::copy_n(v0.data(), n, data(s.v));
    s.ida = IDACreate(s.context);
    IDASetErrHandlerFn(s.ida, keep_message<Impl>, &s);
    require(IDASetUserData(s.ida, &s), "the user data");
    require(IDAInit(s.ida, residual<Impl>, t0, s.x, s.v), "the initial state");
    s.weights = N_VNew_Serial(n, s.context);
    N_VConst(control.absolute, s.weights);
    for (Eigen::Index i = 0; i < s.system.scale.size(); ++i) data(s.weights)[i] *= s.system.scale[i];
    require(IDASVtolerances(s.ida, control.relative, s.weights), "the tolerances");
    if (s.system.differential.size() > 0) {
        std::copy_n(s.system.differential.data(), n, data(s.scratch));
        require(IDASetId(s.ida, s.scratch), "the kinds of unknowns");
        require(IDASetSuppressAlg(s.ida, true), "the error test");
    }
    require(IDASetMaxOrd(s.ida, control.max_order), "the order");
    // Newton much more exact than the error test asks, and a Jacobian never far off: fewer steps and fewer
    // failures, and errors that follow the tolerance (docs/decisions/graphs.md).
    require(IDASetNonlinConvCoef(s.ida, control.newton), "the Newton tolerance");
    require(IDASetDeltaCjLSetup(s.ida, 0.1), "the lifetime of the Jacobian");
    require(IDASetInitStep(s.ida, control.first_step), "the first step");
    require(IDASetEtaMax(s.ida, control.growth), "the growth of steps");
    s.jacobian = SUNSparseMatrix(n, n, s.system.pattern->nonZeros(), CSC_MAT, s.context);
    set_pattern(*s.system.pattern, s.jacobian);
    s.solver = SUNLinSol_KLU(s.x, s.jacobian, s.context);
    require(SUNLinSol_KLUSetOrdering(s.solver, s.system.banded ? 2 : 0), "the ordering");
    require(IDASetLinearSolver(s.ida, s.solver, s.jacobian), "the linear solver");
    require(IDASetJacFn(s.ida, jacobian<Impl>), "the Jacobian");
    if (control.two_iterations) {
        s.newton = SUNNonlinSol_Newton(s.x, s.context);
        require(IDASetNonlinearSolver(s.ida, s.newton), "the nonlinear solver");
        require(SUNNonlinSolSetConvTestFn(s.newton, has_converged<Impl>, &s), "the convergence test");
    }
    s.may_grow = control.second_may_grow;
    require(IDASetMaxNonlinIters(s.ida, s.may_grow ? 8 : 4), "the number of iterations");
    require(IDARootInit(s.ida, static_cast<int>(s.system.n_guards), guard_values<Impl>), "the guards");
    require(IDASetNoInactiveRootWarn(s.ida), "the guards");
    s.dissipated = N_VNew_Serial(2, s.context);  // and the work
    N_VConst(0, s.dissipated);
    require(IDAQuadInit(s.ida, dissipation<Impl>, s.dissipated), "the dissipation integral");
}

IdaIntegrator::~IdaIntegrator() = default;

TimeIntegrator::Outcome IdaIntegrator::advance(double t_end) {
    Impl& s = *impl_;
    require(IDASetStopTime(s.ida, t_end), "the end time");
    N_VScale(1, s.v, s.scratch);
    const int status = IDASolve(s.ida, t_end, &s.time, s.x, s.slope, IDA_ONE_STEP);
    if (s.pause.wanted()) N_VScale(1, s.scratch, s.v);  // x is again that of the last step
    s.pause.check();
    if (status == IDA_TSTOP_RETURN) return Outcome::end;
    if (status == IDA_ROOT_RETURN) {
        N_VScale(1, s.slope, s.v);  // the corrector's rates are those of the step's end, beyond the guard
        std::vector<int> found(s.system.n_guards);
        IDAGetRootInfo(s.ida, found.data());
        s.guard =
            static_cast<int>(std::find_if(found.begin(), found.end(), [](int f) { return f != 0; }) - found.begin());
        return Outcome::guard;
    }
    return status < 0 ? Outcome::failed : Outcome::step;
}

double IdaIntegrator::time() const {
    return impl_->time;
}
const double* IdaIntegrator::x() const {
    return data(impl_->x);
}
const double* IdaIntegrator::v() const {
    return data(impl_->v);
}

void IdaIntegrator::interpolate(double t, double* x, double* v) const {
    const auto n = N_VGetLength(impl_->x);
    for (int k = 0; k < 2; ++k) {
        require(IDAGetDky(impl_->ida, t, k, impl_->scratch), "dense output");
        std::copy_n(data(impl_->scratch), n, k == 0 ? x : v);
    }
}

double IdaIntegrator::dissipated(double t) const {
    require(IDAGetQuadDky(impl_->ida, t, 0, impl_->dissipated), "the dissipation integral");
    return data(impl_->dissipated)[0];
}

double IdaIntegrator::work(double t) const {
    require(IDAGetQuadDky(impl_->ida, t, 0, impl_->dissipated), "the dissipation integral");
    return data(impl_->dissipated)[1];
}

double IdaIntegrator::step_size() const {
    double h = 0;
    IDAGetLastStep(impl_->ida, &h);
    return h;
}

int IdaIntegrator::order() const {
    int k = 0;
    IDAGetLastOrder(impl_->ida, &k);
    return k;
}

int IdaIntegrator::tripped() const {
    return impl_->guard;
}
std::string IdaIntegrator::failure() const {
    return impl_->message;
}

IntegratorCounters IdaIntegrator::counters() const {
    IntegratorCounters c;
    IDAGetNumSteps(impl_->ida, &c.steps);
    IDAGetNumResEvals(impl_->ida, &c.residuals);
    IDAGetNumJacEvals(impl_->ida, &c.jacobians);
    IDAGetNumErrTestFails(impl_->ida, &c.error_failures);
    IDAGetNonlinSolvStats(impl_->ida, &c.newton_iterations, &c.newton_failures);
    return c;
}

}  // namespace tubule::axisym
