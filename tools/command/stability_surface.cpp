// The slowest modes of a stationary surface in three dimensions.
#include <fmt/format.h>

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

bool flows_without_inertia(const Model& model) {
    return model_entry(model.kind).inextensible && model.kind != ModelKind::fluid;
}

// The surface that the case looks for, or that nearest to the frame, with what the case holds. A fluid, whose inertia
// the rates would neglect, is asked for those of gradient flow: the signs are the same.
Problem problem_of(const StabilityOptions& options, const StabilitySubject& subject, const Model& model) {
    Case c = subject.c;
    const bool flows = flows_without_inertia(model);
    if (flows) c.model = model;
    c.tier = Tier::surface3d;
    if (!c.equilibrium) c.equilibrium.emplace();
    EquilibriumChoices& e = *c.equilibrium;
    e.held = subject.c.equilibrium ? subject.c.held : default_held(subject.c.model);
    e.family.reset(), e.modes.reset();
    e.branch = {};
    e.rates = options.rates.value_or(10);
    c.time = {}, c.velocity = {}, c.expect = {};
    if (c.model.kind == ModelKind::fluid) c.model.kind = ModelKind::stokes;
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
    for (int i = 1; i <= *c.equilibrium->rates; ++i)
        out.modes.push_back({out.values.at(fmt::format("rate_{}", i)),
                             static_cast<int>(out.values.at(fmt::format("wave_number_{}", i))),
                             out.values.at(fmt::format("rate_error_{}", i))});
    return out;
}

std::string words_of(const SurfaceModes& found, const std::optional<Scales>& scales) {
    const auto value = [&](const char* name) { return found.values.at(name); };
    const LabUnit energy = lab_unit(scales, "energy");
    std::string out = found.model + "\n";
    add(out, "  stationary, with energy {:.8g} +- {:.1e}{}, tension {}, pressure {}\n", value("energy") * energy.scale,
        value("energy_error") * energy.scale, energy.after(),
        with_unit(value("tension"), lab_unit(scales, "energy/length^2"), 8),
        with_unit(value("pressure"), lab_unit(scales, "energy/length^3"), 8));
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
    std::string out = fmt::format("    number    m           rate    e-fold in{}\n", errors ? "     error" : "");
    if (scales) add(out, "    {:>6} {:>4} {:>14} {:>12}\n", "", "", rates.name, times.name);
    for (std::size_t i = 0; i < modes.size(); ++i) {
        const auto& [rate, m, error] = modes[i];
        add(out, "    {:>6} {:>4} {:>14.7g} {:>12.6g}{}{}\n", i + 1, m < 0 ? "-" : std::to_string(m),
            rate * rates.scale, times.scale / std::abs(rate),
            errors ? fmt::format(" {:>9.1e}", error * rates.scale) : "", rate > 0 ? "  grows" : "");
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
        if (models.size() > 1 && one.model.kind == ModelKind::fluid) continue;
        found.push_back(modes_of(problem_of(options, subject, one.model)));
        found.back().model = flows_without_inertia(one.model) ? name(one.model) : "gradient-flow";
        int number = 0;
        for (const auto& [rate, m, error] : found.back().modes)
            modes.push_back(
                {{"model", found.back().model}, {"number", ++number}, {"m", m}, {"rate", rate}, {"rate_error", error}});
    }
    if (options.csv) return csv_of({"model", "number", "m", "rate", "rate_error"}, modes);
    if (options.json) return json_text(found.front(), modes);
    std::string out;
    for (const SurfaceModes& one : found) out += words_of(one, known_scales(subject.c));
    return out;
}

}  // namespace tubule
