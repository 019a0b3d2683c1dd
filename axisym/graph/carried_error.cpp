#include "axisym/graph/carried_error.hpp"

namespace tubule::axisym {

namespace {

std::vector<double> halved(const std::vector<double>& breaks) {
    std::vector<double> out;
    for (std::size_t i = 0; i + 1 < breaks.size(); ++i) {
        out.push_back(breaks[i]);
        out.push_back((breaks[i] + breaks[i + 1]) / 2);
    }
    out.push_back(breaks.back());
    return out;
}

}  // namespace

ErrorTransport::Level::Level(const Forms& f) : forms(f), matrix(f.pattern().nonZeros()), lu(f.pattern()) {
    state = rate = middle = slope = residual = driven = Eigen::VectorXd::Zero(f.space().size());
}

// M (e' - e)/dt + J e' = -(mean residual of the path), with M/dt + J in `matrix`. The difference of nonlinear residuals
// stands for J e.
void ErrorTransport::Level::advance(double time, Eigen::VectorXd& error) {
    lu.factor(matrix.data());
    middle = state + error;
    forms.residual(middle.data(), rate.data(), residual.data());
    residual += driven / time;
    lu.solve(residual.data());
    error -= residual;
}

ErrorTransport::ErrorTransport(const Forms& coarse)
    : coarse_(coarse),
      fine_space_(coarse.space().cell(), halved(coarse.space().breaks()), coarse.space().degree(),
                  coarse.space().smoothness()),
      fine_(fine_space_, coarse.bending(), coarse.loads()),
      prolongation_(fine_space_.prolongation(coarse.space())),
      on_fine_(fine_),
      on_coarse_(coarse),
      stiffness_(coarse.pattern().nonZeros()),
      mass_(coarse.pattern()) {
    total = Eigen::VectorXd::Zero(fine_space_.size());
    temporal = Eigen::VectorXd::Zero(coarse.space().size());
}

void ErrorTransport::set(const Eigen::VectorXd& all, const Eigen::VectorXd& of_space) {
    total = all;
    temporal = coarse_.space().prolong(fine_space_, all - of_space);
}

void ErrorTransport::inherit(const ErrorTransport& other, const Eigen::VectorXd& x_old, const Eigen::VectorXd& x_new) {
    // The exact profile stays; what changes is the computed one.
    const Eigen::VectorXd computed = prolongation_ * x_new, before = other.prolongation_ * x_old;
    total = fine_space_.prolong(other.fine_space_, before + other.total) - computed;
    temporal = coarse_.space().prolongation(other.coarse_.space()) * other.temporal;
}

void ErrorTransport::begin(const double* x, const double* v) {
    const int n = coarse_.space().size();
    on_coarse_.state = Eigen::Map<const Eigen::VectorXd>(x, n);
    on_coarse_.rate = Eigen::Map<const Eigen::VectorXd>(v, n);
    on_fine_.driven.setZero();
    elapsed_ = sampled_ = 0;
    linearised_ = false;
}

// That of the path at `middle` and `slope` of the coarse level drives the errors for this long.
void ErrorTransport::add_residual(double weight) {
    Level& f = on_fine_;
    f.middle.noalias() = prolongation_ * on_coarse_.middle;
    f.slope.noalias() = prolongation_ * on_coarse_.slope;
    f.forms.residual(f.middle.data(), f.slope.data(), f.residual.data());
    f.driven += weight * f.residual;
    sampled_ += weight;
}

void ErrorTransport::add_step(const TimeIntegrator& integrator, double from, bool rosenbrock) {
    const double h = integrator.time() - from;
    Level& c = on_coarse_;
    const Eigen::Map<const Eigen::VectorXd> x(integrator.x(), c.state.size()), v(integrator.v(), c.rate.size());
    if (rosenbrock) {
        for (std::size_t q = 0; q < path_points.size(); ++q) {
            integrator.interpolate(from + path_points[q] * h, c.middle.data(), c.slope.data());
            add_residual(path_weights[q] * h);
        }
    } else {
        c.middle = 0.5 * (c.state + x) + (h / 8) * (c.rate - v);
        c.slope = (1.5 / h) * (x - c.state) - 0.25 * (c.rate + v);
        add_residual(2.0 / 3 * h);
    }
    c.state = x;
    c.rate = v;
    linearised_ = false;
    elapsed_ += h;
}

void ErrorTransport::advance() {
    if (elapsed_ == 0) return;
    Level &c = on_coarse_, &f = on_fine_;
    f.state.noalias() = prolongation_ * c.state;
    f.rate.noalias() = prolongation_ * c.rate;
    f.forms.residual(f.state.data(), f.rate.data(), f.residual.data());
    f.driven -= sampled_ * f.residual;
    c.driven.noalias() = prolongation_.transpose() * f.driven;
    f.forms.jacobian(f.state.data(), f.rate.data(), 1 / elapsed_, f.matrix.data());
    f.advance(elapsed_, total);
    c.forms.jacobian(c.state.data(), c.rate.data(), 0, stiffness_.data());
    c.forms.mass(c.state.data(), mass_.valuePtr());
    for (std::size_t i = 0; i < stiffness_.size(); ++i) c.matrix[i] = stiffness_[i] + mass_.valuePtr()[i] / elapsed_;
    c.advance(elapsed_, temporal);
    f.driven.setZero();
    elapsed_ = sampled_ = 0;
    linearised_ = true;
}

const double* ErrorTransport::stiffness_at(const double* x) const {
    const Eigen::VectorXd& last = on_coarse_.state;
    return linearised_ && std::equal(last.begin(), last.end(), x) ? stiffness_.data() : nullptr;
}

ErrorTransport::EnergyError ErrorTransport::energy_error(double energy) const {
    const Eigen::VectorXd fine = prolongation_ * on_coarse_.state + total, coarse = on_coarse_.state + temporal;
    const double of_all = fine_.free_energy(fine) - energy;
    return {of_all, of_all - (coarse_.free_energy(coarse) - energy)};
}

namespace {

// Measured choices: docs/decisions/graphs.md. The error is transported after this number of steps, or when the
// logarithm of the dissipation has changed by this.
constexpr int error_steps = 8;
constexpr double error_change = 0.25;

}  // namespace

bool GraphError::due(const Observation& o, bool rosenbrock) {
    const double change = std::abs(std::log(o.dissipation / dissipation_last_));
    return ++steps_since_ >= error_steps || rosenbrock || !(change < error_change);
}

void GraphError::transport(ErrorTransport& transport, const Observation& o) {
    if (steps_since_ > 0) transport.advance();
    latest = transport.energy_error(o.free_energy);
    begin(o);
    largest = std::max(largest, now());
}

bool GraphError::is_curable(double allowed, bool free_mesh, bool free_time) const {
    const double of_time = std::abs(latest.total - latest.spatial);
    return now() > allowed &&
           ((free_mesh && std::abs(latest.spatial) > 0.4 * allowed) || (free_time && of_time > 0.4 * allowed));
}

}  // namespace tubule::axisym
