// tubule plot RESULT... : draws results by the Python scripts of tools/python/tubule/drawing.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/case/read.hpp"
#include "common/energy/bending.hpp"
#include "common/result/result.hpp"
#include "common/solve/message.hpp"
#include "tools/command/commands.hpp"
#include "tools/command/help.hpp"
#include "tools/command/python.hpp"
#include "tools/command/text.hpp"
#include "tools/scan/scan_file.hpp"

namespace tubule {

namespace {

struct SeriesOptions {
    std::vector<std::string> names;
    std::string x = "time";
    std::optional<double> from, to;
    bool logy = false;
};

struct PlotOptions {
    std::vector<std::string> results, outputs, colours, labels, slices;
    SeriesOptions series;
    std::string quantity;  // of scans
    std::vector<double> times;
    std::string kind = "all", plane = "z=0", scale = "run", confirmed, movie;
    double fps = 10;  // frames of a film per second
    double dpi = 300;
};

bool is_plane(const std::string& text) {
    if (text.size() < 3 || text.find_first_of("xyz") != 0 || text[1] != '=') return false;
    double value = 0;
    const auto [end, error] = std::from_chars(text.data() + 2, text.data() + text.size(), value);
    return error == std::errc() && end == text.data() + text.size() && std::isfinite(value);
}

// NAME=LABEL of the listed terms, and of those that the cases of results add. A result that cannot be read is
// complained of by the script.
std::vector<std::string> labels_of_terms(const std::vector<std::string>& results) {
    std::vector<std::string> out;
    const auto add = [&](const Bending& energy, std::size_t known) {
        const auto labels = term_labels(energy);
        for (std::size_t i = known; i < labels.size(); ++i)
            out.push_back(fmt::format("{}={}", labels[i].first, labels[i].second));
    };
    add(Bending{}, 0);
    for (const std::string& result : results) try {
            const CaseText of = read_case_text(result);
            add(parse_case(of.text, of.sets, result, of.inputs).energy, n_bending_terms);
        } catch (const std::runtime_error&) {
        }
    return out;
}

std::vector<std::string> script_arguments(const PlotOptions& options) {
    std::vector<std::string> arguments = plot_command("plot", "plot");
    arguments.push_back("--kind=" + options.kind);
    arguments.push_back("--plane=" + options.plane);
    if (!options.times.empty()) arguments.push_back(fmt::format("--times={}", fmt::join(options.times, ",")));
    if (!options.colours.empty()) arguments.push_back(fmt::format("--colour={}", fmt::join(options.colours, ",")));
    if (!options.quantity.empty()) arguments.push_back("--quantity=" + options.quantity);
    for (const std::string& slice : options.slices) arguments.push_back("--slice=" + slice);
    for (const std::string& output : options.outputs) arguments.push_back("--output=" + output);
    if (!options.series.names.empty())
        arguments.push_back(fmt::format("--series={}", fmt::join(options.series.names, ",")));
    arguments.push_back("--x=" + options.series.x);
    arguments.push_back("--scale=" + options.scale);
    if (options.series.from) arguments.push_back(fmt::format("--from={}", *options.series.from));
    if (options.series.to) arguments.push_back(fmt::format("--to={}", *options.series.to));
    if (options.series.logy) arguments.push_back("--logy");
    arguments.push_back(fmt::format("--dpi={}", options.dpi));
    if (!options.movie.empty())
        arguments.insert(arguments.end(), {"--movie=" + options.movie, fmt::format("--fps={}", options.fps)});
    if (!options.confirmed.empty()) arguments.push_back("--confirmed=" + options.confirmed);
    for (const std::string& label : options.labels) arguments.push_back("--label=" + label);
    for (const std::string& label : labels_of_terms(options.results)) arguments.push_back("--term=" + label);
    arguments.push_back("--");
    arguments.insert(arguments.end(), options.results.begin(), options.results.end());
    return arguments;
}

// "--times 0 0.1 10" gives one time, and results of strange names.
void refuse_times_as_results(const PlotOptions& options) {
    for (const std::string& result : options.results)
        if (!options.times.empty() && number_of(result) && !std::filesystem::exists(result))
            throw CaseError(fmt::format("--times: several times are separated by commas, without spaces: --times {},{}",
                                        options.times.back(), result));
}

int plot(const PlotOptions& options) {
    refuse_times_as_results(options);
    try {
        for (const std::string& result : options.results)
            if (!is_scan(result)) require_result(result);
    } catch (const std::runtime_error& error) {
        say(stderr, "{}\n", explanation(error));
        return 2;
    }
    std::vector<std::string> arguments;
    try {
        arguments = script_arguments(options);
    } catch (const std::runtime_error& error) {
        say(stderr, "{}\n", explanation(error));
        return 4;
    }
    return become("plot", arguments);
}

void add_series_options(CLI::App& command, PlotOptions& options) {
    command
        .add_option("--series", options.series.names,
                    "series to draw instead of all else, such as r_min,r_max; `tubule show --csv` lists them")
        ->delimiter(',')
        ->allow_extra_args(false);
    command.add_option("--x", options.series.x, "with --series: the series they are drawn against")
        ->capture_default_str();
    command.add_option("--from", options.series.from, "with --series: draw from this value of --x")
        ->check(refuse_infinite);
    command.add_option("--to", options.series.to, "with --series: draw up to this value of --x")
        ->check(refuse_infinite);
    command.add_flag("--logy", options.series.logy, "with --series: logarithmic axis");
}

void add_scan_options(CLI::App& command, PlotOptions& options) {
    command.add_option(
        "--quantity", options.quantity,
        "of a scan: what its map shows: outcome (default), energy, r_min, volume, steps ... (all columns "
        "of show --csv)");
    command
        .add_option("--slice", options.slices,
                    "of a scan with more than two axes: key=value of an axis that is cut; may be repeated")
        ->allow_extra_args(false);
    command.add_option("--confirmed", options.confirmed,
                       "of a scan: the output of `tubule confirm --json`, whose points are marked on the map");
}

void add_movie_options(CLI::App& command, PlotOptions& options) {
    command.add_option("--dpi", options.dpi, "pixels per inch of a .png, and of surfaces within .svg and .pdf")
        ->check(CLI::Range(30.0, 1200.0))
        ->capture_default_str();
    command.add_option("--movie", options.movie,
                       "film to write instead, .mp4 (needs ffmpeg) or .gif: the shape of one result, frame by frame, "
                       "coloured by H or the given --colour, and its energy");
    command.add_option("--fps", options.fps, "with --movie: frames per second")
        ->check(CLI::Range(0.1, 100.0))
        ->capture_default_str();
}

}  // namespace

std::vector<std::pair<std::string, std::string>> term_labels(const Bending& bending) {
    std::vector<std::pair<std::string, std::string>> labels;
    for_each_bending_term([&](std::size_t, const auto& term) { labels.emplace_back(term.name, term.label); });
    for (const EnergyTerm& term : bending.terms) labels.emplace_back(term_name(term), term_label(term));
    return labels;
}

void add_plot(CLI::App& app, int& exit_status) {
    CLI::App* command =
        app.add_subcommand("plot", "Draw shapes and cuts through them at the output times, and energies over time");
    const auto options = std::make_shared<PlotOptions>();
    command->add_option("RESULT", options->results, "result files; several are labelled by what differs in their cases")
        ->required();
    command
        ->add_option("-o,--output", options->outputs,
                     "picture to write, .png, .svg or .pdf; may be repeated (default: both RESULT.png and .svg)")
        ->allow_extra_args(false);
    command
        ->add_option("--times", options->times, "times of the frames, such as 0,0.05,1.4 (default: up to six frames)")
        ->check(refuse_infinite)
        ->delimiter(',')
        ->type_name("T1,T2,...")
        ->allow_extra_args(false);
    command->add_option("--kind", options->kind, "what to draw: profiles, surface, cuts, energy, balance, all")
        ->check(CLI::IsMember({"profiles", "surface", "cuts", "energy", "balance", "all"}))
        ->capture_default_str();
    command
        ->add_option("--colour", options->colours,
                     "quantities to colour surfaces by: u_n (with arrows for the flow along them), H, K, p, or several "
                     "as in u_n,H (default: u_n of surfaces that move, else H,K)")
        ->delimiter(',')
        ->allow_extra_args(false)
        ->check(CLI::IsMember({"u_n", "H", "K", "p"}));
    command
        ->add_option("--scale", options->scale,
                     "velocities are drawn relative to the largest one of the run, or of each shape")
        ->check(CLI::IsMember({"run", "shape"}))
        ->capture_default_str();
    command
        ->add_option("--label", options->labels,
                     "label of a result, one for each, in their order (default: what differs in their cases)")
        ->allow_extra_args(false);
    command->add_option("--plane", options->plane, "of the cuts through surfaces: x, y or z = number")
        ->check(
            [](const std::string& text) { return is_plane(text) ? "" : "is not x, y or z = number, such as y=0.5"; })
        ->capture_default_str();
    add_series_options(*command, *options);
    add_scan_options(*command, *options);
    add_movie_options(*command, *options);
    end_help(*command,
             {"tubule plot figure.hdf -o figure.svg",
              "tubule plot k42.hdf --quantity energy --slice shape.radius=1 -o energy.png",
              "tubule plot figure.hdf --movie figure.gif"},
             {{0}, {2}, {4, "the picture could not be drawn"}}, {"pictures"});
    command->callback([options, &exit_status] { exit_status = plot(*options); });
}

}  // namespace tubule
