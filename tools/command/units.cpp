// tubule units FILE: what the dimensionless numbers of a case or of a result stand for.
#include "tools/command/units.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <vector>

#include "common/case/read.hpp"
#include "common/series/catalogue.hpp"
#include "tools/command/commands.hpp"
#include "tools/command/options.hpp"
#include "tools/command/output.hpp"
#include "tools/run/continuation.hpp"
#include "tools/scan/scan_file.hpp"

namespace tubule {

std::optional<Scales> shown_scales(const CaseText& of, const std::string& file, const std::string& option) {
    if (option == "none") return std::nullopt;
    std::vector<std::string> sets = of.sets;
    if (!option.empty())
        for (const std::string& part : split(option, ',')) {
            if (part.find('=') == part.npos)
                throw CaseError(fmt::format(
                    "--units must be none, or key=value,... as in \"length=50 nm,bending_rigidity=20 kT\", not {}",
                    toml_string(option)));
            sets.push_back("units." + part);
        }
    try {
        return known_scales(parse_case(of.text, sets, file, of.inputs));
    } catch (const CaseError&) {
        if (!option.empty()) throw;
        return std::nullopt;
    }
}

std::string with_unit(double value, const LabUnit& unit, int digits) {
    return fmt::format("{:.{}g}{}", plain(value * unit.scale), digits, unit.after());
}

Json json_of(const Scales& scales) {
    Json units = Json::object();
    const auto add_unit = [&](std::string_view dimensions) {
        const LabUnit unit = lab_unit(scales, dimensions);
        if (!unit.name.empty()) units[std::string(dimensions)] = {{"scale", unit.scale}, {"unit", unit.name}};
    };
    for (const SeriesEntry& entry : series_catalogue) add_unit(entry.unit);
    for (const char* of_frames : {"1/length^2", "1/time"}) add_unit(of_frames);
    return units;
}

namespace {

struct UnitsOptions {
    std::string file;
    std::vector<std::string> sets;
    bool json = false;
};

Case case_of(const UnitsOptions& o) {
    if (!is_hdf5(o.file)) return read_case(o.file, o.sets);
    CaseText text = as_bad_input([&]() -> CaseText {
        if (!is_scan(o.file)) return read_case_text(o.file);
        const Scan scan = read_scan_result(o.file).scan;
        return {scan.case_text, scan.sets, scan.inputs};
    });
    text.sets.insert(text.sets.end(), o.sets.begin(), o.sets.end());
    return parse_case(text.text, text.sets, o.file, text.inputs);
}

// What would fix the unit of time.
std::string missing(const Model& model) {
    const ModelEntry& has = model_entry(model.kind);
    std::string keys;
    if (has.inertia) keys += "units.density, ";
    if (has.viscous) keys += "units.viscosity, ";
    return fmt::format("{}units.friction", keys.empty() ? "" : keys.substr(0, keys.size() - 2) + " or ");
}

// Properties of the membrane that follow from the unit of time and the numbers of the model.
void add_properties(Text& out, const Case& c, const Scales& s) {
    const double R = s.length, eta = s.energy * s.time.value_or(0) / (R * R);
    const ModelEntry& has = model_entry(c.model.kind);
    const double gamma = c.model.gamma.value_or(has.inextensible ? 0 : 1);
    if (!c.energy.H0_varies() || s.time) add(out, "numbers of the case\n");
    if (!c.energy.H0_varies())
        add(out, "  {:<12} {:<20} c0 = -H0/length\n", "curvature", with_unit(-c.energy.H0, lab_unit(s, "1/length"), 4));
    if (!s.time) return;
    if (has.viscous)
        add(out, "  {:<12} {:<20} model.Re = {:g}\n", "viscosity", fmt::format("{:.4g} Pa s m", eta / c.model.Re),
            c.model.Re);
    if (gamma > 0)
        add(out, "  {:<12} {:<20} {} = {:g}\n", "friction", fmt::format("{:.4g} Pa s/m", gamma * eta / (R * R)),
            has.inextensible ? "model.gamma" : "of the gradient flow", gamma);
    if (has.inertia)
        add(out, "  {:<12} {:<20} rho = 1\n", "density", fmt::format("{:.4g} kg/m^2", eta * *s.time / (R * R)));
}

std::string table(const Case& c, const Scales& s, const std::string& file) {
    Text out;
    const auto row = [&](const char* name, const char* dimensions, const std::string& source) {
        add(out, "  {:<12} {:<20} {}\n", name, with_unit(1, lab_unit(s, dimensions), 4), source);
    };
    add(out, "{}: one unit of\n", file);
    row("length", "length", "units.length");
    row("energy", "energy", fmt::format("{:.4g} J; kT = {:.4g} J at {:.6g} K", s.energy, s.kT, s.temperature));
    row("tension", "energy/length^2", "energy/length^2");
    row("pressure", "energy/length^3", "energy/length^3");
    row("force", "energy/length", "energy/length");
    if (s.time) {
        row("time", "time", s.time_from);
        row("rate", "1/time", "1/time");
        row("velocity", "length/time", "length/time");
    } else {
        add(out, "  {:<12} not known: it takes {}\n", "time", missing(c.model));
    }
    add_properties(out, c, s);
    return to_string(out);
}

void units(const UnitsOptions& options) {
    const Case c = case_of(options);
    if (!c.units)
        throw CaseError(
            fmt::format("{}: has no table [units], which says what its numbers stand for; try --set "
                        "units.length=\"50 nm\" --set units.bending_rigidity=\"20 kT\"",
                        options.file));
    const Scales s = scales_of(c);
    if (!options.json) return print_answer(table(c, s, options.file));
    print_answer(line_of({{"file", options.file},
                          {"temperature", s.temperature},
                          {"kT", s.kT},
                          {"length", s.length},
                          {"energy", s.energy},
                          {"time", or_null(s.time)},
                          {"time_from", or_null(s.time_from)},
                          {"units", json_of(s)}}));
}

}  // namespace

void add_units(CLI::App& app, int&) {
    CLI::App* command =
        app.add_subcommand("units", "Print what the dimensionless numbers of a case with a table [units] stand for");
    const auto o = std::make_shared<UnitsOptions>();
    finds_installed_cases(*command->add_option("FILE", o->file, "a case, or a result NAME.hdf")->required());
    command->add_option("--set", o->sets, "override a key, such as --set units.length=\"1 um\"")
        ->allow_extra_args(false);
    command->add_flag("--json", o->json, "all units, in full precision: docs/schemas/units.json");
    end_help(*command, {"tubule units cases/units_tube.toml"}, {{0}, {2}}, {"case_files"});
    command->callback([o] { units(*o); });
}

}  // namespace tubule
