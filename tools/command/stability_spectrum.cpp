// Numerical spectra of profiles of tier axisym.
#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <stdexcept>

#include "axisym/curve/curve_frame.hpp"
#include "axisym/equilibrium/spectrum.hpp"
#include "common/result/frame_profile.hpp"
#include "tools/command/json.hpp"
#include "tools/command/stability.hpp"
#include "tools/command/text.hpp"

namespace tubule {

namespace {

struct Found {
    Problem problem;
    axisym::Spectrum spectrum;
};

// What the case says is held, where it looked for an equilibrium.
Held held_in(const Problem& c, const MotionLaw& law) {
    return c.equilibrium && !law.inextensible ? c.held : axisym::held_by(law);
}

std::string words_of(const std::vector<Found>& found) {
    std::string out;
    for (const auto& [problem, spectrum] : found) {
        out += fmt::format("{}{}\n", out.empty() ? "" : "\n", words_of_model(problem));
        if (spectrum.at_rest())
            add(out, "  at rest with tension {:.8g}, pressure {:.8g}\n", spectrum.sigma, -spectrum.lambda);
        else
            out += "  in motion: growth rates hold at this instant only\n";
        out += fmt::format("    m {:>14} ...\n", "rates");
        if (problem.law.free_period) out += "    0   left out: such waves change the free period\n";
        const axisym::ModeRates* fastest = nullptr;
        for (const axisym::ModeRates& mode : spectrum.modes) {
            out += fmt::format("{:>5}", mode.m);
            for (const double rate : mode.rates) add(out, " {:>14.7g}", rate);
            out += mode.stable() ? "\n" : "  grows\n";
            if (!mode.rates.empty() && (!fastest || mode.rates[0] > fastest->rates[0])) fastest = &mode;
        }
        if (fastest && !fastest->stable())
            out += fmt::format("  fastest: m = {}, rate {:.7g}, e-fold in {:.6g}\n", fastest->m, fastest->rates[0],
                               1 / fastest->rates[0]);
        else if (fastest)
            out += fmt::format("  none grows; slowest to decay: m = {}, rate {:.7g}\n", fastest->m, fastest->rates[0]);
        out += std::isfinite(spectrum.estimated_error)
                   ? fmt::format("  estimated error of the rates {:.1e} (relative)", spectrum.estimated_error)
                   : std::string("  error of the rates unknown: only the finest mesh was fine enough");
        out += fmt::format(", {} elements\n", spectrum.elements);
    }
    return out;
}

std::string csv_of(const std::vector<Found>& found) {
    std::string out = "model,m,number,rate\n";
    for (const auto& [problem, spectrum] : found)
        for (const axisym::ModeRates& mode : spectrum.modes)
            for (std::size_t i = 0; i < mode.rates.size(); ++i)
                add(out, "{},{},{},{:.17g}\n", name(problem.model), mode.m, i, mode.rates[i]);
    return out;
}

std::string json_text(const std::vector<Found>& found) {
    Json models = Json::array();
    for (const auto& [problem, spectrum] : found) {
        Json modes = Json::array();
        for (const axisym::ModeRates& mode : spectrum.modes)
            modes.push_back({{"m", mode.m}, {"rates", mode.rates}, {"shape", mode.shape}});
        models.push_back({{"model", name(problem.model)},
                          {"at_rest", spectrum.at_rest()},
                          {"tension", spectrum.sigma},
                          {"pressure", -spectrum.lambda},
                          {"estimated_error", spectrum.estimated_error},
                          {"elements", spectrum.elements},
                          {"modes", modes}});
    }
    return line_of({{"shape", "profile"}, {"models", models}});
}

}  // namespace

std::string spectrum_report(const StabilityOptions& options, const StabilitySubject& subject,
                            const std::vector<Problem>& models) {
    const Curve shape = subject.frame ? meridian(frame_curve(*subject.frame)) : axisym::initial_curve(subject.c);
    axisym::SpectrumSettings settings;
    settings.last = options.modes, settings.count = options.rates;
    std::vector<Found> found;
    std::string refused;
    const double time = subject.frame && !subject.c.equilibrium ? subject.frame->time : 0;  // of loads that change
    for (const Problem& problem : models) try {
            const MotionLaw& law = problem.law;
            const Held held = held_in(subject.c, law);
            settings.sigma = options.tension;
            settings.first = law.free_period ? 1 : 0;
            axisym::set_loads(settings, law, held, time);
            found.push_back({problem, axisym::spectrum(subject.c.energy, law, held, shape, settings)});
        } catch (const std::invalid_argument& error) {
            if (models.size() == 1) throw;
            refused += fmt::format("\n{}: none: {}\n", name(problem.model), error.what());
        }
    switch (options.output()) {
        case Output::csv:
            return csv_of(found);
        case Output::json:
            return json_text(found);
        default:
            return words_of(found) + refused;
    }
}

}  // namespace tubule
