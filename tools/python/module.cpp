// The module tubule._core: cases, runs and results for the Python package of this folder.
#include <omp.h>
#include <pybind11/functional.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <functional>
#include <regex>

#include "common/case/read.hpp"
#include "common/case/text.hpp"
#include "common/energy/bending.hpp"
#include "common/geometry/profile_point.hpp"
#include "common/result/about.hpp"
#include "common/result/frame_profile.hpp"
#include "common/result/hdf5_file.hpp"
#include "common/result/record.hpp"
#include "common/series/catalogue.hpp"
#include "common/solve/interrupt.hpp"
#include "common/solve/parallel.hpp"
#include "common/solve/pause.hpp"
#include "common/solve/sparse.hpp"
#include "common/theory/dispersion.hpp"
#include "common/theory/waves.hpp"
#include "tools/command/build_info.hpp"
#include "tools/command/commands.hpp"
#include "tools/command/options.hpp"
#include "tools/command/stability.hpp"
#include "tools/command/units.hpp"
#include "tools/python/memory_result.hpp"
#include "tools/run/case_checks.hpp"
#include "tools/run/continuation.hpp"
#include "tools/run/forecast.hpp"
#include "tools/scan/dispatcher.hpp"

namespace py = pybind11;

namespace tubule {
namespace {

bool is_main_thread() {
    const py::module_ threading = py::module_::import("threading");
    return threading.attr("current_thread")().is(threading.attr("main_thread")());
}

// While it lives, Python's handlers of signals are called in the midst of work, as between two statements, if this is
// the main thread: Python gives signals to no other. What one of them raises, such as KeyboardInterrupt, ends the work.
class Signals {
public:
    Signals() : main_(is_main_thread()), thread_(std::this_thread::get_id()) {}
    ~Signals() { lower(); }
    Signals(const Signals&) = delete;
    Signals& operator=(const Signals&) = delete;

    // Whether work is to end. To be called from any thread, without the GIL.
    bool interrupted() {
        if (main_ && std::this_thread::get_id() == thread_) handle();
        return tubule::interrupted();
    }
    // Raises what a handler has raised.
    void check() {
        if (!raised_) return;
        lower();
        std::rethrow_exception(raised_);
    }

private:
    void handle() {
        const auto now = std::chrono::steady_clock::now();
        if (raised_ || now < next_) return;
        next_ = now + std::chrono::milliseconds(50);
        const py::gil_scoped_acquire gil;
        if (PyErr_CheckSignals() == 0) return;
        raised_ = std::make_exception_ptr(py::error_already_set());
        set_interrupted(true);  // for threads of the work
    }
    void lower() {
        if (raised_) set_interrupted(false);  // runs of other threads and later ones ask it, too
    }

    bool main_;
    std::thread::id thread_;
    std::chrono::steady_clock::time_point next_;
    std::exception_ptr raised_;
};

// Does the work without the GIL, with so many threads for loops over elements (0: as many as there are processors; more
// than that would only wait).
// Handlers of signals end it by what they raise: Ctrl-C by KeyboardInterrupt.
template <class Work>
auto without_gil(int threads, const Work& work) {
    Signals signals;
    const auto done = [&] {
        const py::gil_scoped_release release;
        const PauseWatch watch(std::nullopt, [&] { return signals.interrupted(); });
        const int before = omp_get_max_threads();
        omp_set_num_threads(std::min(threads > 0 ? threads : before, omp_get_num_procs()));
        struct Reset {
            int threads;
            ~Reset() { omp_set_num_threads(threads); }
        } reset{before};
        multiply_on_one_thread();
        try {
            return work();
        } catch (const Paused& pause) {
            throw std::runtime_error(
                pause.reason == Stop::interrupted ? "interrupted" : "time.limit has passed before there was a row");
        }
    };
    try {
        auto out = done();
        signals.check();
        return out;
    } catch (...) {
        signals.check();
        throw;
    }
}

// What the command refuses, in Python's words: options are arguments here.
template <class Work>
auto as_arguments(const Work& work) {
    const auto renamed = [](const std::exception& error) {
        return std::regex_replace(valid_utf8(error.what()), std::regex("--(?=[A-Za-z])"), "");
    };
    try {
        return work();
    } catch (const CaseError& error) {
        throw CaseError(renamed(error));
    } catch (const std::invalid_argument& error) {
        throw std::invalid_argument(renamed(error));
    }
}

// f of numbers or arrays that broadcast. Long arrays hear Ctrl-C.
template <class... Numbers>
auto of_each(const std::function<double(Numbers...)>& f) {
    return py::vectorize(std::function<double(Numbers...)>([f, calls = 0u](Numbers... numbers) mutable {
        if (++calls % 65536 == 0 && PyErr_CheckSignals() != 0) throw py::error_already_set();
        return f(numbers...);
    }));
}

py::array_t<double> numpy(const std::vector<double>& values) {
    return py::array_t<double>(static_cast<py::ssize_t>(values.size()), values.data());
}
py::array_t<double> numpy(const Array& array) {
    return py::array_t<double>(array.shape, array.data.data());
}
py::dict dictionary(const About& about) {
    py::dict out;
    for (const auto& [name, value] : about) out[py::str(name)] = py::cast(value);
    return out;
}

// ---- results

// What the package gets of a run: no more is copied than is asked for.
struct Results {
    std::shared_ptr<const Result> result;

