// Series of two results over time.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/result/result.hpp"
#include "common/run/energy_trace.hpp"

namespace tubule::compare {

// A series of one result, between its rows by EnergyTrace, and what that may be off.
class Trace {
public:
    // The last one of rows at the same time counts. Without `slopes` those of parabolas through neighbours are taken.
    Trace(const std::vector<double>& times, const std::vector<double>& values, const std::vector<double>* slopes);

    double begin() const { return times().front(); }
    double end() const { return times().back(); }
    const std::vector<double>& times() const { return rows_.times(); }
    const std::vector<double>& values() const { return rows_.energies(); }

    double operator()(double t) const;  // begin() <= t <= end()
    std::optional<std::size_t> row_at(double t) const;
    double slope(std::size_t row) const { return slope_[row]; }
    // Estimated error of the interpolation at t: a quarter of that at the neighbouring rows when each is left out.
    double error(double t) const;

private:
    std::size_t next_row(double t) const;
    double off_without(std::size_t i, bool slopes_known) const;

    EnergyTrace rows_;
    std::vector<double> slope_, left_out_;
};

// The energy's slope is minus the dissipation, unless there is kinetic energy too.
Trace trace_of(const Result& result, const std::string& series);

// A - B at all times that both results span, where either has a row.
struct SeriesDifference {
    std::string name;
    double scale = 1;  // relative differences are over this: E_ref of A for energies, else the largest |A|
    std::vector<double> times, a, b;
    std::vector<double> unsure;  // estimated error of interpolation; 0 where both have a row

    // The largest |A - B| - unsure, which interpolation does not explain, and its time; the largest |A - B| at times at
    // which both have rows, and the number of these; the last one; the largest `unsure`.
    double largest = 0, when = 0, largest_in_rows = 0;
    std::size_t rows_in_both = 0;
    double at_end = 0, largest_unsure = 0;
};

// The series of computed quantities that both results have (no effort, no diagnostics), and "rate", d(E +
// E_kinetic)/dt: minus the dissipation where it is known. Empty if they have no time in common.
std::vector<SeriesDifference> compare_series(const Result& a, const Result& b);

// The largest relative change of a series since its first row; 0 if there is none.
double drift(const Result& result, const std::string& series);

}  // namespace tubule::compare
