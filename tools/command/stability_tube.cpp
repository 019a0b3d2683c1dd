// Tubes and spheres in closed form.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "common/case/text.hpp"
#include "common/geometry/profile_point.hpp"
#include "common/solve/pause.hpp"
#include "common/solve/sparse.hpp"
#include "common/theory/waves.hpp"
#include "tools/command/output.hpp"
#include "tools/command/stability.hpp"
#include "tools/command/units.hpp"
#include "tools/scan/description.hpp"

namespace tubule {

namespace {

using theory::UniformTube;
struct Threshold {
    std::string name;
    int m = 0;
    bool grows_above = false;
    double tension = 0, q = 0;
};

struct WaveRow {
    int m = 0;
    std::optional<int> n;
    double q = 0;
    theory::Growth growth;
    std::optional<double> factor;  // by which it grows until the case ends
    std::optional<double> mean_square = {};
};

// One model's answer.
struct ModelReport {
    Problem problem;
    UniformTube tube;  // with the tension of this model
    std::string tension_source;
    std::vector<WaveRow> rows;
    std::vector<std::optional<theory::FastestWave>> fastest;  // of each m, any q
    std::optional<theory::FittingWave> fastest_fitting;
    std::optional<double> radius_at_end;
};

// ---- what is asked

double number(const std::string& text) {
    const auto value = number_of(text);
    if (!value) throw std::invalid_argument(fmt::format("--q: '{}' is not a number", text));
    return *value;
}

std::vector<double> wave_numbers(const std::string& text) {
    constexpr int most = 100000;
    if (std::count(text.begin(), text.end(), ',') >= most)
        throw std::invalid_argument(fmt::format("--q: more than {} wave numbers", most));
    std::vector<double> q;
    if (text.find(':') != std::string::npos) try {
            q = parse_range(text, most).evenly();
        } catch (const std::invalid_argument& error) {
            throw std::invalid_argument(fmt::format(
                "--q {}: {}; give from:to:count, 2 to {} wave numbers, or a list q1,q2,...", text, error.what(), most));
        }
    else
        for (const std::string& part : split(text, ',')) q.push_back(number(part));
    for (const double value : q)
        if (!(value >= 0 && value <= largest_number))
            throw std::invalid_argument(
                fmt::format("--q: wave numbers are >= 0 and at most {:g}, not {:g}", largest_number, value));
    return q;
}

// ---- answers

std::string instability(int m) {
    return m == 0 ? "pearling" : m == 1 ? "buckling" : m == 2 ? "ovalisation" : fmt::format("m = {}", m);
}

std::vector<Threshold> thresholds(const UniformTube& tube, int last) {
    std::vector<Threshold> out;
    for (int m = 0; m <= last; ++m) {
        const auto stable = theory::stable_tensions(tube, m);
        if (!stable) continue;
        if (std::isfinite(stable->highest))
            out.push_back({instability(m), m, true, stable->highest, stable->q_highest});
        if (std::isfinite(stable->lowest)) out.push_back({instability(m), m, false, stable->lowest, stable->q_lowest});
    }
    return out;
}

// What of m = 0 ... last grows in a tube that is long enough.
std::vector<std::string> instabilities(const UniformTube& tube, int last) {
    std::vector<std::string> names;
    for (int m = 0; m <= last; ++m)
        if (!theory::growing_bands(tube, m).empty()) names.push_back(instability(m));
    return names;
}

std::vector<theory::Wave> case_waves(const TubeSubject& subject) {
    std::vector<theory::Wave> waves;
    for (const TubeMode& mode : subject.waves) {
        const auto same = std::find_if(waves.begin(), waves.end(),
                                       [&](const auto& wave) { return wave.n == mode.n && wave.m == mode.m; });
        if (same == waves.end())
            waves.push_back({mode.n, mode.m, mode.amplitude, 0});
        else  // two phases of one wave: together a wave again
            same->amplitude = std::hypot(same->amplitude, mode.amplitude);
    }
    return waves;
}

void set_tension(const TubeSubject& subject, ModelReport& report) {
    const bool inextensible = report.problem.law.inextensible, asked = subject.tension_source == "as asked";
    const std::optional<double> own = theory::tension_of(report.problem.law, subject.tube.energy, subject.tube.radius);
    if (own && !report.problem.law.area_is_free()) {
        if (asked)
            throw std::invalid_argument(
                report.problem.law.keeps_volume
                    ? "--tension must be absent: with the period free, the axial force determines it"
                    : "--tension must be absent: with the volume free, the tube's balance determines it");
        report.tube.tension = *own;
        report.tension_source =
            report.problem.law.keeps_volume ? "by the axial force" : "of a tube whose volume is free";
    } else if (own && !subject.tension && (report.problem.law.reservoir || !report.problem.law.tension.is_zero())) {
        report.tube.tension = *own;
        report.tension_source = report.problem.law.loads_change() ? "of the case, at t = 0" : "of the case";
    } else if (subject.tension && (inextensible || subject.tension_source != "minus the mean pressure of the frame")) {
        report.tube.tension = *subject.tension, report.tension_source = subject.tension_source;
    } else if (inextensible && !subject.waves.empty()) {
        report.tube.tension =
            theory::tension_of_waves(subject.tube, report.problem.law, subject.length, case_waves(subject));
        report.tension_source = "keeps area and volume, given the modes of the initial shape";
    } else {
        report.tension_source =
            inextensible ? "not known without waves; choose with --tension" : "a gradient flow has none of its own";
    }
}

int waves_of_interest(const StabilityOptions& options, const ModelReport& report, double length) {
    if (options.waves) return *options.waves;
    double edge = 0;
    for (int m = 0; m <= options.modes; ++m)
        for (const theory::Band& band : theory::growing_bands(report.tube, m))
            if (std::isfinite(band.to)) edge = std::max(edge, band.to);
    return std::clamp(static_cast<int>(std::ceil(edge * length / (2 * pi))) + 1, 4, 40);
}

// Zero where only rounding is left.
double rounded(double value, double scale) {
    return std::abs(value) < 1e-12 * scale ? 0 : value;
}
double radius_rate_of(const ModelReport& report) {
    const auto& [energy, R, tension] = report.tube;
    return rounded(theory::radius_rate_of(report.problem.law, report.tube),
                   std::abs(density(energy, -1 / R, 0.0).HH) / (R * R * R));
}
// The k42 above which no wave of m = 0 grows: 2 k42 is its part of f_KK.
std::optional<double> least_k42_of(const UniformTube& tube) {
    const auto least = theory::least_f_KK(tube);
    if (!least) return least;
    const double R = tube.radius;
    Bending others = tube.energy;
    others.k[term_number("k42")] = 0;
    return rounded(*least - density(others, -1 / R, 0.0).KK, std::abs(density(tube.energy, -1 / R, 0.0).HH) * R * R) /
           2;
}

// By which factors the waves of the table have grown when the case ends, of an extensible membrane.
void add_factors(const TubeSubject& subject, ModelReport& report) {
    if (report.problem.law.inextensible || report.problem.law.loads_change() || !(subject.end > 0)) return;
    std::vector<theory::Wave> waves;
    for (const WaveRow& row : report.rows)
        if (row.n && (*row.n > 0 || row.m > 0)) waves.push_back({*row.n, row.m, 1, 0});
    if (waves.empty()) return;
    theory::WaveState end;
    try {
        end = theory::waves_in_time(report.tube, report.problem.law, subject.length, waves, {subject.end}).front();
    } catch (const SolveError&) {  // the radius vanishes, for one: the rates of this instant are right all the same
        return;
    }
    std::size_t k = 0;
    for (WaveRow& row : report.rows)
        if (row.n && (*row.n > 0 || row.m > 0)) row.factor = end.amplitudes[k++];
    report.radius_at_end = end.radius;
}

// For a tube that is a minimum for all waves that fit its length and m = 0 ... last.
void add_mean_squares(double kT, const TubeSubject& subject, int last, ModelReport& report) {
    const UniformTube& tube = report.tube;
    const MotionLaw& law = report.problem.law;
    if (theory::ill_posed_along(tube) || theory::ill_posed_around(tube))
        throw std::invalid_argument("--kT needs a minimum: short waves lower the energy without bound");
    if (const double rate = radius_rate_of(report); rate != 0)
        refuse_motion(fmt::format("the radius changes at the rate {:.6g}", rate));
    const auto of_wave = [&](double q, int m, const std::string& name) {
        const theory::Stiffness G = stiffness(tube, m);
        const double scale =
            ((std::abs(G.q6) * q * q + std::abs(G.q4)) * q * q + std::abs(G.q2)) * q * q + std::abs(G.q0);
        return mean_square(kT, G(q), scale, 2 * pi * tube.radius * subject.length, name);
    };
    if (law.area_is_free() && !law.keeps_volume) of_wave(0, 0, "a change of the radius");
    if (const auto wave = theory::fastest_fitting_wave(tube, law, subject.length, last))
        of_wave(wave->q, wave->m, fmt::format("n = {}, m = {}", wave->n, wave->m));
    for (WaveRow& row : report.rows)
        row.mean_square = of_wave(row.q, row.m, fmt::format("q = {:.6g}, m = {}", row.q, row.m));
}

ModelReport report_of(const StabilityOptions& options, const TubeSubject& subject, const Problem& model) {
    const MotionLaw& law = model.law;
    ModelReport report{model, subject.tube, "", {}, {}, {}, {}};
    set_tension(subject, report);
    const auto add_row = [&](std::optional<int> n, double q, int m) {
        check_pause();
        if (q == 0 && m < 2 && !(m == 0 && law.unconstrained())) return;  // its radius, or its place
        report.rows.push_back({m, n, q, theory::growth(report.tube, law, q, m), std::nullopt});
    };
    const int waves = waves_of_interest(options, report, subject.length);
    for (int m = 0; m <= options.modes; ++m) {
        if (!options.q.empty())
            for (const double q : wave_numbers(options.q)) add_row({}, q, m);
        else
            for (int n = 0; n <= waves; ++n) add_row(n, 2 * pi * n / subject.length, m);
        report.fastest.push_back(theory::fastest_wave(report.tube, law, m));
    }
    report.fastest_fitting = theory::fastest_fitting_wave(report.tube, law, subject.length, options.modes);
    if (!theory::ill_posed_along(subject.tube)) add_factors(subject, report);
    if (options.kT) add_mean_squares(*options.kT, subject, std::max(options.modes, 2), report);
    return report;
}

const WaveRow* fastest_row(const ModelReport& report) {
    const WaveRow* best = nullptr;
    for (const WaveRow& row : report.rows)
        if ((row.q > 0 || row.m > 0) && (!best || row.growth.rate() > best->growth.rate())) best = &row;
    return best;
}

std::string moduli(const Bending& energy) {
    std::string text;
    for_each_bending_term([&](std::size_t i, const auto& term) {
        if (energy.k[i] != 0) text += fmt::format("{} = {:g}, ", term.key, energy.k[i]);
    });
    for (const EnergyTerm& term : energy.terms)
        text += term.formula ? fmt::format("{:g} ({}), ", term.modulus, term.formula->text)
                             : fmt::format("k{} = {:g}, ", term_name(term), term.modulus);
    if (energy.kg != 0) text += fmt::format("kg = {:g}, ", energy.kg);
    text += fmt::format("H0 = {:g}", energy.H0);
    return energy.alpha ? text + fmt::format(", alpha = {:g}, M0 = {:g}", *energy.alpha, energy.M0) : text;
}

std::string ill_posed_words(const UniformTube& tube) {
    const bool along = theory::ill_posed_along(tube), around = theory::ill_posed_around(tube);
    if (!along && !around) return "";
    return fmt::format("ill-posed: short-wavelength modes {} grow the faster the shorter they are\n",
                       along && around ? "of any direction"
                       : along         ? "along the axis"
                                       : "in the circumferential direction");
}

// ---- words

// What words about waves are written in.
struct WaveUnits {
    explicit WaveUnits(const std::optional<Scales>& scales)
        : length(lab_unit(scales, "length")),
          time(lab_unit(scales, "time")),
          q(lab_unit(scales, "1/length")),
          rate(lab_unit(scales, "1/time")),
          velocity(lab_unit(scales, "length/time")),
          tension(lab_unit(scales, "energy/length^2")),
          square(lab_unit(scales, "length^2")) {}
    LabUnit length, time, q, rate, velocity, tension, square;
};

// Rate, frequency, time and mean square of a wave in a table, and their units.
std::string columns(const theory::Growth& growth, bool swings, std::optional<double> mean_square, const WaveUnits& in) {
    const double s = growth.rate();
    std::string out;
    add(out, "{:>14.7g}", s * in.rate.scale);
    if (swings) add(out, " {:>14.7g}", growth.frequency() * in.rate.scale);
    add(out, " {:>12}", s == 0 ? "-" : fmt::format("{:.6g}", in.time.scale / std::abs(s)));  // neutral: none
    if (mean_square) add(out, " {:>14.7g}", *mean_square * in.square.scale);
    return out;
}
std::string unit_columns(bool swings, bool warm, const WaveUnits& in) {
    return fmt::format("{:>14}{} {:>12}{}", in.rate.name, swings ? fmt::format(" {:>14}", in.rate.name) : "",
                       in.time.name, warm ? fmt::format(" {:>14}", in.square.name) : "");
}

void add_rows(Text& out, const ModelReport& report, double end, const WaveUnits& in) {
    const bool numbered = !report.rows.empty() && report.rows.front().n, swings = report.problem.law.inertia != 0,
               factors = std::any_of(report.rows.begin(), report.rows.end(), [](const auto&r) { return r.factor; }),
               warm = !report.rows.empty() && report.rows.front().mean_square;
    add(out, "    m {}{:>12} {:>14}{} {:>12}{}{}\n", numbered ? "   n " : "", "q", "rate",
        swings ? "      frequency" : "", "e-fold in", warm ? "    mean square" : "",
        factors ? "  factor until t = " + with_unit(end, in.time, 6) : "");
    if (!in.length.name.empty())
        add(out, "      {}{:>12} {}\n", numbered ? "     " : "", in.q.name, unit_columns(swings, warm, in));
    for (const WaveRow& row : report.rows) {
        const double s = row.growth.rate();
        add(out, "{:>5} ", row.m);
        if (row.n) add(out, "{:>4} ", *row.n);
        add(out, "{:>12.6g} {}", row.q * in.q.scale, columns(row.growth, swings, row.mean_square, in));
        if (row.factor) add(out, " {:>14.6g}", *row.factor);
        add(out, "{}\n", row.q == 0 && row.m == 0 ? "  the radius" : s > 0 ? "  grows" : s == 0 ? "  neutral" : "");
    }
}

void add_model(Text& out, const ModelReport& report, int last, double end, const WaveUnits& in) {
    add(out, "\n{}\n", words_of_model(report.problem));
    add(out, "  tension {} ({}), reduced {:.8g}\n", with_unit(report.tube.tension, in.tension, 8),
        report.tension_source, theory::reduced_tension(report.tube));
    const auto grown = instabilities(report.tube, last);
    const bool ill = theory::ill_posed_along(report.tube) || theory::ill_posed_around(report.tube);
    const bool fits = std::ranges::any_of(report.rows, [](const WaveRow& row) { return row.growth.rate() > 0; });
    add(out, "  beyond the threshold of: {}{}\n", grown.empty() ? "none" : fmt::format("{}", fmt::join(grown, ", ")),
        grown.empty() || fits ? "" : " (by other waves than these)");
    if (const double rate = radius_rate_of(report); rate != 0)
        add(out, "  the radius changes at the rate {}{}: growth rates hold at this instant only\n",
            with_unit(rate, in.velocity, 6),
            report.radius_at_end ? fmt::format(" and is {} at t = {}", with_unit(*report.radius_at_end, in.length, 6),
                                               with_unit(end, in.time, 6))
            : end > 0            ? " and cannot be followed to t = " + with_unit(end, in.time, 6)
                                 : "");
    if (const auto least = least_k42_of(report.tube); least && !ill)
        add(out, "  no wave with m = 0 grows for k42 >= {:.6g}\n", *least);
    add_rows(out, report, end, in);
    const auto name_of = [&](const WaveRow& row) {
        return row.n ? fmt::format("n = {}, m = {}", *row.n, row.m)
                     : fmt::format("q = {}, m = {}", with_unit(row.q, in.q, 6), row.m);
    };
    if (report.fastest_fitting)
        add(out, "  fastest that fits the length: n = {}, m = {}, rate {}\n", report.fastest_fitting->n,
            report.fastest_fitting->m, with_unit(report.fastest_fitting->rate, in.rate, 7));
    if (const WaveRow* row = fastest_row(report)) {
        const double s = row->growth.rate();
        if (s <= 0)
            add(out, "  none of these grows; {}: {}, rate {}\n", s < 0 ? "slowest to decay" : "neutral", name_of(*row),
                with_unit(s, in.rate, 7));
    }
    for (std::size_t m = 0; m < report.fastest.size(); ++m)
        if (const auto& fastest = report.fastest[m])
            add(out, "  fastest of all with m = {}: q = {}{}, rate {}\n", m, with_unit(fastest->q, in.q, 7),
                fastest->q > 0 ? fmt::format(" (length {})", with_unit(2 * pi / fastest->q, in.length, 6)) : "",
                with_unit(fastest->rate, in.rate, 7));
        else if (const auto bands = theory::growing_bands(report.tube, static_cast<int>(m));
                 !bands.empty() && std::isfinite(bands.back().to))
            add(out, "  no fastest of all with m = {}: the longer a wave, the faster it grows\n", m);
}

void add_thresholds(Text& out, const UniformTube& tube, const std::vector<Threshold>& limits, int last,
                    const WaveUnits& in) {
    add(out, "\nwhere waves begin to grow, all else kept\n  {:<16} {:>3} {:>12}  {:>20} {:>14}\n", "", "m", "q",
        "tension", "reduced");
    if (!in.length.name.empty()) add(out, "  {:<16} {:>3} {:>12}  {:>20}\n", "", "", in.q.name, in.tension.name);
    for (const Threshold& limit : limits) {
        UniformTube there = tube;
        there.tension = limit.tension;
        add(out, "  {:<16} {:>3} {:>12.6g}  {} {:>14.8g} {:>14.8g}\n", limit.name, limit.m, limit.q * in.q.scale,
            limit.grows_above ? "above" : "below", limit.tension * in.tension.scale, theory::reduced_tension(there));
    }
    for (int m = 0; m <= last; ++m)
        if (!theory::stable_tensions(tube, m)) add(out, "  {:<16} {:>3} at every tension\n", instability(m), m);
    const auto stable = theory::common_stable_tensions(tube, last);
    if (stable && stable->lowest == stable->highest)
        add(out, "  at every tension but {} some wave with m <= {} grows\n", with_unit(stable->lowest, in.tension, 8),
            last);
    else if (stable)
        add(out, "  no wave with m <= {} grows for tensions from {} to {}\n", last,
            with_unit(stable->lowest, in.tension, 8), with_unit(stable->highest, in.tension, 8));
    else
        add(out, "  at every tension some wave with m <= {} grows\n", last);
}

std::string words_of(const TubeSubject& subject, const std::vector<ModelReport>& reports,
                     const std::vector<Threshold>& limits, int last) {
    const WaveUnits in(subject.scales);
    Text out;
    add(out, "tube of radius {} and length {}; {}\n", with_unit(subject.tube.radius, in.length, 8),
        with_unit(subject.length, in.length, 8), moduli(subject.tube.energy));
    if (!subject.waves.empty())
        add(out, "its waves (amplitudes up to {}) are taken as small; --numerical uses the shape as it is\n",
            with_unit(std::abs(subject.waves.front().amplitude), in.length, 4));
    add(out, "{}", ill_posed_words(subject.tube));
    for (const ModelReport& report : reports) add_model(out, report, last, subject.end, in);
    add_thresholds(out, subject.tube, limits, last, in);
    return to_string(out);
}

// ---- JSON and CSV

Json json_of(const std::vector<std::complex<double>>& roots) {
    return json_list(roots, [](const auto& root) { return Json{root.real(), root.imag()}; });
}

Json json_of(const WaveRow& row) {
    return {{"m", row.m},
            {"n", or_null(row.n)},
            {"q", row.q},
            {"rate", row.growth.rate()},
            {"frequency", row.growth.frequency()},
            {"roots", json_of(row.growth.roots)},
            {"factor", or_null(row.factor)},
            {"mean_square", or_null(row.mean_square)}};
}

Json json_of(const Threshold& limit) {
    return {{"name", limit.name},
            {"m", limit.m},
            {"q", limit.q},
            {"tension", limit.tension},
            {"grows", limit.grows_above ? "above" : "below"}};
}

Json json_of(const ModelReport& report) {
    Json fastest = Json::array(), fitting;
    for (std::size_t m = 0; m < report.fastest.size(); ++m) {
        const auto& wave = report.fastest[m];
        fastest.push_back({{"m", m}, {"q", wave ? Json(wave->q) : Json()}, {"rate", wave ? Json(wave->rate) : Json()}});
    }
    if (const auto& f = report.fastest_fitting) fitting = {{"n", f->n}, {"m", f->m}, {"q", f->q}, {"rate", f->rate}};
    return {{"model", name(report.problem.model)},
            {"beyond", instabilities(report.tube, static_cast<int>(report.fastest.size()) - 1)},
            {"Re", report.problem.model.Re},
            {"gamma", report.problem.law.friction},
            {"tension", report.tube.tension},
            {"tension_source", report.tension_source},
            {"reduced_tension", theory::reduced_tension(report.tube)},
            {"radius_rate", radius_rate_of(report)},
            {"least_k42", or_null(least_k42_of(report.tube))},
            {"waves", json_list(report.rows, [](const WaveRow& row) { return json_of(row); })},
            {"fastest", fastest},
            {"fastest_fitting", fitting}};
}

Json json_of(const TubeSubject& subject, const std::vector<Threshold>& limits, int last, const Json& models) {
    const auto stable = theory::common_stable_tensions(subject.tube, last);
    return {{"shape", "tube"},
            {"radius", subject.tube.radius},
            {"length", subject.length},
            {"energy", moduli(subject.tube.energy)},
            {"ill_posed", theory::ill_posed_along(subject.tube) || theory::ill_posed_around(subject.tube)},
            {"thresholds", json_list(limits, [](const Threshold& limit) { return json_of(limit); })},
            {"stable_tensions", stable ? Json{stable->lowest, stable->highest} : Json()},
            {"models", models}};
}

// A row for each wave of each model.
std::string csv_of_waves(const Json& models) {
    Json rows = Json::array();
    for (const Json& model : models)
        for (Json wave : model["waves"]) {
            wave["model"] = model["model"], wave["tension"] = model["tension"];
            rows.push_back(std::move(wave));
        }
    return csv_of({"model", "tension", "m", "n", "q", "rate", "frequency", "factor", "mean_square"}, rows);
}

}  // namespace

std::string tube_report(const StabilityOptions& options, const TubeSubject& subject,
                        const std::vector<Problem>& models) {
    std::vector<ModelReport> reports;
    for (const Problem& model : models) reports.push_back(report_of(options, subject, model));
    const std::vector<Threshold> limits = thresholds(subject.tube, options.modes);
    if (!options.csv && !options.json) return words_of(subject, reports, limits, options.modes);
    const Json list = json_list(reports, [](const ModelReport& one) { return json_of(one); });
    return options.csv ? csv_of_waves(list) : line_of(json_of(subject, limits, options.modes, list));
}

// Rates over a range of wave numbers that holds all bands and the waves of the table.
std::string tube_curves(const StabilityOptions& options, const TubeSubject& subject,
                        const std::vector<Problem>& models) {
    std::vector<ModelReport> reports;
    double q_end = 0;
    for (const Problem& model : models) {
        reports.push_back(report_of(options, subject, model));
        for (int m = 0; m <= options.modes; ++m)
            for (const theory::Band& band : theory::growing_bands(reports.back().tube, m))
                if (std::isfinite(band.to)) q_end = std::max(q_end, 1.4 * band.to);
    }
    q_end = std::max(q_end, 1.6 / subject.tube.radius);
    if (!options.q.empty()) {
        const std::vector<double> asked = wave_numbers(options.q);
        q_end = std::max(*std::max_element(asked.begin(), asked.end()), 1e-6 / subject.tube.radius);
    }
    Json panels = Json::array();
    for (const ModelReport& report : reports) {
        Case short_of_volume = report.problem;
        short_of_volume.model.keeps_volume.reset();
        const std::string title = words_of_model(short_of_volume);
        Json curves = Json::array();
        for (int m = 0; m <= options.modes; ++m) {
            std::vector<double> q, rate, neutral;
            constexpr int samples = 400;
            for (int i = 0; i <= samples; ++i) {
                // The limit of long waves: q = 0 itself may stand for a radius that is kept.
                q.push_back(std::max(i * q_end / samples, 1e-6 * q_end));
                rate.push_back(theory::growth(report.tube, report.problem.law, q.back(), m).rate());
            }
            for (const theory::Band& band : theory::growing_bands(report.tube, m))
                for (const double edge : {band.from, band.to})
                    if (edge > 0 && std::isfinite(edge)) neutral.push_back(edge);
            curves.push_back({{"m", m}, {"q", q}, {"rate", rate}, {"neutral", neutral}});
        }
        panels.push_back({{"title", title}, {"report", json_of(report)}, {"curves", curves}});
    }
    return line_of(json_of(subject, thresholds(subject.tube, options.modes), options.modes, panels));
}

std::string sphere_report(const StabilityOptions& options, const theory::UniformSphere& sphere,
                          const std::optional<Scales>& scales, const std::vector<Problem>& models) {
    const WaveUnits in(scales);
    const int last = options.waves.value_or(6);
    Text out;
    Json list = Json::array();
    add(out, "sphere of radius {}; {}; for any m <= l\n", with_unit(sphere.radius, in.length, 8),
        moduli(sphere.energy));
    for (const Problem& c : models) {
        const MotionLaw& law = c.law;
        const bool swings = law.inertia != 0, moves = law.unconstrained();
        theory::UniformSphere loaded = sphere;
        if (!options.tension && law.area_is_free()) loaded.tension = law.tension.at(0);
        const double radius_rate = law.pressure.at(0) - theory::pressure_at_rest(loaded);
        add(out, "\n{}\n  tension {}\n", words_of_model(c), with_unit(loaded.tension, in.tension, 8));
        if (moves)
            add(out, "  the radius changes at the rate {}: growth rates hold at this instant only\n",
                with_unit(radius_rate, in.velocity, 6));
        const auto warm = [&](int l) -> std::optional<double> {
            if (!options.kT) return {};
            const double R = loaded.radius, scale = std::abs(density(loaded.energy, -2 / R, 1 / (R * R)).HH) *
                                                    std::pow(1 + l, 4) / std::pow(R, 4);
            return mean_square(*options.kT, stiffness(loaded, l), scale, 4 * pi * R * R, fmt::format("l = {}", l));
        };
        if (options.kT && law.area_is_free() && !law.keeps_volume) {
            if (std::abs(radius_rate) > 1e-9 * std::abs(law.pressure.at(0)))
                refuse_motion(fmt::format("the pressure of equilibrium is {:.9g}", theory::pressure_at_rest(loaded)));
            warm(0);
        }
        add(out, "    l {:>14}{} {:>12}{}\n", "rate", swings ? "      frequency" : "", "e-fold in",
            options.kT ? "    mean square" : "");
        if (scales) add(out, "      {}\n", unit_columns(swings, options.kT.has_value(), in));
        for (int l = moves ? 0 : 2; l <= last; l += l == 0 ? 2 : 1) {
            const theory::Growth found = growth(loaded, law, l);
            const double s = found.rate();
            const std::optional<double> mean = warm(l);
            add(out, "{:>5} {}{}\n", l, columns(found, swings, mean, in),
                s > 0    ? "  grows"
                : s == 0 ? "  neutral"
                         : "");
            list.push_back({{"model", name(c.model)},
                            {"l", l},
                            {"rate", s},
                            {"roots", json_of(found.roots)},
                            {"mean_square", or_null(mean)}});
            if (options.csv) list.back()["frequency"] = found.frequency();
        }
    }
    if (options.csv) return csv_of({"model", "l", "rate", "frequency", "mean_square"}, list);
    if (!options.json) return to_string(out);
    return line_of(
        {{"shape", "sphere"}, {"radius", sphere.radius}, {"energy", moduli(sphere.energy)}, {"waves", list}});
}

}  // namespace tubule
