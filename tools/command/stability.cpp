// tubule stability FILE: growth rates of waves, in closed form for tubes and spheres, numerically for other shapes of
// tier axisym, fitted for results.
#include "tools/command/stability.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <numeric>
#include <stdexcept>
#include <variant>

#include "axisym/equilibrium/equilibrium_run.hpp"
#include "axisym/equilibrium/profile_modes.hpp"
#include "common/case/read.hpp"
#include "common/case/text.hpp"
#include "common/result/frame_profile.hpp"
#include "common/result/record.hpp"
#include "common/solve/interrupt.hpp"
#include "common/solve/message.hpp"
#include "common/solve/pause.hpp"
#include "common/solve/sparse.hpp"
#include "tools/command/commands.hpp"
#include "tools/command/options.hpp"
#include "tools/command/output.hpp"
#include "tools/command/python.hpp"
#include "tools/run/continuation.hpp"

namespace tubule {

void require_within(const std::string& option, double value, double low, double high) {
    if (!(low <= value && value <= high))
        throw std::invalid_argument(fmt::format("{} must be from {:g} to {:g}, not {:g}", option, low, high, value));
}

std::string words_of_model(const Problem& c) {
    const Model& model = c.model;
    std::string text = name(model);
    const ModelEntry& has = model_entry(model.kind);
    const double friction = c.law.friction;
    if (has.viscous) text += fmt::format(", Re = {:g}", model.Re);
    if (has.viscous || friction != 1) text += fmt::format(", gamma = {:g}", friction);
    if (model.keeps_volume) text += *model.keeps_volume ? ", volume fixed" : ", volume free";
    if (model.area && model.area != area_rule({.kind = model.kind, .keeps_volume = {}}))
        text += model.area == AreaRule::fixed ? ", area fixed" : ", membrane from a reservoir";
    if (model.free_period) text += ", period free";
    return text;
}

double mean_square(double kT, double eigenvalue, double scale, double area, const std::string& mode) {
    constexpr double rounding = 1e-12;
    if (eigenvalue > rounding * scale) return kT / (eigenvalue * area);
    throw std::invalid_argument(
        eigenvalue < -rounding * scale
            ? fmt::format(
                  "--kT needs a minimum: {} lowers the energy, with the eigenvalue {:.6g} of the second variation",
                  mode, eigenvalue)
            : fmt::format("--kT needs a minimum: {} is neutral, its mean square has no bound; hold what it changes, or "
                          "choose another --tension",
                          mode));
}

void refuse_motion(const std::string& why) {
    throw std::invalid_argument("--kT needs an equilibrium: " + why);
}

namespace {

// The exit status of the script, which has said why.
struct NoPicture {
    int status;
};

bool is_result(const std::string& file) {
    return std::filesystem::path(file).extension() == ".hdf";
}

StabilitySubject subject_of(const StabilityOptions& options) {
    if (!is_result(options.file)) return {read_case(options.file, options.sets)};
    if (!options.sets.empty())
        throw std::invalid_argument("--set needs a case: the case of a result cannot be changed");
    std::optional<Result> result;
    try {
        result = read_result(options.file);
    } catch (const std::runtime_error& error) {
        throw std::invalid_argument(error.what());
    }
    return stability_subject(std::move(*result), options);
}

// Another model with what it has by default; where both are inextensible, with what the case holds and its loads.
Model with_kind(const Model& own, ModelKind kind) {
    if (model_entry(kind).inextensible && model_entry(own.kind).inextensible) {
        Model model = own;
        model.kind = kind;
        const bool rubs = own.kind == ModelKind::automatic && own.gamma.value_or(0) > 0;  // whichever is chosen
        if (model_entry(kind).viscous != model_entry(own.kind).viscous && !rubs) model.gamma.reset();
        return model;
    }
    return {.kind = kind, .Re = own.Re, .gamma = own.gamma, .keeps_volume = {}};
}

std::vector<std::string> model_names() {
    std::vector<std::string> names;
    for (const ModelEntry& m : models)
        if (m.kind != ModelKind::automatic) names.emplace_back(m.name);
    names.emplace_back("all");
    return names;
}

// The case with each model that is asked about.
std::vector<Problem> models_of(const StabilityOptions& options, const Problem& c) {
    const Model& own = c.model;
    const bool all = options.model == "all";
    std::vector<Problem> models;
    bool viscous = false, inextensible = false;
    for (const ModelEntry& other : tubule::models) {
        if (other.kind == ModelKind::automatic) continue;
        if (!all && (options.model.empty() ? other.kind != own.kind : options.model != other.name)) continue;
        Case changed = c;
        Model& model = changed.model;
        if (other.kind != own.kind) model = with_kind(own, other.kind);
        if (options.Re) model.Re = *options.Re;
        // Without viscosity or friction nothing would resist: with --model all, such a model keeps its own.
        if (options.gamma && (other.viscous || (other.inextensible && *options.gamma > 0)))
            model.gamma = *options.gamma;
        viscous = viscous || other.viscous, inextensible = inextensible || other.inextensible;
        models.emplace_back(changed);
    }
    if (!viscous && options.Re)
        throw std::invalid_argument("--Re is only valid with --model \"stokes\", \"fluid\" or \"all\"");
    if (!inextensible && options.gamma)
        throw std::invalid_argument(
            "--gamma is only valid with --model \"overdamped\", \"stokes\", \"fluid\" or \"all\"");
    if (!viscous && options.gamma && !(*options.gamma > 0))
        throw std::invalid_argument("--gamma must be > 0 with --model \"overdamped\": nothing else resists the motion");
    return models;
}

// The shape of a time-dependent case, if its waves are known in closed form.
std::optional<TubeSubject> tube_of(const Problem& c) {
    const Tube* shape = std::get_if<Tube>(&c.shape);
    if (!shape || c.equilibrium) return std::nullopt;
    TubeSubject out;
    out.tube = {theory::on_tube(c.energy, shape->length), shape->radius, 0};
    out.length = shape->length, out.end = c.time.end;
    for (const TubeMode& mode : shape->modes)
        if (mode.n == 0 && mode.m == 0)
            out.tube.radius += mode.amplitude * std::cos(mode.phase);
        else if (mode.amplitude != 0)
            out.waves.push_back(mode);
    if (!std::isfinite(density(out.tube.energy, -1 / out.tube.radius, 0.0).f))
        throw complaint(c, "energy.term",
                        fmt::format("is not defined on the straight tube of radius {:.6g}", out.tube.radius));
    std::sort(out.waves.begin(), out.waves.end(),
              [](const TubeMode& a, const TubeMode& b) { return std::abs(a.amplitude) > std::abs(b.amplitude); });
    return out;
}

std::optional<double> mean_of(const Record& frame, const std::string& array) {
    const Array* found = find_array(frame, array);
    if (!found || found->data.empty()) return std::nullopt;
    return std::accumulate(found->data.begin(), found->data.end(), 0.0) / static_cast<double>(found->data.size());
}

// A frame that is a straight tube, to a thousandth of its radius.
std::optional<TubeSubject> tube_of(const Problem& c, const Record& frame) {
    const Curve profile = meridian(frame_curve(frame));
    if (profile.topology != Topology::tube || !(profile.length > 0)) return std::nullopt;
    TubeSubject out;
    out.tube = {theory::on_tube(c.energy, profile.length), axisym::mean_radius(profile), 0};
    out.length = profile.length;
    for (int i = 0; i < 400; ++i)
        if (std::abs(profile.at(i / 400.0)[0] - out.tube.radius) > 1e-3 * out.tube.radius) return std::nullopt;
    if (const auto tension = find_number(frame, "tension"))
        out.tension = *tension, out.tension_source = "tension of the frame";
    if (const auto pressure = mean_of(frame, "p"))
        out.tension = -*pressure, out.tension_source = "minus the mean pressure of the frame";
    return out;
}

// The shape that a case with [equilibrium] finds, as a frame.
Record equilibrium_frame(const Problem& given) {
    struct Keep : RunObserver {
        std::vector<Record> frames;
        void frame(const std::function<Record()>& make) override { frames.push_back(make()); }
    } keep;
    Case c = given;
    c.equilibrium->modes.reset();
    c.equilibrium->branch = {};
    const auto summary = axisym::run_equilibrium(c, keep);
    if (summary.stop.reason != Stop::finished)
        throw SolveError(
            fmt::format("{}: no equilibrium: {}: {}", c.path, name(summary.stop.reason), summary.stop.message));
    return keep.frames.back();
}

std::string answer_for(const StabilityOptions& options, StabilitySubject subject) {
    if (subject.c.energy.H0_varies() || (subject.frame && find_array(*subject.frame, "H0")))
        throw complaint_about_H0(subject.c, "must be a number for growth rates; run the case instead");
    if (!options.fit.empty()) return fit_report(options, subject);
    if (subject.c.model.kind == ModelKind::automatic && options.model.empty())
        throw complaint(subject.c, "model.kind", "must not be \"auto\" for growth rates: name a model with --model");
    const std::vector<Problem> models = models_of(options, subject.c);
    std::optional<TubeSubject> tube;
    if (subject.frame ? subject.frame->mesh.has_value() : subject.c.unknowns == Unknowns::surface_equilibrium)
        return surface_report(options, subject, models);
    // Closed forms have a pressure that does not change with the volume, and nothing that acts at places.
    const bool closed_form = !options.numerical && !subject.c.model.pressure_of_volume &&
                             subject.c.energy.potentials.empty() && !subject.c.law.beads;
    if (closed_form) tube = subject.frame ? tube_of(subject.c, *subject.frame) : tube_of(subject.c);
    if (tube) {
        tube->scales = known_scales(subject.c);
        if (options.tension) tube->tension = options.tension, tube->tension_source = "as asked";
        if (!options.plot.empty())
            if (const int status = draw_by_script("stability", "stability", {"--output", options.plot},
                                                  tube_curves(options, *tube, models)))
                throw NoPicture{status};
        return tube_report(options, *tube, models);
    }
    if (!options.plot.empty() || !options.q.empty())
        throw std::invalid_argument("--plot and --q apply only to straight tubes, in closed form");
    const Sphere* sphere = std::get_if<Sphere>(&subject.c.shape);
    if (sphere && !subject.frame && closed_form && !subject.c.equilibrium && sphere->modes.empty())
        return sphere_report(options, {subject.c.energy, sphere->radius, options.tension.value_or(0)},
                             known_scales(subject.c), models);
    if (options.waves) throw std::invalid_argument("--waves applies only to tubes and spheres, in closed form");
    if (subject.c.unknowns == Unknowns::surface || subject.c.unknowns == Unknowns::moving_surface)
        throw std::invalid_argument(
            "a surface in motion has rates only if it is a straight tube or sphere: give its result, or a case with "
            "[equilibrium]");
    if (subject.c.equilibrium && !subject.frame) subject.frame = equilibrium_frame(subject.c);
    return spectrum_report(options, subject, models);
}

// The one place that knows what each option may be, for the command and for Python.
void refuse_values(const StabilityOptions& o) {
    require_within("--modes", o.modes, 0, most_modes);
    if (o.rates) require_within("--rates", *o.rates, 1, 100);
    if (o.waves) require_within("--waves", *o.waves, 1, 10000);
    if (o.tension) require_within("--tension", *o.tension, -largest_number, largest_number);
    if (o.Re) require_within("--Re", *o.Re, 1 / largest_number, largest_number);
    if (o.gamma) require_within("--gamma", *o.gamma, 0, largest_number);
    if (o.kT) require_within("--kT", *o.kT, 0, largest_number);
    const std::vector<std::string> names = model_names();
    if (o.model.empty() || std::find(names.begin(), names.end(), o.model) != names.end()) return;
    throw std::invalid_argument(fmt::format("--model must be one of {}, not '{}'{}", fmt::join(names, ", "), o.model,
                                            meant_by(o.model, names)));
}

void refuse_contradictions(const StabilityOptions& o, bool of_result) {
    if (!of_result && !o.fit.empty())
        throw std::invalid_argument("--fit needs a result, NAME.hdf, not a case: run it first");
    if (!of_result && o.frame) throw std::invalid_argument("--frame needs a result, NAME.hdf, not a case");
    if (!o.q.empty() && o.waves)
        throw std::invalid_argument("--q and --waves exclude each other: both choose the waves");
    if (!o.fit.empty() && (!o.q.empty() || o.waves || o.tension || o.frame || o.numerical || !o.plot.empty() ||
                           !o.model.empty() || o.Re || o.gamma || o.kT))
        throw std::invalid_argument("--fit can only be combined with --csv and --json");
}

}  // namespace

std::string stability_answer(const StabilityOptions& options, StabilitySubject subject) {
    refuse_values(options);
    refuse_contradictions(options, subject.result.has_value());
    return answer_for(options, std::move(subject));
}

namespace {

int stability(const StabilityOptions& options) {
    catch_interrupts();
    const PauseWatch watch(std::nullopt, interrupted);
    try {
        print_answer(stability_answer(options, subject_of(options)));
        return 0;
    } catch (const NoPicture& failure) {
        return failure.status;
    } catch (const std::invalid_argument& error) {
        return refuse_file(options.file, error.what());
    }
}

}  // namespace

StabilitySubject stability_subject(Result result, const StabilityOptions& options) {
    StabilitySubject subject;
    subject.result = std::move(result);
    try {
        const CaseText& of = subject.result->case_text;
        subject.c = parse_case(of.text, of.sets, options.file, of.inputs);
    } catch (const CaseError&) {
        if (options.fit.empty()) throw;
        subject.case_is_known = false;
    }
    if (options.fit.empty()) try {
            subject.frame = subject.result->frames[frame_named(*subject.result, options.frame.value_or(-1))];
        } catch (const std::runtime_error& error) {
            throw std::invalid_argument(error.what());
        }
    return subject;
}

void add_stability(CLI::App& app, int& exit_status) {
    CLI::App* command = app.add_subcommand(
        "stability", "Growth rates of waves: in closed form, of any profile or stationary surface, or fitted");
    const auto o = std::make_shared<StabilityOptions>();
    finds_installed_cases(*command->add_option("FILE", o->file, "a case, or a result NAME.hdf")->required());
    command->add_option("--set", o->sets, "override a key of the case, such as --set energy.k42=0.06")
        ->allow_extra_args(false);
    command->add_option("--model", o->model, "another model than the case's, or all")
        ->type_name(fmt::format("TEXT:{{{}}}", fmt::join(model_names(), ",")));
    command->add_option("--Re", o->Re, "of viscous models, where the case has none");
    command->add_option("--gamma", o->gamma, "friction of all models but gradient flow, where the case has none");
    command->add_option("--tension", o->tension, "another tension (default: from model, case and shape)");
    command->add_option("--kT", o->kT,
                        "also mean squares of amplitudes at this temperature, kT in the case's unit of energy");
    command->add_option("--modes", o->modes, "modes m = 0 ... this, up to 100")->capture_default_str();
    command->add_option("--waves", o->waves,
                        "tube: n = 0 ... this, up to 10000; sphere: l (default: all that grow, and some)");
    command->add_option("--q", o->q, "tube: these wave numbers instead, as 0.5,1,1.5 or from:to:count");
    command->add_option("--rates", o->rates,
                        "other shapes: how many rates for each m (3), or of a surface in all (10), up to 100");
    command->add_option("--frame", o->frame, "of a result (default: -1, the last one)");
    command->add_flag("--numerical", o->numerical, "the numerical spectrum, also for tubes and spheres");
    command->add_option("--fit", o->fit, "n[,m]: the growth rate of this wave (of a closed shape l[,m]) in a result");
    CLI::Option* csv = command->add_flag("--csv", o->csv, "the table, in full precision");
    command->add_flag("--json", o->json, "everything, in full precision")->excludes(csv);
    command->add_option("--plot", o->plot, "tube: draws rates over wave numbers, to a .svg, .png or .pdf");
    end_help(*command,
             {"tubule stability cases/tube_waves_fluid.toml --modes 3", "tubule stability figure.hdf --fit 1 --csv"},
             {{0}, {2}, {4, "the rates could not be computed"}}, {"stability"});
    command->callback([o, &exit_status] { exit_status = stability(*o); });
}

}  // namespace tubule
