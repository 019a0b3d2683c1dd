// Numerical spectra of profiles of tier axisym.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "axisym/curve/curve_setup.hpp"
#include "axisym/equilibrium/spectrum.hpp"
#include "common/result/frame_profile.hpp"
#include "tools/command/output.hpp"
#include "tools/command/stability.hpp"
#include "tools/command/units.hpp"

namespace tubule {

namespace {

struct Found {
    Problem problem;
    axisym::Spectrum spectrum;
    std::optional<axisym::Spectrum> warm = {};  // of the second variation alone, its eigenvalues with a minus sign
};

// What the case says is held, where it looked for an equilibrium.
Held held_in(const Problem& c, const MotionLaw& law) {
    return c.equilibrium && !law.inextensible ? c.held : axisym::held_by(law);
}

// The slowest of all m, as many as of each, the fastest to grow first; those of m > 0 stand for cosine and sine.
std::vector<SlowMode> slowest(const axisym::Spectrum& spectrum) {
    std::vector<SlowMode> out;
    std::size_t most = 0;
    for (const axisym::ModeRates& mode : spectrum.modes) {
        most = std::max(most, mode.rates.size());
        for (const double rate : mode.rates) out.push_back({rate, mode.m});
    }
    std::stable_sort(out.begin(), out.end(), [](const SlowMode& a, const SlowMode& b) { return a.rate > b.rate; });
    out.resize(std::min(most, out.size()));
    return out;
}

// The mean square over the surface of all displacements of one m, with cosine and sine.
double of_all(double kT, const axisym::ModeRates& mode, double area) {
    return kT / area * (mode.m == 0 ? 1 : 2) * mode.softness;
}

std::vector<double> mean_squares(double kT, const axisym::ModeRates& mode, double area) {
    std::vector<double> out;
    for (const double rate : mode.rates) out.push_back(mean_square(kT, -rate, 0, area, fmt::format("m = {}", mode.m)));
    return out;
}

// The second variation under what is held, of a minimum for m = 0 ... 2 at least.
axisym::Spectrum second_variation(const Problem& c, const MotionLaw& law, Held held, const Curve& shape,
                                  axisym::SpectrumSettings settings) {
    constexpr double well_known = 1e-2, fine = 1e-10;  // the finest mesh: it lacks the least of the sum over all modes
    MotionLaw plain{.friction = 1, .inextensible = false, .keeps_volume = law.keeps_volume};
    plain.free_period = law.free_period, plain.beads = law.beads;
    const int asked = settings.last;
    settings.first = 0, settings.last = std::max(asked, 2), settings.accuracy = fine;
    axisym::Spectrum out = axisym::spectrum(c.energy, plain, held, shape, settings);
    if (!out.at_rest()) refuse_motion("this one moves");
    for (const axisym::ModeRates& mode : out.modes) mean_squares(0, mode, out.area);
    if (!(out.estimated_error < well_known))
        throw std::invalid_argument(fmt::format(
            "--kT needs a minimum: eigenvalues of the second variation are known to {:.1g} only, so that one "
            "of them may be neutral: hold more, or choose another --tension",
            out.estimated_error));
    out.modes.resize(asked + 1);
    return out;
}

void add_warm(std::string& out, double kT, const axisym::Spectrum& warm, const LabUnit& square) {
    out += fmt::format("  mean squares of a{}{}, for displacements a phi with INT phi^2 dS = A\n",
                       square.name.empty() ? "" : " in", square.after());
    out += fmt::format("    m {:>14} {:>14} ...\n", "of all phi", "of each phi");
    for (const axisym::ModeRates& mode : warm.modes) {
        add(out, "{:>5} {:>14.7g}", mode.m, of_all(kT, mode, warm.area) * square.scale);
        for (const double one : mean_squares(kT, mode, warm.area)) add(out, " {:>14.7g}", one * square.scale);
        out += "\n";
    }
    out += fmt::format("  estimated error {:.1e} (relative), {} elements\n", warm.estimated_error, warm.elements);
}

std::string words_of(const std::vector<Found>& found, double kT, const std::optional<Scales>& scales) {
    const LabUnit unit = lab_unit(scales, "1/time");
    std::string out;
    for (const auto& [problem, spectrum, warm] : found) {
        out += fmt::format("{}{}\n", out.empty() ? "" : "\n", words_of_model(problem));
        if (spectrum.at_rest())
            add(out, "  stationary, with tension {}, pressure {}\n",
                with_unit(spectrum.sigma, lab_unit(scales, "energy/length^2", spectrum.sigma), 8),
                with_unit(-spectrum.lambda, lab_unit(scales, "energy/length^3", spectrum.lambda), 8));
        else
            out += "  in motion: growth rates hold at this instant only\n";
        out += fmt::format("    m {:>14} ...{}{}\n", "rates", unit.name.empty() ? "" : " in", unit.after());
        if (problem.law.free_period) out += "    0   left out: such waves change the free period\n";
        for (const axisym::ModeRates& mode : spectrum.modes) {
            out += fmt::format("{:>5}", mode.m);
            for (const double rate : mode.rates) add(out, " {:>14.7g}", rate * unit.scale);
            out += mode.stable() ? "\n" : "  grows\n";
        }
        if (!spectrum.modes.empty())
            add(out, "  slowest of m = {} ... {}\n{}", spectrum.modes.front().m, spectrum.modes.back().m,
                words_of_modes(slowest(spectrum), scales));
        out += std::isfinite(spectrum.estimated_error)
                   ? fmt::format("  estimated error of the rates {:.1e} (relative)", spectrum.estimated_error)
                   : std::string("  error of the rates unknown: only the finest mesh was fine enough");
        out += fmt::format(", {} elements\n", spectrum.elements);
        if (warm) add_warm(out, kT, *warm, lab_unit(scales, "length^2"));
    }
    return out;
}

std::string csv_of_spectra(const std::vector<Found>& found, std::optional<double> kT) {
    Json rows = Json::array();
    for (const auto& [problem, spectrum, warm] : found)
        for (const axisym::ModeRates& mode : (kT ? *warm : spectrum).modes)
            for (std::size_t i = 0; i < mode.rates.size(); ++i) {
                rows.push_back({{"model", name(problem.model)}, {"m", mode.m}, {"number", i}, {"rate", mode.rates[i]}});
                if (kT) rows.back()["eigenvalue"] = -mode.rates[i];
                if (kT) rows.back()["mean_square"] = mean_squares(*kT, mode, warm->area)[i];
            }
    return kT ? csv_of({"model", "m", "number", "eigenvalue", "mean_square"}, rows)
              : csv_of({"model", "m", "number", "rate"}, rows);
}

Json json_of_warm(const axisym::Spectrum& warm, double kT) {
    Json out = Json::array();
    for (const axisym::ModeRates& mode : warm.modes) {
        Json each = Json::array();
        for (std::size_t i = 0; i < mode.rates.size(); ++i)
            each.push_back({{"eigenvalue", -mode.rates[i]},
                            {"mean_square", mean_squares(kT, mode, warm.area)[i]},
                            {"displacement", mode.displacements[i]}});
        out.push_back({{"m", mode.m}, {"mean_square_of_all", of_all(kT, mode, warm.area)}, {"eigenmodes", each}});
    }
    return out;
}

std::string json_text(const std::vector<Found>& found, double kT) {
    Json models = Json::array();
    for (const auto& [problem, spectrum, warm] : found) {
        Json modes = Json::array();
        for (const axisym::ModeRates& mode : spectrum.modes)
            modes.push_back({{"m", mode.m}, {"rates", mode.rates}, {"shape", mode.shape}});
        Json sorted = Json::array();
        for (const SlowMode& mode : slowest(spectrum)) sorted.push_back({{"m", mode.m}, {"rate", mode.rate}});
        models.push_back({{"model", name(problem.model)},
                          {"at_rest", spectrum.at_rest()},
                          {"tension", spectrum.sigma},
                          {"pressure", -spectrum.lambda},
                          {"estimated_error", spectrum.estimated_error},
                          {"elements", spectrum.elements},
                          {"modes", modes},
                          {"slowest", sorted},
                          {"fluctuations", warm ? json_of_warm(*warm, kT) : Json()}});
    }
    return line_of({{"shape", "profile"}, {"models", models}});
}

}  // namespace

std::string spectrum_report(const StabilityOptions& options, const StabilitySubject& subject,
                            const std::vector<Problem>& models) {
    const Curve shape = subject.frame ? meridian(frame_curve(*subject.frame)) : axisym::initial_curve(subject.c);
    axisym::SpectrumSettings settings;
    settings.last = options.modes, settings.count = options.rates.value_or(3);
    std::vector<Found> found;
    std::string refused;
    const double time = subject.frame && !subject.c.equilibrium ? subject.frame->time : 0;  // of loads that change
    for (const Problem& problem : models) try {
            const MotionLaw& law = problem.law;
            const Held held = held_in(subject.c, law);
            settings.sigma = options.tension;
            settings.first = law.free_period ? 1 : 0;
            axisym::set_loads(settings, law, held, time);
            Found one{problem, axisym::spectrum(subject.c.energy, law, held, shape, settings)};
            if (options.kT) one.warm = second_variation(subject.c, law, held, shape, settings);
            found.push_back(std::move(one));
        } catch (const std::invalid_argument& error) {
            if (models.size() == 1) throw;
            refused += fmt::format("\n{}: none: {}\n", name(problem.model), error.what());
        }
    if (options.csv) return csv_of_spectra(found, options.kT);
    if (options.json) return json_text(found, options.kT.value_or(0));
    return words_of(found, options.kT.value_or(0), known_scales(subject.c)) + refused;
}

}  // namespace tubule
