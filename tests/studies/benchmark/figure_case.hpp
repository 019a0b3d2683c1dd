// The paper's axisymmetric figure as it is timed: k42 = 0.06, energies of the independent spectral reference.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "axisym/run_profile.hpp"
#include "tests/axisym/reference.hpp"
#include "tests/support/summary_detail.hpp"

namespace tubule::axisym {

inline Case figure_case() {
    Case c;
    for_each_bending_term([&](std::size_t i, const auto& term) {
        if (std::string(term.key) == "k20") c.energy.k[i] = 0.2;
        if (std::string(term.key) == "k42") c.energy.k[i] = 0.06;
    });
    c.energy.H0 = -2;
    c.shape =
        Tube{.radius = 1, .length = 2, .modes = {{.amplitude = 0.25, .n = 1, .m = 0, .phase = -std::numbers::pi / 2}}};
    c.time.end = 1.4;
    c.time.output = {0.01, 0.05, 0.2, 0.5};
    return c;
}

// Takes the largest error of the energy at the reference's times.
struct ErrorWatch : RunObserver {
    double error = 0;
    void row(std::span<const double> values) override {
        constexpr int energy = 4;  // after time, step_size, order, newton_iterations
        for (const auto& point : reference::figure[1].at)
            if (values[0] == point.time) error = std::max(error, std::abs(values[energy] - point.energy));
    }
    void discard() override { error = 0; }
};

}  // namespace tubule::axisym
