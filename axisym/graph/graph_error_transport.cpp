#include "axisym/graph/graph_error_transport.hpp"

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

ErrorTransport::ErrorTransport(const Forms& coarse)
    : coarse_(coarse),
      fine_space_(coarse.space().cell(), halved(coarse.space().breaks()), coarse.space().degree(),
                  coarse.space().smoothness()),
      fine_(fine_space_, coarse.bending(), coarse.loads()),
      prolongation_(fine_space_.prolongation(coarse.space())),
      matrix_(fine_.pattern()) {
    total = spatial = residual_ = defect_ = Eigen::VectorXd::Zero(fine_space_.size());
}

void ErrorTransport::inherit(const ErrorTransport& other, const Eigen::VectorXd& x_old, const Eigen::VectorXd& x_new) {
    // The exact profile stays; what changes is the computed one.
    const Eigen::VectorXd computed = prolongation_ * x_new, before = other.prolongation_ * x_old;
    total = fine_space_.prolong(other.fine_space_, before + other.total) - computed;
    spatial = fine_space_.prolong(other.fine_space_, before + other.spatial) - computed;
}

void ErrorTransport::begin(const double* x, const double* v) {
    const int n = coarse_.space().size();
    state_ = prolongation_ * Eigen::Map<const Eigen::VectorXd>(x, n);
    rate_ = prolongation_ * Eigen::Map<const Eigen::VectorXd>(v, n);
    defect_.setZero();
    elapsed_ = 0;
}

void ErrorTransport::add_step(double h, const double* x, const double* v) {
    if (h == 0) return;  // below the resolution of the time: the next step spans it
    const int n = coarse_.space().size();
    next_state_.noalias() = prolongation_ * Eigen::Map<const Eigen::VectorXd>(x, n);
    next_rate_.noalias() = prolongation_ * Eigen::Map<const Eigen::VectorXd>(v, n);
    middle_ = 0.5 * (state_ + next_state_) + (h / 8) * (rate_ - next_rate_);
    slope_ = (1.5 / h) * (next_state_ - state_) - 0.25 * (rate_ + next_rate_);
    fine_.residual(middle_.data(), slope_.data(), residual_.data());
    defect_ += (2.0 / 3.0) * h * residual_;
    state_.swap(next_state_);
    rate_.swap(next_rate_);
    elapsed_ += h;
}

void ErrorTransport::advance() {
    if (elapsed_ == 0) return;
    fine_.jacobian(state_.data(), rate_.data(), 1 / elapsed_, matrix_.valuePtr());
    lu_.factor(matrix_);
    // M (e' - e)/dt + J e' = -(mean residual of the path). The difference of nonlinear residuals stands for J e.
    const auto at_error = [&](const Eigen::VectorXd& error) {
        middle_ = state_ + error;
        fine_.residual(middle_.data(), rate_.data(), residual_.data());
    };
    at_error(spatial);
    spatial -= lu_.solve(residual_);
    fine_.residual(state_.data(), rate_.data(), slope_.data());
    at_error(total);
    // Simpson: the ends of the steps have weight 1/3, and there the residual is that of the space alone.
    residual_ += defect_ / elapsed_ - (2.0 / 3.0) * slope_;
    total -= lu_.solve(residual_);
    defect_.setZero();
    elapsed_ = 0;
}

ErrorTransport::EnergyError ErrorTransport::energy_error(double energy) const {
    return {fine_.free_energy(state_ + total) - energy, fine_.free_energy(state_ + spatial) - energy};
}

}  // namespace tubule::axisym
