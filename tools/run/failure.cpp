#include "tools/run/failure.hpp"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <cmath>
#include <new>
#include <string>

#include "common/case/read.hpp"

namespace tubule {
namespace {

// Beyond this, and below its inverse, fourth powers and their products with a modulus need not be finite.
constexpr double extreme = 1e50;

// Numbers of a case beyond that, "key = value", joined by commas.
std::string extreme_numbers(const toml::node& node, const std::string& key) {
    std::string found;
    const auto add = [&](const std::string& more) {
        if (!more.empty()) found += (found.empty() ? "" : ", ") + more;
    };
    const auto under = [&](std::string_view name) {
        return key.empty() ? std::string(name) : fmt::format("{}.{}", key, name);
    };
    if (const toml::table* table = node.as_table())
        for (const auto& [name, value] : *table) add(extreme_numbers(value, under(name.str())));
    if (const toml::array* list = node.as_array())
        for (std::size_t i = 0; i < list->size(); ++i) add(extreme_numbers((*list)[i], under(std::to_string(i))));
    if (node.is_number()) {
        const double size = std::abs(node.value<double>().value());
        if (size > extreme || (size > 0 && size < 1 / extreme))
            return fmt::format("{} = {}", key, node.value<double>().value());
    }
    return found;
}

}  // namespace

void blame_extreme_numbers(const Problem& c, StopReport& stop) {
    const std::string numbers = extreme_numbers(toml::parse(effective_toml(c)), "");
    if (numbers.empty()) return;
    stop.message = fmt::format("the numbers of the case are too large or too small to compute with: {}", numbers);
    stop.advice = "choose units in which they are nearer to 1";
}

StopReport failure_of(const Problem& c, const std::exception& error, std::optional<double> reached) {
    const std::string where = reached ? fmt::format("after t = {:.6g}", *reached) : "at the start";
    StopReport stop{Stop::solver_failed, reached.value_or(0), fmt::format("{} ({})", error.what(), where),
                    "try another accuracy.energy or discretisation.elements, or a smoother shape"};
    if (dynamic_cast<const std::bad_alloc*>(&error)) {
        stop.message = fmt::format("memory ran out {}", where);
        stop.advice = "ask for less accuracy (accuracy.energy) or fewer elements (discretisation.elements)";
    }
    blame_extreme_numbers(c, stop);
    return stop;
}

RunSummary failed_run(const Problem& c, const std::exception& error, std::optional<double> reached) {
    RunSummary summary;
    summary.stop = failure_of(c, error, reached);
    summary.estimated_error = 1;
    summary.warnings.emplace_back("the error is unknown");
    return summary;
}

}  // namespace tubule