    const Record& frame(std::size_t number) const {
        if (number >= result->frames.size()) throw py::index_error("there are fewer frames");
        return result->frames[number];
    }
};

py::dict frame_dictionary(const Results& r, std::size_t number) {
    const Record& frame = r.frame(number);
    py::dict numbers, arrays, out;
    for (const auto& [name, value] : frame.numbers)
        if (!name.starts_with("restart_")) numbers[py::str(name)] = value;
    for (const Array& array : frame.arrays)
        if (!array.name.starts_with("restart_")) arrays[py::str(array.name)] = numpy(array);
    out["time"] = frame.time, out["kind"] = py::str(std::string(name(kind_of(frame))));
    out["numbers"] = numbers, out["arrays"] = arrays;
    out["mesh"] = frame.mesh ? py::cast(*frame.mesh) : py::none();
    return out;
}

py::dict mesh_dictionary(const Results& r, std::size_t number) {
    const SurfaceCells& mesh = r.result->meshes.at(number);
    const auto width = static_cast<py::ssize_t>((mesh.order + 1) * (mesh.order + 2) / 2);
    const auto rows = static_cast<py::ssize_t>(mesh.cells.size()) / width;
    py::dict out;
    out["order"] = mesh.order, out["nodes"] = mesh.nodes, out["period"] = mesh.period;
    out["cells"] = py::array_t<int>({rows, width}, mesh.cells.data());
    out["shifts"] =
        mesh.shifts.empty() ? py::object(py::none()) : py::object(py::array_t<int>({rows, width}, mesh.shifts.data()));
    return out;
}

py::tuple profile(const Results& r, std::size_t number, int points) {
    const Record& frame = r.frame(number);
    if (kind_of(frame) != RecordKind::graph) {
        const auto [radius, height, length] = profile_points(frame);
        return py::make_tuple(numpy(radius), numpy(height), length);
    }
    const PerturbedCurve tube = frame_curve(frame);
    require_within("points", points, 2, 1000000);
    std::vector<double> radius, height;
    for (int i = 0; i < points; ++i) {
        const auto at = profile_at(tube, i / (points - 1.0));
        radius.push_back(at[0]), height.push_back(at[1]);
    }
    return py::make_tuple(numpy(radius), numpy(height), tube.length);
}

// Raised by one thread, asked by the runs of others.
struct Flag {
    std::atomic<bool> raised = false;
};

Results run(const Problem& c, const py::object& progress, const py::object& output, bool overwrite, int threads,
            const std::shared_ptr<Flag>& enough) {
    require_within("threads", threads, 0, 1000);
    MemoryRunOptions options;
    std::exception_ptr raised;  // by the caller's own function: it ends the run
    std::atomic<bool> unwanted = false;
    if (!progress.is_none())
        options.progress = [&](double time, double energy, double step) {
            if (unwanted) return;
            const py::gil_scoped_acquire gil;
            try {
                progress(time, energy, step);
            } catch (...) {
                raised = std::current_exception();
                unwanted = true;
            }
        };
    options.interrupted = [&] { return unwanted || (enough && enough->raised); };
    std::vector<std::string> notes = physics_notes(c);
    options.note = [&](const std::string& words) { notes.push_back(words); };
    if (!output.is_none()) options.output = output.cast<std::filesystem::path>();
    options.overwrite = overwrite;
    Result done = without_gil(threads, [&] { return run_in_memory(c, options); });
    if (raised) std::rethrow_exception(raised);
    if (const auto* warnings = find_value<std::string>(done.about, "warnings"))
        for (const std::string& words : split(*warnings, '\n'))
            if (!words.empty()) notes.push_back(words);
    for (const std::string& words : notes)
        py::module_::import("warnings").attr("warn")(words, py::handle(PyExc_UserWarning), 2);
    return {std::make_shared<const Result>(std::move(done))};
}

// ---- closed forms

using Numbers = py::array_t<double, py::array::c_style | py::array::forcecast>;

py::dict density_at(const Problem& c, const Numbers& H, const Numbers& K) {
    if (c.energy.H0_varies()) throw complaint_about_H0(c, "must be a number for the density of a case");
    const std::vector<const char*> names{"f", "f_H", "f_K", "f_HH", "f_HK", "f_KK"};
    py::dict out;
    const auto part = [&](std::size_t i) {
        return of_each(std::function([&c, i](double h, double k) {
            const CurvatureJet<double> d = density(c.energy, h, k);
            return std::array{d.f, d.H, d.K, d.HH, d.HK, d.KK}[i];
        }));
    };
    for (std::size_t i = 0; i < names.size(); ++i) out[names[i]] = part(i)(H, K);
    return out;
}

py::object growth_rates(const Problem& c, const Numbers& q, int m, std::optional<double> tension) {
    const auto start = theory::tube_start(c);
    if (!start) throw std::invalid_argument("growth rates in closed form need a case with shape.kind = \"tube\"");
    require_within("m", m, 0, most_modes);
    if (tension) require_within("tension", *tension, -largest_number, largest_number);
    theory::UniformTube tube = start->tube;
    if (tension) tube.tension = *tension;
    const MotionLaw& law = c.law;
    return of_each(std::function([&](double wave) { return theory::growth(tube, law, wave, m).rate(); }))(q);
}

// ---- scans

py::dict scan(const Problem& c, const std::vector<std::string>& over, const std::string& boundary,
              const std::filesystem::path& file, bool overwrite, std::optional<int> jobs, bool to_the_end) {
    ScanChoices choices;
    choices.over = over, choices.boundary = boundary, choices.to_the_end = to_the_end;
    const auto run = [&] {
        const int threads = scan_threads(jobs);
        check_output(file);
        const Scan asked = scan_of(c, choices);
        if (!overwrite) refuse_to_replace_another_scan(asked, file);
        ScanWriter writer = ScanWriter::create(file, asked, about_start());
        Dispatcher dispatcher(writer, true);
        run_scan(dispatcher, asked, threads);
        const Stop stop = dispatcher.was_interrupted() ? Stop::interrupted : Stop::finished;
        if (writer.began()) writer.finish({{"stop", std::string(name(stop))}});
        return writer.result();
    };
    const ScanResult done = as_arguments([&] { return without_gil(1, run); });
    py::dict out;
    py::list outcomes, messages;
    for (const PointResult& p : done.points) outcomes.append(std::string(name(p.outcome))), messages.append(p.message);
    out["outcome"] = outcomes, out["message"] = messages;
    for (std::size_t i = 0; i < n_measures; ++i) {
        std::vector<double> values;
        for (const PointResult& p : done.points) values.push_back(p.measures[i]);
        out[measure_names[i]] = numpy(values);
    }
    py::list axes;
    for (const Axis& axis : done.scan.axes) axes.append(py::make_tuple(axis.keys, axis.values));
    out["axes"] = axes;
    return out;
}

void add_errors(py::module_& m) {
    const auto add_error = [&](py::object type, const char* meaning) {
        type.attr("__doc__") = meaning;
        type.attr("__module__") = "tubule";
    };
    add_error(py::register_exception<CaseError>(m, "CaseError", PyExc_ValueError),
              "Bad input: where it is, what is wrong, what is allowed, and what was probably meant.");
    add_error(py::register_exception<SolveError>(m, "SolveError", PyExc_RuntimeError),
              "The numerics failed before there was anything to return.");
}

void add_cases(py::module_& m) {
    py::class_<Problem>(m, "Case")
        .def_readonly("path", &Problem::path)
        .def_readonly("text", &Problem::text)
        .def_readonly("sets", &Problem::sets)
        .def_readonly("title", &Problem::title)
        .def_property_readonly("toml", [](const Problem& c) { return effective_toml(c); })
        .def_property_readonly("units",
                               [](const Problem& c) {
                                   const auto scales = known_scales(c);
                                   return scales ? line_of(json_of(*scales)) : "{}";
                               })
        .def_property_readonly("is_equilibrium", [](const Problem& c) { return c.is_equilibrium(); });
    m.def(
        "parse_case",
        [](const std::string& text, const std::vector<std::string>& sets, const std::string& path) {
            return Problem(parse_case(text, sets, path));
        },
        py::arg("text"), py::arg("sets"), py::arg("path"));
    m.def(
        "read_case",
        [](const std::filesystem::path& path, const std::vector<std::string>& sets) {
            return Problem(read_case(with_installed_case(path.string()), sets));
        },
        py::arg("path"), py::arg("sets"));
}

void add_results(py::module_& m) {
    py::class_<Results>(m, "Results")
        .def_property_readonly("about", [](const Results& r) { return dictionary(r.result->about); })
        .def_property_readonly("series_names", [](const Results& r) { return r.result->series_names; })
        .def("series",
             [](const Results& r, const std::string& name) {
                 const auto found = r.result->series.find(name);
                 if (found == r.result->series.end()) throw py::key_error(name);
                 return numpy(found->second);
             })
        .def("dimensions",
             [](const Results&, const std::string& name) {
                 const SeriesEntry* entry = find_series(name);
                 return std::string(entry ? entry->unit : "");
             })
        .def("case",
             [](const Results& r, const std::string& name) { return Problem(case_of_result(*r.result, name, {})); })
        .def_property_readonly("frames", [](const Results& r) { return r.result->frames.size(); })
        .def("frame", &frame_dictionary)
        .def("mesh", &mesh_dictionary)
        .def("profile", &profile)
        .def("image", [](const Results& r) {
            const std::vector<std::byte> image = result_image(*r.result);
            return py::bytes(reinterpret_cast<const char*>(image.data()), image.size());
        });
    py::class_<Flag, std::shared_ptr<Flag>>(m, "Flag").def(py::init<>()).def("raise_it", [](Flag& f) {
        f.raised = true;
    });
    m.def("run", &run, py::arg("case"), py::arg("progress"), py::arg("output"), py::arg("overwrite"),
          py::arg("threads"), py::arg("enough") = nullptr);
    m.def("read_result",
          [](const std::filesystem::path& file) { return Results{std::make_shared<const Result>(read_result(file))}; });
}

void add_closed_forms(py::module_& m) {
    m.def("density", &density_at);
    m.def("growth_rates", &growth_rates);
    m.def("profile_curvatures",
          [](const Numbers& r, const Numbers& r1, const Numbers& r2, const Numbers& z1, const Numbers& z2) {
              const auto part = [&](auto member) {
                  return of_each(std::function([member](double a, double b, double c, double d, double e) {
                      return profile_point(a, b, c, d, e).*member;
                  }))(r, r1, r2, z1, z2);
              };
              return py::make_tuple(part(&ProfilePoint<double>::H), part(&ProfilePoint<double>::K));
          });
    m.def("forecast", [](const Problem& c) {
        const Forecast f = without_gil(0, [&] { return forecast(c); });
        py::dict out;
        out["resolution"] = f.resolution, out["steps"] = f.steps, out["seconds"] = f.seconds, out["bytes"] = f.bytes;
        out["finer_runs"] = f.finer_runs;
        return out;
    });
}

void add_answers(py::module_& m) {
    py::class_<StabilityOptions>(m, "StabilityOptions")
        .def(py::init<>())
        .def_readwrite("model", &StabilityOptions::model)
        .def_readwrite("q", &StabilityOptions::q)
        .def_readwrite("fit", &StabilityOptions::fit)
        .def_readwrite("Re", &StabilityOptions::Re, "a number")
        .def_readwrite("gamma", &StabilityOptions::gamma, "a number")
        .def_readwrite("tension", &StabilityOptions::tension, "a number")
        .def_readwrite("kT", &StabilityOptions::kT, "a number")
        .def_readwrite("waves", &StabilityOptions::waves, "an integer")
        .def_readwrite("frame", &StabilityOptions::frame, "an integer")
        .def_readwrite("modes", &StabilityOptions::modes, "an integer")
        .def_readwrite("rates", &StabilityOptions::rates, "an integer")
        .def_readwrite("numerical", &StabilityOptions::numerical);
    m.def("stability", [](const Problem& c, StabilityOptions options) {
        options.json = true, options.file = c.path;
        return as_arguments([&] {
            return without_gil(0, [&] { return stability_answer(options, StabilitySubject{c, true, {}, {}}); });
        });
    });
    m.def("stability", [](const Results& r, const std::string& name, StabilityOptions options) {
        options.json = true, options.file = name;
        return as_arguments([&] {
            return without_gil(0, [&] { return stability_answer(options, stability_subject(*r.result, options)); });
        });
    });
    m.def("compare",
          [](const Results& a, const Results& b, bool align, bool shapes, const std::vector<std::string>& frames) {
              CompareOptions options;
              options.results = {"a", "b"}, options.frames = frames, options.align = align, options.no_shapes = !shapes;
              return as_arguments(
                  [&] { return without_gil(0, [&] { return comparison_json(options, *a.result, *b.result); }); });
          });
    m.def("scan", &scan);
    m.def("scan_threads", [](std::optional<int> jobs) { return as_arguments([&] { return scan_threads(jobs); }); });
    m.def("build_info", &build_info);
}

}  // namespace

PYBIND11_MODULE(_core, m) {
    add_errors(m);
    add_cases(m);
    add_results(m);
    add_closed_forms(m);
    add_answers(m);
}

}  // namespace tubule
