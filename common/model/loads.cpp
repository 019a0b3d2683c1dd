#include <gsl/gsl_errno.h>
#include <gsl/gsl_integration.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "common/formula/formula.hpp"
#include "common/model/model.hpp"

namespace tubule {
namespace {

double value(const Formula& pressure, double volume) {
    return evaluate(pressure, &volume);
}

// INT P dV from V = 1, in log V: exact to rounding where the formula is smooth; NaN where it has no value on the way.
double integral(const Formula& pressure, double volume) {
    constexpr double tolerance = 1e-13;
    constexpr std::size_t most_intervals = 200;
    constexpr double nothing = std::numeric_limits<double>::quiet_NaN();
    if (!(volume > 0) || !std::isfinite(volume)) return nothing;
    static const auto handler = gsl_set_error_handler_off();  // statuses say what fails
    static_cast<void>(handler);
    const std::unique_ptr<gsl_integration_workspace, decltype(&gsl_integration_workspace_free)> work(
        gsl_integration_workspace_alloc(most_intervals), gsl_integration_workspace_free);
    gsl_function by_log{[](double log_volume, void* formula) {
                            const double V = std::exp(log_volume);
                            return V * value(*static_cast<const Formula*>(formula), V);
                        },
                        const_cast<Formula*>(&pressure)};
    double out = 0, error = 0;
    const double size = std::abs(value(pressure, 1)) + std::abs(volume * value(pressure, volume));
    const int status = gsl_integration_qag(&by_log, 0, std::log(volume), tolerance * size, tolerance, most_intervals,
                                           GSL_INTEG_GAUSS31, work.get(), &out, &error);
    const bool rounding = status == GSL_EROUND && error <= std::sqrt(tolerance) * std::max(std::abs(out), size);
    return status == GSL_SUCCESS || rounding ? out : nothing;
}

}  // namespace

double Loads::pressure_at(double volume) const {
    return of_volume ? value(*of_volume, volume) : pressure;
}

double Loads::pressure_slope(double volume) const {
    if (!of_volume) return 0;
    const auto V = Jet<double, 1, 1>::variable(volume, 0);
    return evaluate(*of_volume, &V).d[0];
}

double Loads::energy(double area, double volume, double length) const {
    const double of_pressure = of_volume ? integral(*of_volume, volume) : pressure * volume;
    return tension * area - of_pressure - force * length;
}

double Loads::scale(double area, double volume, double length) const {
    return std::abs(tension) * area + std::abs(pressure_at(volume) * volume) + std::abs(force) * length;
}

FormulaDomain::Margin pressure_domain(const MotionLaw& law, double volume) {
    if (!law.pressure_of_volume) return {};
    FormulaDomain domain(*law.pressure_of_volume);
    domain.look(std::span(&volume, 1), volume);
    return domain.margin();
}

}  // namespace tubule
