// The slowest modes of a stationary surface in three dimensions.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <span>
#include <stdexcept>

#include "common/case/read.hpp"
#include "common/result/start_frame.hpp"
#include "common/solve/sparse.hpp"
#include "surface3d/run/equilibrium_run.hpp"
#include "tools/command/output.hpp"
#include "tools/command/stability.hpp"
#include "tools/command/units.hpp"

namespace tubule {

namespace {

struct SurfaceModes {
    std::string model;
    std::map<std::string, double> values;  // of the series, at the shape
    std::vector<SlowMode> modes;           // slowest first
};

// The surface that the case looks for, or that nearest to the frame, with what the case holds.
Problem problem_of(const StabilityOptions& options, const StabilitySubject& subject, const Model& model) {
    Case c = subject.c.of_surface();
    const bool flows = model_entry(model.kind).inextensible;
    if (flows) c.model = model;
    if (!c.equilibrium) c.equilibrium.emplace();
    EquilibriumChoices& e = *c.equilibrium;
    e.held = subject.c.equilibrium ? subject.c.held : default_held(subject.c.model);
    e.family.reset(), e.modes.reset();
    e.branch = {};
    e.rates = options.rates.value_or(10);
    c.time = {}, c.velocity = {}, c.expect = {};
    CaseInputs inputs;
    if (subject.frame) {
        const ResultFrame frame{.path = std::filesystem::path(options.file).filename().string(),
                                .frame = static_cast<int>(options.frame.value_or(-1))};
        c.shape = frame;
        c.surface = {};
        e.descend = false;
        inputs = {frame_as_input(frame, *subject.result)};
    }
    Problem out = parse_case(effective_toml(c), {}, c.path, inputs);
    if (!flows) out.law.inextensible = out.law.keeps_volume = false;
    return out;
}

SurfaceModes modes_of(const Problem& c) {
    struct Keep : RunObserver {
        std::vector<double> last;
        void row(std::span<const double> values) override { last.assign(values.begin(), values.end()); }
    } keep;
    const RunSummary summary = surface3d::run_equilibrium(c, surface3d::Start(c), keep);
    if (summary.stop.reason != Stop::finished)
        throw SolveError(
            fmt::format("{}: no equilibrium: {}: {}", c.path, name(summary.stop.reason), summary.stop.message));
    SurfaceModes out;
    const std::vector<std::string> names = surface3d::equilibrium_series_names(c);
    for (std::size_t i = 0; i < names.size(); ++i) out.values[names[i]] = keep.last[i];
    for (int i = 1; i <= *c.equilibrium->rates; ++i) {
        const auto value = [&](const char* series, double otherwise) {
            const auto found = out.values.find(fmt::format("{}_{}", series, i));
            return found == out.values.end() ? otherwise : found->second;
        };
        out.modes.push_back({value("rate", 0), static_cast<int>(value("wave_number", -1)), value("rate_error", -1),
                             value("frequency", 0), value("frequency_error", 0)});
    }
    return out;
}

std::string words_of(const SurfaceModes& found, const std::optional<Scales>& scales) {
    const auto value = [&](const char* name) { return found.values.at(name); };
    const LabUnit energy = lab_unit(scales, "energy");
    std::string out = found.model + "\n";
    add(out, "  stationary, with energy {:.8g} +- {:.1e}{}, tension {}, pressure {}\n", value("energy") * energy.scale,
        value("energy_error") * energy.scale, energy.after(),
        with_unit(value("tension"), lab_unit(scales, "energy/length^2", value("tension")), 8),
        with_unit(value("pressure"), lab_unit(scales, "energy/length^3", value("pressure")), 8));
    add(out, "  {:.0f} directions lower the energy under what is held\n", value("negative_directions"));
    out += words_of_modes(found.modes, scales);
    add(out, "  {:.0f} triangles\n", value("elements"));
    return out;
}

std::string json_text(const SurfaceModes& found, const Json& modes) {
    Json out{{"shape", "surface"}};
    for (const char* name : {"energy", "energy_error", "tension", "pressure"}) out[name] = found.values.at(name);
    for (const char* name : {"negative_directions", "elements"})
        out[name] = static_cast<std::int64_t>(found.values.at(name));
    out["modes"] = modes;
    return line_of(out);
}

}  // namespace

std::string words_of_modes(const std::vector<SlowMode>& modes, const std::optional<Scales>& scales) {
    const LabUnit rates = lab_unit(scales, "1/time"), times = lab_unit(scales, "time");
    const bool errors = !modes.empty() && modes.front().error >= 0;
    const bool oscillate = std::ranges::any_of(modes, [](const SlowMode& mode) { return mode.frequency > 0; });
    std::string out = fmt::format("    number    m           rate    e-fold in{}{}\n", errors ? "     error" : "",
                                  oscillate ? "      frequency     error" : "");
    if (scales) add(out, "    {:>6} {:>4} {:>14} {:>12}\n", "", "", rates.name, times.name);
    for (std::size_t i = 0; i < modes.size(); ++i) {
        const SlowMode& mode = modes[i];
        const auto words_of_error = [&](double error) {
            return error >= 0 ? fmt::format(" {:>9.1e}", error * rates.scale) : fmt::format(" {:>9}", "-");
        };
        add(out, "    {:>6} {:>4} {:>14.7g} {:>12.6g}{}{}{}\n", i + 1, mode.m < 0 ? "-" : std::to_string(mode.m),
            mode.rate * rates.scale, times.scale / std::abs(mode.rate), errors ? words_of_error(mode.error) : "",
            oscillate ? fmt::format(" {:>14.7g}", mode.frequency * rates.scale) + words_of_error(mode.frequency_error)
                      : "",
            mode.rate > 0 ? "  grows" : "");
    }
    return out;
}

std::string surface_report(const StabilityOptions& options, const StabilitySubject& subject,
                           const std::vector<Problem>& models) {
    const auto refuse = [](const char* option, const char* why) {
        throw std::invalid_argument(
            fmt::format("{} {} surfaces in three dimensions: {}", option, "does not apply to", why));
    };
    if (options.tension) refuse("--tension", "give model.tension in the case");
    if (options.kT) refuse("--kT", "only profiles of tier axisym, tubes and spheres have mean squares");
    if (options.numerical || options.waves || !options.q.empty() || !options.plot.empty())
        refuse("--numerical, --waves, --q and --plot", "their modes are found one by one, see --rates");
    std::vector<SurfaceModes> found;
    Json modes = Json::array();
    for (const Problem& one : models) {
        found.push_back(modes_of(problem_of(options, subject, one.model)));
        found.back().model = name(one.model);
        int number = 0;
        for (const SlowMode& mode : found.back().modes)
            modes.push_back({{"model", found.back().model},
                             {"number", ++number},
                             {"m", mode.m},
                             {"rate", mode.rate},
                             {"rate_error", mode.error},
                             {"frequency", mode.frequency},
                             {"frequency_error", mode.frequency_error}});
    }
    if (options.csv)
        return csv_of({"model", "number", "m", "rate", "rate_error", "frequency", "frequency_error"}, modes);
    if (options.json) return json_text(found.front(), modes);
    std::string out;
    for (const SurfaceModes& one : found) out += words_of(one, known_scales(subject.c));
    return out;
}

}  // namespace tubule
