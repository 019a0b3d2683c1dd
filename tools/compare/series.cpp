#include "tools/compare/series.hpp"

#include <algorithm>
#include <cmath>

#include "common/series/catalogue.hpp"
#include "tools/compare/results.hpp"

namespace tubule::compare {

namespace {

constexpr double same_time = 1e-12;  // of the later one
constexpr double halved = 4;         // least factor by which the error falls if rows are half as far apart

// Series of other versions count as quantities.
SeriesUse use_of(const std::string& name) {
    const SeriesEntry* entry = find_series(name);
    return entry ? entry->use : SeriesUse::quantity;
}

bool same(double s, double t) {
    return std::abs(s - t) <= same_time * std::max(std::abs(s), std::abs(t));
}

// At x[at], of the parabola through three points.
double parabola_slope(const std::vector<double>& x, const std::vector<double>& y, std::size_t first, std::size_t at) {
    double sum = 0;
    for (std::size_t i = first; i < first + 3; ++i)
        for (std::size_t j = first; j < first + 3; ++j) {
            if (j == i) continue;
            double term = y[i] / (x[i] - x[j]);
            for (std::size_t k = first; k < first + 3; ++k)
                if (k != i && k != j) term *= (x[at] - x[k]) / (x[i] - x[k]);
            sum += term;
        }
    return sum;
}

std::vector<double> parabola_slopes(const std::vector<double>& x, const std::vector<double>& y) {
    const std::size_t n = x.size();
    if (n < 3) return std::vector<double>(n, n == 2 ? (y[1] - y[0]) / (x[1] - x[0]) : 0);
    std::vector<double> out;
    for (std::size_t i = 0; i < n; ++i) out.push_back(parabola_slope(x, y, i == 0 ? 0 : std::min(i - 1, n - 3), i));
    return out;
}

EnergyTrace through(const std::vector<double>& times, const std::vector<double>& values,
                    const std::vector<double>& slopes) {
    EnergyTrace out;
    for (std::size_t i = 0; i < times.size(); ++i) out.add(times[i], values[i], slopes[i]);
    return out;
}

double largest_magnitude(const std::vector<double>& values) {
    double most = 0;
    for (const double v : values) most = std::max(most, std::abs(v));
    return most;
}

bool has(const Result& result, const std::string& series) {
    return result.series.contains(series);
}

Trace rate_of(const Result& result) {
    const std::vector<double>& times = result.series.at("time");
    if (has(result, "dissipation")) {
        std::vector<double> values = result.series.at("dissipation");
        for (double& v : values) v = -v;
        return {times, values, nullptr};
    }
    std::vector<double> total = result.series.at("energy");
    if (has(result, "kinetic_energy"))
        for (std::size_t i = 0; i < total.size(); ++i) total[i] += result.series.at("kinetic_energy")[i];
    const Trace energy(times, total, nullptr);
    std::vector<double> slopes;
    for (std::size_t i = 0; i < energy.times().size(); ++i) slopes.push_back(energy.slope(i));
    return {energy.times(), slopes, nullptr};
}

// Times of rows that both span, each once.
std::vector<double> common_times(const Trace& a, const Trace& b) {
    std::vector<double> all, out;
    std::merge(a.times().begin(), a.times().end(), b.times().begin(), b.times().end(), std::back_inserter(all));
    double from = std::max(a.begin(), b.begin()), to = std::min(a.end(), b.end());
    if (from > to && same(from, to)) std::swap(from, to);
    for (const double t : all)
        if (t >= from && t <= to && (out.empty() || !same(out.back(), t))) out.push_back(t);
    return out;
}

SeriesDifference difference(const std::string& name, const Trace& a, const Trace& b, double scale) {
    SeriesDifference out;
    out.name = name, out.scale = scale, out.times = common_times(a, b);
    if (!out.times.empty()) out.when = out.times.front();
    for (const double t : out.times) {
        out.a.push_back(a(t)), out.b.push_back(b(t));
        const double unsure = a.error(t) + b.error(t), apart = std::abs(a(t) - b(t));
        out.unsure.push_back(unsure);
        out.largest_unsure = std::max(out.largest_unsure, unsure);
        if (apart - unsure > out.largest) out.largest = apart - unsure, out.when = t;
        if (a.row_at(t) && b.row_at(t)) out.largest_in_rows = std::max(out.largest_in_rows, apart), ++out.rows_in_both;
        out.at_end = apart;
    }
    if (out.scale == 0) out.scale = largest_magnitude(out.a);
    if (out.scale == 0) out.scale = 1;
    return out;
}

}  // namespace

Trace::Trace(const std::vector<double>& times, const std::vector<double>& values, const std::vector<double>* slopes) {
    std::vector<double> t, v;
    for (std::size_t i = 0; i < times.size(); ++i) {
        if (!t.empty() && same(t.back(), times[i])) {
            v.back() = values[i];
            if (slopes) slope_.back() = (*slopes)[i];
            continue;
        }
        t.push_back(times[i]), v.push_back(values[i]);
        if (slopes) slope_.push_back((*slopes)[i]);
    }
    if (!slopes) slope_ = parabola_slopes(t, v);
    rows_ = through(t, v, slope_);
    const std::size_t n = t.size();
    left_out_.assign(n, 0);
    for (std::size_t i = 1; i + 1 < n; ++i) left_out_[i] = off_without(i, slopes != nullptr);
    if (n > 2) left_out_[0] = left_out_[1], left_out_[n - 1] = left_out_[n - 2];
}

// The error at row i of the interpolation without this row; unknown slopes are computed without it, too.
double Trace::off_without(std::size_t i, bool slopes_known) const {
    std::vector<double> t, v, slope;
    for (std::size_t j = i < 3 ? 0 : i - 3; j <= std::min(i + 3, times().size() - 1); ++j)
        if (j != i) t.push_back(times()[j]), v.push_back(values()[j]), slope.push_back(slope_[j]);
    return std::abs(through(t, v, slopes_known ? slope : parabola_slopes(t, v))(times()[i]) - values()[i]);
}

// The first row at t or after it.
std::size_t Trace::next_row(double t) const {
    return static_cast<std::size_t>(std::ranges::lower_bound(times(), t) - times().begin());
}

std::optional<std::size_t> Trace::row_at(double t) const {
    const std::size_t next = next_row(t);
    if (next < times().size() && same(times()[next], t)) return next;
    if (next > 0 && same(times()[next - 1], t)) return next - 1;
    return std::nullopt;
}

double Trace::operator()(double t) const {
    const auto row = row_at(t);
    return row ? values()[*row] : rows_(t);
}

double Trace::error(double t) const {
    if (row_at(t)) return 0;
    const std::size_t next = next_row(t);
    return std::max(left_out_[next - 1], left_out_[next]) / halved;
}

namespace {

// F does unless loads change, theory.md (3.20); E where it is F.
bool falls_by_dissipation(const Result& result, const std::string& series) {
    if (series == "free_energy") return !has(result, "work");
    if (series != "energy") return false;
    return !has(result, "free_energy") || result.series.at("free_energy") == result.series.at("energy");
}

}  // namespace

Trace trace_of(const Result& result, const std::string& series) {
    const std::vector<double>& times = result.series.at("time");
    const bool moves_only_downhill =
        has(result, "dissipation") &&
        (!has(result, "kinetic_energy") || largest_magnitude(result.series.at("kinetic_energy")) == 0);
    if (!falls_by_dissipation(result, series) || !moves_only_downhill)
        return {times, result.series.at(series), nullptr};
    std::vector<double> slopes = result.series.at("dissipation");
    for (double& slope : slopes) slope = -slope;
    return {times, result.series.at(series), &slopes};
}

std::vector<SeriesDifference> compare_series(const Result& a, const Result& b) {
    std::vector<SeriesDifference> out;
    const auto add = [&](const std::string& name, const Trace& of_a, const Trace& of_b, double scale) {
        SeriesDifference d = difference(name, of_a, of_b, scale);
        if (!d.times.empty()) out.push_back(std::move(d));
    };
    if (a.series.at("time").empty() || b.series.at("time").empty()) return out;
    for (const std::string& name : a.series_names) {
        const SeriesUse use = use_of(name);
        if (use == SeriesUse::effort || use == SeriesUse::diagnostic || !has(b, name)) continue;
        add(name, trace_of(a, name), trace_of(b, name), use == SeriesUse::energy ? reference_energy(a) : 0);
    }
    if (has(a, "energy") && has(b, "energy") && a.series.at("time").size() > 1 && b.series.at("time").size() > 1)
        add("rate", rate_of(a), rate_of(b), 0);
    return out;
}

double drift(const Result& result, const std::string& series) {
    double most = 0;
    if (has(result, series))
        for (const double value : result.series.at(series))
            most = std::max(most, std::abs(value / result.series.at(series).front() - 1));
    return most;
}

}  // namespace tubule::compare
