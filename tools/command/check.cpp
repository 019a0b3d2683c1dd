// tubule check CASE... : reads and validates cases, and prints them with overrides applied and defaults written out.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <exception>
#include <memory>
#include <optional>
#include <regex>
#include <string>
#include <vector>

#include "common/case/complaints.hpp"
#include "common/case/read.hpp"
#include "common/case/text.hpp"
#include "common/solve/interrupt.hpp"
#include "common/solve/message.hpp"
#include "common/solve/pause.hpp"
#include "tools/command/commands.hpp"
#include "tools/command/options.hpp"
#include "tools/command/output.hpp"
#include "tools/run/advice.hpp"
#include "tools/run/case_checks.hpp"
#include "tools/run/engine.hpp"
#include "tools/run/forecast.hpp"
#include "tools/run/model_choice.hpp"

namespace tubule {

namespace {

struct CheckOptions {
    std::vector<std::string> cases, sets;
    bool quick = false, json = false;
};

// On one line, in UTF-8: the output must be a case whatever its file is called.
std::string shown_path(const std::string& path) {
    std::string shown = valid_utf8(path);
    for (char& c : shown)
        if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
    return shown;
}

// Keys that the case leaves to the program, and what it takes for them: defaults that depend on other keys.
std::vector<std::string> chosen(const Problem& c) {
    std::vector<std::string> out;
    if (c.unknowns != Unknowns::moving_surface && c.unknowns != Unknowns::surface) return out;
    if (!c.surface.order) out.push_back(fmt::format("discretisation.order = {}", c.element_order));
    if (c.unknowns == Unknowns::surface) return out;
    if (!c.surface.scheme) out.push_back(fmt::format("discretisation.scheme = \"{}\"", entry(c.scheme).name));
    if (!c.surface.time_tolerance && !c.surface.step)
        out.emplace_back("discretisation.time_tolerance follows from accuracy.energy");
    return out;
}

// What is known of a case: all that is wrong with it, or what it will take.
struct Checked {
    std::string path;
    std::vector<Complaint> complaints;
    std::string toml;                   // resolved
    std::vector<std::string> chosen;    // in words
    std::string model, model_reason;    // of model.kind = "auto"
    std::optional<Forecast> expected;   // with --quick nothing
    std::optional<Advice> advice;       // likewise
    std::string unknown;                // why nothing is expected
    std::vector<std::string> warnings;  // of its energy and its physics, each with its place
    bool valid() const { return complaints.empty(); }
};

// None where a trial run fails: the case is valid all the same.
std::optional<Advice> advice_for(const Problem& c, const Forecast& expected) {
    try {
        return advice(c, expected);
    } catch (const std::exception&) {
        return std::nullopt;
    }
}

// What model.kind = "auto" stands for: with --quick, without trial runs, a fluid.
Problem chosen_case(const Problem& c, const CheckOptions& options, Checked& out) {
    if (c.model.kind != ModelKind::automatic) return c;
    if (options.quick) return with_model(c, {ModelKind::fluid, ""}).c;
    if (const auto ill_posed = ill_posed_start(c)) throw *ill_posed;
    ChosenCase chosen = with_chosen_model(c);
    out.model = name(chosen.c.model), out.model_reason = chosen.reason;
    return std::move(chosen.c);
}

// Files that the case names are read as well.
Checked checked(const std::string& path, const CheckOptions& options) {
    Checked out;
    out.path = path;
    bool chooses = false;
    try {
        const Problem given = read_case(path, options.sets);
        chooses = given.model.kind == ModelKind::automatic;
        const PauseWatch watch(given.time.limit, interrupted);
        out.toml = effective_toml(given);
        if (const std::string falls = unbounded_below(given.energy); !falls.empty())
            out.warnings.push_back(fmt::format("{}: warning: {}", shown_path(path), falls));
        for (const std::string& note : physics_notes(given)) out.warnings.push_back(valid_utf8(note));
        const Problem c = chosen_case(given, options, out);
        out.chosen = chosen(c);
        if (const std::string warning = Engine(c).warning(); !warning.empty())
            out.warnings.push_back(fmt::format("{}: warning: {}", shown_path(path), warning));
        if (const auto ill_posed = ill_posed_start(c)) throw *ill_posed;
        if (!options.quick)
            out.expected = forecast(c);
        else if (const std::string file = input_name(c.shape);
                 !file.empty() && !std::holds_alternative<MeshFile>(c.shape))
            out.warnings.push_back(fmt::format("{}: note: {} is not read, because of --quick", shown_path(path), file));
        if (out.expected && out.expected->ill_posed.empty()) out.advice = advice_for(c, *out.expected);
        if (out.expected && !out.expected->ill_posed.empty())
            out.warnings.push_back(
                valid_utf8(ill_posed_complaint(c, "and a run ends at once", out.expected->ill_posed).what()));
    } catch (const CaseErrors& error) {
        out.complaints = error.complaints;
    } catch (const CaseError& error) {
        out.complaints = {{"", "", error.what(), ""}};
    } catch (const Paused& pause) {
        if (pause.reason == Stop::interrupted) throw;
        out.unknown = fmt::format("trial runs {}reach the time limit of {} s (time.limit)",
                                  chooses ? "that choose the model " : "", pause.limit.value());
    } catch (const std::exception& error) {
        out.unknown = explanation(error);
    }
    return out;
}

void tell(const Checked& c, bool quick) {
    if (!c.valid()) {
        for (const Complaint& one : c.complaints)
            say(stderr, "{}\n", printable(one.place + (one.place.empty() ? "" : ": ") + one.what));
        return;
    }
    std::string answer = fmt::format("# OK {}\n{}", shown_path(c.path), c.toml);
    if (!c.model.empty()) add(answer, "\n# chosen: model.kind = \"{}\": {}", c.model, c.model_reason);
    for (const std::string& words : c.chosen) add(answer, "\n# by default: {}", words);
    print_answer(answer + "\n");
    for (const std::string& warning : c.warnings) say(stderr, "{}\n", warning);
    // For people: the answer itself is the case, the same at each call.
    if (c.advice) say(stderr, "{}: advice: {}\n", shown_path(c.path), words(*c.advice));
    if (c.expected)
        say(stderr, "{}: expected: {}\n", shown_path(c.path), words(*c.expected));
    else if (!quick)
        say(stderr, "{}: expected: unknown: {}\n", shown_path(c.path), c.unknown);
}

// ---- JSON

// Its place also as file, line and column.
Json json_of(const Complaint& c) {
    static const std::regex form("([^]*):([0-9]+):([0-9]+)");
    std::smatch part;
    Json out{{"place", or_null(c.place)}, {"file", {}}, {"line", {}}, {"column", {}}};
    if (!c.place.starts_with("--set ") && std::regex_match(c.place, part, form))
        out["file"] = part[1].str(), out["line"] = std::stoi(part[2].str()), out["column"] = std::stoi(part[3].str());
    out["key"] = or_null(c.key);
    out["message"] = c.what;
    out["suggestion"] = or_null(c.suggestion);
    return out;
}

Json json_of(const Advice& a) {
    return {{"tier", a.tier},
            {"model", a.model},
            {"elements", or_null(a.elements)},
            {"accuracy", a.accuracy},
            {"seconds", or_null(a.seconds)},
            {"reason", a.reason}};
}

Json json_of(const Checked& c) {
    Json out{{"file", c.path},
             {"valid", c.valid()},
             {"errors", json_list(c.complaints, [](const Complaint& one) { return json_of(one); })},
             {"toml", or_null(c.valid() ? c.toml : "")},
             {"model", {}},
             {"chosen", c.chosen},
             {"expected", {}},
             {"advice", c.advice ? json_of(*c.advice) : Json()},
             {"unknown", or_null(c.unknown)},
             {"warning", or_null(fmt::format("{}", fmt::join(c.warnings, "\n")))}};
    if (!c.model.empty()) out["model"] = {{"kind", c.model}, {"reason", c.model_reason}};
    if (const auto& e = c.expected)
        out["expected"] = {{"resolution", e->resolution},
                           {"steps", or_null(e->steps)},
                           {"seconds", or_null(e->seconds)},
                           {"bytes", e->bytes},
                           {"finer_runs", e->finer_runs}};
    return out;
}

// All cases are looked at, so that one call tells all that is wrong. The output is itself a case (of one case).
int check(const CheckOptions& options) {
    catch_interrupts();
    const PauseWatch watch(std::nullopt, interrupted);
    int status = 0;
    Json cases = Json::array();
    for (const std::string& path : options.cases) {
        const Checked c = checked(path, options);
        if (!c.valid()) status = 2;
        if (options.json)
            cases.push_back(json_of(c));
        else
            tell(c, options.quick);
    }
    if (options.json) print_answer(line_of({{"cases", cases}}));
    return status;
}

}  // namespace

void add_check(CLI::App& app, int& exit_status) {
    CLI::App* command =
        app.add_subcommand("check", "Validate cases, print the resolved cases and what they are expected to take");
    const auto options = std::make_shared<CheckOptions>();
    finds_installed_cases(*command->add_option("CASE", options->cases, "case files")->required());
    command->add_option("--set", options->sets, "override a key, such as --set energy.k42=0.06")
        ->allow_extra_args(false);
    command->add_flag("--json", options->json, "as JSON, errors included: docs/schemas/check.json");
    command->add_flag("--quick", options->quick, "run nothing to tell steps, time and memory");
    end_help(*command,
             {"tubule check cases/peanut.toml", "tubule check cases/peanut.toml --set accuracy.energy=1e-6",
              "tubule check cases/peanut.toml --json --quick"},
             {{0, "all cases are valid"}, {2}, {130, "interrupted"}}, {"case_files"});
    command->callback([options, &exit_status] { exit_status = check(*options); });
}

}  // namespace tubule
