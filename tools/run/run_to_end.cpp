#include "tools/run/run_to_end.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <new>
#include <string>

#include "common/case/read.hpp"
#include "common/case/toml_input.hpp"
#include "common/result/durable_io.hpp"
#include "common/series/table.hpp"
#include "tools/run/case_checks.hpp"
#include "tools/run/forecast.hpp"

namespace tubule {
namespace {

// Beyond this, and below its inverse, fourth powers and their products with a modulus need not be finite.
constexpr double extreme = 1e50;

// Replaces the message of a run that failed where numbers of the case are so large or small that their powers and
// products need not be finite.
void blame_extreme_numbers(const Problem& c, StopReport& stop) {
    std::vector<std::string> numbers;
    walk(toml::parse(effective_toml(c)), "", [&](const std::string& key, const toml::node& node) {
        const double value = node.is_number() ? node.value<double>().value() : 0, size = std::abs(value);
        if (size > extreme || (size > 0 && size < 1 / extreme)) numbers.push_back(fmt::format("{} = {}", key, value));
        return true;
    });
    if (numbers.empty()) return;
    stop.message =
        fmt::format("the numbers of the case are too large or too small to compute with: {}", fmt::join(numbers, ", "));
    stop.advice = "choose units in which they are nearer to 1";
}

// Hands everything on, and keeps what the end is reported by.
class Watched : public PassingOn {
public:
    Watched(const Engine& engine, RunObserver& to)
        : PassingOn(to), case_(engine.problem()), series_(engine.series_names()) {}
    void row(std::span<const double> values) override {
        PassingOn::row(values);
        reached = values.front();
        defect = std::fmax(defect, std::abs(value_in(values, series_, "identity_defect")));
    }
    void frame(const std::function<Record()>& make) override {
        if (std::exchange(has_frame_, true)) return PassingOn::frame(make);
        const Record record = make();
        if (const std::string cost = cost_of_frames(case_, record); !cost.empty()) note(cost);
        PassingOn::frame([&] { return record; });
    }
    void discard() override {
        defect = 0;
        PassingOn::discard();
    }

    std::optional<double> reached;
    double defect = 0;  // the largest identity_defect

private:
    const Problem& case_;
    std::vector<std::string> series_;
    bool has_frame_ = false;
};

}  // namespace

StopReport failure_of(const Problem& c, const std::exception& error, std::optional<double> reached) {
    const std::string where = reached ? fmt::format("after t = {:.6g}", *reached) : "at the start";
    StopReport stop{Stop::solver_failed, reached.value_or(0), fmt::format("{} ({})", error.what(), where),
                    "try another accuracy.energy or discretisation.elements, or a smoother initial shape"};
    if (dynamic_cast<const std::bad_alloc*>(&error)) {
        stop.message = fmt::format("memory ran out {}", where);
        stop.advice = "use a looser accuracy.energy or fewer elements (discretisation.elements)";
    }
    blame_extreme_numbers(c, stop);
    return stop;
}

Ended run_to_end(const Engine& engine, RunObserver& observer, const Restart* restart, const Result* unfinished) {
    const Problem& c = engine.problem();
    Watched watched(engine, observer);
    Ended out;
    const auto fail = [&](const std::exception& error) {
        out.summary.stop = failure_of(c, error, watched.reached);
        out.summary.estimated_error = 1;
        out.summary.warnings.emplace_back("the error is unknown");
        out.failed = true;
    };
    try {
        out.summary = engine.run(watched, restart, unfinished);
        if (out.summary.stop.reason == Stop::solver_failed) blame_extreme_numbers(c, out.summary.stop);
    } catch (const durable::Error&) {
        throw;
    } catch (const CaseError& error) {
        if (!watched.reached) throw;
        fail(error);
    } catch (const std::exception& error) {
        fail(error);
    }
    out.reached = watched.reached;
    if (std::string off = balance_warning(c, out.summary, watched.defect); !off.empty())
        out.summary.warnings.push_back(std::move(off));
    return out;
}

}  // namespace tubule
