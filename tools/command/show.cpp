// tubule show FILE: a result in words, as CSV or as JSON.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "common/case/read.hpp"
#include "common/result/about.hpp"
#include "common/result/checksums.hpp"
#include "common/result/record.hpp"
#include "common/result/start_frame.hpp"
#include "common/series/catalogue.hpp"
#include "common/solve/message.hpp"
#include "tools/command/commands.hpp"
#include "tools/command/options.hpp"
#include "tools/command/output.hpp"
#include "tools/command/show_scan.hpp"
#include "tools/command/units.hpp"
#include "tools/run/continuation.hpp"
#include "tools/scan/scan_file.hpp"

namespace tubule {

namespace {

struct ShowOptions {
    std::string file;
    std::string output, units;
    bool overwrite = false;
    bool csv = false, json = false, verify = false;
    std::optional<long> frame;
};

// ---- words

std::string title_of(const Result& result, const std::string& file) {
    try {
        return parse_case(result.case_text.text, result.case_text.sets, file, result.case_text.inputs).title;
    } catch (const CaseError&) {
        return "";  // written by a version with other keys; the rest of the result can be shown all the same
    }
}

// What only a resumed run can make sense of.
bool is_private(const std::string& name) {
    return name.starts_with("restart_");
}

std::string array_list(const Record& record) {
    std::string list;
    for (const Array& array : record.arrays)
        if (!is_private(array.name))
            list += fmt::format("{}{}[{}]", list.empty() ? "" : ", ", array.name, fmt::join(array.shape, ", "));
    return list;
}

bool alike(const Record& a, const Record& b) {
    return a.mesh.has_value() == b.mesh.has_value() &&
           std::equal(a.numbers.begin(), a.numbers.end(), b.numbers.begin(), b.numbers.end(),
                      [](const auto& x, const auto& y) { return x.first == y.first; });
}

// What a summary is written in. Stationary shapes have numbers for times.
struct Shown {
    std::optional<Scales> scales;
    bool numbered = false;
};

// The unit in which a series, a number of a frame or one about the run is shown, its prefix by this number.
LabUnit unit_of(const Shown& in, const std::string& name, double number = 1) {
    if (name == "length") return lab_unit(in.scales, "length");  // the period of a frame
    if (name == "E_ref") return lab_unit(in.scales, "energy");
    if (name == "time" || name == "stop_time") return in.numbered ? LabUnit{} : lab_unit(in.scales, "time");
    const SeriesEntry* entry = find_series(name);
    return entry ? lab_unit(in.scales, entry->unit, number) : LabUnit{};
}

// The units below the names of add_frames.
void add_units_of(Text& out, const Record& frame, const Shown& in) {
    add(out, "{:>6} {:>14}{}", "", unit_of(in, "time").name, frame.mesh ? "       " : "");
    for (const auto& [name, value] : frame.numbers)
        if (!is_private(name)) add(out, " {:>14}", unit_of(in, name).name);
    add(out, "\n");
}

// The numbers of the frames are the columns. Most results have frames that are all alike; else a new header says so.
void add_frames(Text& out, const std::vector<Record>& frames, const Shown& in) {
    for (std::size_t i = 0; i < frames.size(); ++i) {
        const Record& frame = frames[i];
        if (i == 0 || !alike(frame, frames[i - 1])) {
            add(out, "\n{:>6} {:>14}{}", "frame", "time", frame.mesh ? "   mesh" : "");
            for (const auto& [name, value] : frame.numbers)
                if (!is_private(name)) add(out, " {:>14}", name);
            add(out, "  arrays\n");
            if (in.scales) add_units_of(out, frame, in);
        }
        add(out, "{:>6} {:>14.8g}", i, frame.time * unit_of(in, "time").scale);
        if (frame.mesh) add(out, " {:>6}", *frame.mesh);
        for (const auto& [name, value] : frame.numbers)
            if (!is_private(name)) add(out, " {:>14.8g}", value * unit_of(in, name).scale);
        add(out, "  {}\n", array_list(frame));
    }
}

void add_meshes(Text& out, const std::vector<SurfaceCells>& meshes, const LabUnit& length) {
    if (meshes.empty()) return;
    add(out, "\n{:>6} {:>9} {:>9} {:>6}  periodic\n", "mesh", "triangles", "nodes", "order");
    for (std::size_t i = 0; i < meshes.size(); ++i)
        add(out, "{:>6} {:>9} {:>9} {:>6}  {}\n", i, meshes[i].count(), meshes[i].nodes, meshes[i].order,
            meshes[i].period > 0 ? "in z, " + with_unit(meshes[i].period, length, 8) : "no: closed");
}

void add_summary(Text& out, const Result& result, const std::string& file, const Shown& in) {
    const auto line = [&](std::string_view name, const std::string& value) { add(out, "{:<18} {}\n", name, value); };
    line("file", file);
    line("title", title_of(result, file));
    if (!result.case_text.sets.empty()) line("set", fmt::format("{}", fmt::join(result.case_text.sets, "  ")));
    if (in.scales)
        line("units",
             fmt::format("1 of length is {}, of energy {}; of time {}", with_unit(1, lab_unit(in.scales, "length"), 4),
                         with_unit(1, lab_unit(in.scales, "energy"), 4),
                         in.scales->time ? with_unit(1, lab_unit(in.scales, "time"), 4) : "not known"));
    for (const auto& [name, value] : result.about) {
        const LabUnit unit = unit_of(in, name);
        const double* number = std::get_if<double>(&value);
        line(name, number && !unit.name.empty() ? with_unit(*number, unit, 12) : text_of(value));
    }
    if (!find_value<std::string>(result.about, "stop")) line("stop", "none yet: the run is still going, or was killed");
    const auto& times = result.series.at(result.series_names.front());
    line("rows", std::to_string(times.size()));
    line("frames", std::to_string(result.frames.size()));
    if (result.checkpoint) line("checkpoint", "time " + with_unit(result.checkpoint->time, unit_of(in, "time"), 8));
    if (!times.empty()) {
        add(out, "\nlast row\n");
        for (const std::string& name : result.series_names) {
            const double number = result.series.at(name).back();
            line("  " + name, with_unit(number, unit_of(in, name, number), 12));
        }
    }
    add_meshes(out, result.meshes, lab_unit(in.scales, "length"));
    add_frames(out, result.frames, in);
}

// ---- CSV

// Every `stride`-th number of an array, from the given one.
struct Column {
    std::string name;
    const std::vector<double>* values;
    std::size_t from = 0, stride = 1;
};

void add_table(Text& out, const std::vector<Column>& columns) {
    for (std::size_t j = 0; j < columns.size(); ++j) add(out, "{}{}", j > 0 ? "," : "", columns[j].name);
    add(out, "\n");
    const std::size_t rows = columns.empty() ? 0 : columns.front().values->size() / columns.front().stride;
    for (std::size_t i = 0; i < rows; ++i) {
        for (std::size_t j = 0; j < columns.size(); ++j) {
            const auto& [name, values, from, stride] = columns[j];
            add(out, "{}{:.17g}", j > 0 ? "," : "", (*values)[from + i * stride]);
        }
        add(out, "\n");
    }
}

std::vector<Column> series_columns(const Result& result) {
    std::vector<Column> columns;
    for (const std::string& name : result.series_names) columns.push_back({name, &result.series.at(name)});
    return columns;
}

// The arrays sampled at the points z. The spline's own may happen to be as long, but their rows are no points.
std::vector<Column> profile_columns(const Record& frame) {
    const Array* z = find_array(frame, "z");
    if (!z) throw std::runtime_error("the frame has no array z of sampling points");
    std::vector<Column> columns;
    for (const Array& array : frame.arrays)
        if (array.shape == z->shape && array.name != "knots" && array.name != "coefficients" && !is_private(array.name))
            columns.push_back({array.name, &array.data});
    return columns;
}

// The nodes, first of all where they are.
std::vector<Column> surface_columns(const Record& frame, const SurfaceCells& mesh) {
    static const std::vector<std::string> vector{"x", "y", "z"}, tensor{"xx", "xy", "xz", "yy", "yz", "zz"};
    std::vector<Column> points, data;
    for (const Array& array : frame.arrays) {
        if (array.name == "points") {
            for (std::size_t c = 0; c < 3; ++c) points.push_back({vector[c], &array.data, c, 3});
        } else if (is_point_data(array, mesh) && array.shape.size() == 1) {
            data.push_back({array.name, &array.data});
        } else if (is_point_data(array, mesh)) {
            const std::size_t width = array.shape[1];
            const auto& names = width == 3 ? vector : tensor;
            for (std::size_t c = 0; c < width; ++c)
                data.push_back({array.name + "_" + names[c], &array.data, c, width});
        }
    }
    points.insert(points.end(), data.begin(), data.end());
    return points;
}

std::vector<Column> frame_columns(const Result& result, std::size_t index) {
    const Record& frame = result.frames[index];
    return frame.mesh ? surface_columns(frame, result.meshes[*frame.mesh]) : profile_columns(frame);
}

// ---- JSON

// Arrays by their shapes alone, unless `data` too is wanted (row-major, in one list).
Json json_of(const Record& record, bool data) {
    Json arrays = Json::object();
    for (const Array& array : record.arrays) {
        arrays[array.name]["shape"] = array.shape;
        if (data) arrays[array.name]["data"] = array.data;
    }
    Json out{{"time", record.time}};
    if (record.mesh) out["mesh"] = *record.mesh;
    out["numbers"] = json_object(record.numbers);
    out["arrays"] = arrays;
    return out;
}

// Cells by their number alone, unless `data` too is wanted.
Json json_of(const SurfaceCells& mesh, bool data) {
    Json out{{"order", mesh.order}, {"nodes", mesh.nodes}, {"triangles", mesh.count()}, {"period", mesh.period}};
    if (data) out["cells"] = mesh.cells, out["shifts"] = mesh.shifts;
    return out;
}

std::string json_text(const Result& result, std::optional<std::size_t> with_data) {
    Json series = Json::object(), meshes = Json::array(), frames = Json::array();
    for (const std::string& name : result.series_names) series[name] = result.series.at(name);
    for (std::size_t i = 0; i < result.meshes.size(); ++i)
        meshes.push_back(json_of(result.meshes[i], with_data && result.frames[*with_data].mesh == i));
    for (std::size_t i = 0; i < result.frames.size(); ++i) frames.push_back(json_of(result.frames[i], with_data == i));
    return line_of({{"case",
                     {{"text", result.case_text.text},
                      {"set", result.case_text.sets},
                      {"resolved", or_null(resolved_case(result.case_text))}}},
                    {"about", json_object(result.about)},
                    {"series", series},
                    {"meshes", meshes},
                    {"frames", frames},
                    {"checkpoint", result.checkpoint ? json_of(*result.checkpoint, false) : Json()}});
}

// ----

Text shown_scan(const ShowOptions& options) {
    if (options.frame) throw std::runtime_error("a scan has no frames: --frame must be absent");
    Text out;
    add(out, "{}",
        options.json  ? scan_json(options.file)
        : options.csv ? scan_csv(options.file)
                      : scan_summary(options.file));
    return out;
}

Text shown(const ShowOptions& options) {
    if (!options.units.empty() && (options.csv || options.json || is_scan(options.file)))
        throw std::runtime_error("--units changes the summary of a result: CSV, JSON and scans are dimensionless");
    if (options.frame && !options.csv && !options.json) throw std::runtime_error("--frame needs --csv or --json");
    if (is_scan(options.file)) return shown_scan(options);
    const Result result = read_result(options.file);
    std::optional<std::size_t> frame;
    if (options.frame) frame = frame_named(result, *options.frame);
    Text out;
    if (options.json)
        add(out, "{}", json_text(result, frame));
    else if (options.csv)
        add_table(out, frame ? frame_columns(result, *frame) : series_columns(result));
    else
        add_summary(out, result, options.file,
                    {shown_scales(result.case_text, options.file, options.units),
                     result.series.contains("negative_directions")});
    return out;
}

// Whether all is as it was written: exit status 0, or 1 if it is not, or cannot be known.
int verify(const ShowOptions& options) {
    const Wholeness found = examine(options.file);
    if (found.kind == Wholeness::Kind::foreign) read_case_text(options.file);  // which says what is wrong with it
    std::string words = found.damage;
    if (found.kind == Wholeness::Kind::unsealed)
        words = "has no checksums, so whether it is as it was written cannot be checked";
    try {
        if (words.empty() && !is_scan(options.file))
            require_result(options.file);  // other files have frames of it, too
    } catch (const std::runtime_error& error) {
        words = error.what();
    }
    print_answer(fmt::format("{}: {}\n", options.file, words.empty() ? "as it was written" : words));
    return words.empty() ? 0 : 1;
}

// Whether a file begins as what is to replace it: with the same columns, or as JSON of ours.
bool is_such_a_table(const std::string& path, std::string_view text) {
    constexpr std::size_t told_apart = 8;
    std::string begin(std::min(told_apart, text.size()), '\0');
    std::ifstream(path, std::ios::binary).read(begin.data(), static_cast<std::streamsize>(begin.size()));
    return text.starts_with(begin);
}

// A result is never replaced: it is what this reads.
void write_file(const std::string& path, std::string_view text, bool overwrite) {
    if (is_hdf5(path)) throw std::runtime_error(path + ": is HDF5, maybe a result: choose another file with -o");
    std::error_code none;
    const bool has_contents = std::filesystem::is_regular_file(path, none) && !std::filesystem::is_empty(path, none);
    if (!overwrite && has_contents && !is_such_a_table(path, text))
        throw std::runtime_error(fmt::format(
            "{}: is no table that show has written: choose another file with -o; --overwrite replaces it", path));
    std::ofstream out(path, std::ios::binary);
    out << text << std::flush;
    if (!out) throw std::runtime_error(fmt::format("{}: cannot be written: {}", path, std::strerror(errno)));
}

int show(const ShowOptions& options) {
    try {
        if (options.verify) return verify(options);
        const Text out = shown(options);
        if (options.output.empty())
            print_answer({out.data(), out.size()});
        else
            write_file(options.output, {out.data(), out.size()}, options.overwrite);
        return 0;
    } catch (const OutputError&) {
        throw;
    } catch (const std::runtime_error& error) {
        return refuse_file(options.file, explanation(error));
    }
}

}  // namespace

void add_show(CLI::App& app, int& exit_status) {
    CLI::App* command = app.add_subcommand("show", "Print a result: a summary, or its numbers as CSV or JSON");
    const auto options = std::make_shared<ShowOptions>();
    command->add_option("FILE", options->file, "result file NAME.hdf")->required();
    CLI::Option* csv =
        command->add_flag("--csv", options->csv, "the series, or the points of a scan, in full precision");
    command->add_flag("--json", options->json, "everything but the numbers of the frames' arrays")->excludes(csv);
    command->add_option("--frame", options->frame,
                        "with --csv: points and what is known there, of this frame, instead; with --json: its arrays "
                        "too (-1: the last)");
    command
        ->add_flag("--verify", options->verify,
                   "only look whether the file is as it was written: exit status 1 if it is damaged")
        ->excludes(csv);
    command->add_option(
        "--units", options->units,
        "of the summary: keys of [units], as \"length=50 nm,bending_rigidity=20 kT\", or none (default: "
        "those of the case)");
    command->add_option("-o,--output", options->output, "write it to this file instead of stdout");
    command->add_flag("--overwrite", options->overwrite, "replace that file even if it is no such table");
    end_help(*command,
             {"tubule show figure.hdf", "tubule show figure.hdf --csv --frame -1", "tubule show figure.hdf --verify"},
             {{0}, {1, "--verify: the file is damaged, or has no checksums"}, {2}}, {"results"});
    command->callback([options, &exit_status] { exit_status = show(*options); });
}

}  // namespace tubule
