// Is the stated error honest? Cases nobody tuned anything for, drawn from a seed: the stated error against the true
// one.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <random>
#include <vector>

#include "axisym/graph/graph_mesh.hpp"
#include "common/geometry/profile_point.hpp"
#include "tests/axisym/runs.hpp"

namespace tubule::axisym::estimate_test {

// A tube with 1 ... 4 modes of random waves, amplitudes and phases, random moduli with or without k40 and k42, a random
// spontaneous curvature, a random time (around that in which a wave of the period decays) and a random accuracy.
Case random_case(std::mt19937& engine) {
    const auto uniform = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(engine); };
    const auto power = [&](double a, double b) { return std::exp(uniform(std::log(a), std::log(b))); };
    const auto pick = [&](int a, int b) { return std::uniform_int_distribution<int>(a, b)(engine); };
    const double R = power(0.5, 2), L = R * power(1.5, 8), k20 = power(0.05, 1);
    Bending material = bending(k20, uniform(-2.5, 1) / R);
    if (pick(0, 1)) material.k[1] = k20 * R * R * power(0.005, 0.2);
    if (pick(0, 1)) material.k[2] = k20 * R * R * power(0.02, 0.8);
    std::vector<TubeMode> modes(pick(1, 4));
    for (TubeMode& mode : modes) {
        mode.n = pick(1, 4);
        mode.amplitude = R * power(0.01, 0.35) / (static_cast<double>(modes.size()) * std::sqrt(mode.n));
        mode.phase = pick(0, 2) ? uniform(0, 2 * pi) : 0;
    }
    const double q = 2 * pi / L, end = power(0.05, 5) / (2 * k20 * std::pow(q, 4));
    Case c = tube_case(material, R, L, modes, end);
    for (int i = 1; i < 12; ++i) c.time.output.push_back(end * std::pow(10, -i / 2.0));
    c.accuracy.energy = power(1e-7, 1e-3);
    return c;
}

struct Honesty {
    double asked, error, estimate;  // relative to E_ref; the error is the largest over all rows of the run
    double ratio() const { return error / estimate; }
};

// The error of a run over all of its rows against another run, on other settings and 1e3 times as accurate at
// least. Nothing if the case does not finish.
std::optional<Honesty> honesty(Case c) {
    const Outcome o = run_case(c);
    if (o.summary.stop.reason != Stop::finished) return std::nullopt;
    const double asked = c.accuracy.energy;
    c.accuracy.energy = std::max(1e-3 * asked, 1e-10);
    c.discretisation.order = 7;
    c.time.output = o["time"];
    const Outcome exact = run_case(c);
    if (exact.summary.stop.reason != Stop::finished) return std::nullopt;
    Honesty h{asked, 0, o.summary.estimated_error};
    for (double t : o["time"])
        h.error = std::max(h.error, std::abs(o.at("energy", t) - exact.at("energy", t)) / o.summary.reference_energy);
    return h;
}

struct Distribution {
    std::vector<Honesty> all;
    double within(double low, double high) const {
        double n = 0;
        for (const Honesty& h : all) n += h.ratio() >= low && h.ratio() <= high;
        return n / static_cast<double>(all.size());
    }
    double quantile(double q) const {
        std::vector<double> ratios;
        for (const Honesty& h : all) ratios.push_back(h.ratio());
        std::sort(ratios.begin(), ratios.end());
        return ratios[static_cast<std::size_t>(q * static_cast<double>(ratios.size() - 1) + 0.5)];
    }
    void print() const {
        std::printf(
            "error / estimate of %zu random cases: smallest %.3f, 5 %% %.3f, median %.3f, 95 %% %.3f, largest %.3f; "
            "%.0f %% within [0.1, 1]\n",
            all.size(), quantile(0), quantile(0.05), quantile(0.5), quantile(0.95), quantile(1), 100 * within(0.1, 1));
        double worst = 0;
        for (const Honesty& h : all) worst = std::max(worst, h.error / h.asked);
        std::printf("largest error / asked: %.3f\n", worst);
    }
};

Distribution battery(unsigned seed, int cases) {
    std::mt19937 engine(seed);
    Distribution d;
    while (static_cast<int>(d.all.size()) < cases)
        if (const auto h = honesty(random_case(engine))) d.all.push_back(*h);
    d.print();
    return d;
}

TEST(Estimate, isHonest) {
    const Distribution d = battery(20240, 15);
    EXPECT_GE(d.within(0.1, 1), 0.9);
    EXPECT_LE(d.quantile(1), 1.2);
    for (const Honesty& h : d.all) EXPECT_LE(h.error, h.asked);
}

TEST(EstimateStudy, isHonest) {
    const Distribution d = battery(71, 100);
    EXPECT_GE(d.within(0.1, 1), 0.9);
    EXPECT_GE(d.within(0, 1.2), 0.97);
    EXPECT_LE(d.quantile(1), 2.5);  // transients that come and go between two estimates, far below what was asked
    for (const Honesty& h : d.all) EXPECT_LE(h.error, h.asked);
}

}  // namespace tubule::axisym::estimate_test
