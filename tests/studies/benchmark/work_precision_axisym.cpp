// Prints a table for the chart docs/work_precision_axisym.svg: error of the energy relative to E_ref against CPU time,
// in whole runs of the figure's case, for accuracies asked of the program and for spline spaces with settings tuned by
// hand (the fastest of a grid of elements and time tolerances for each error). `tools/figures work-precision-axisym`.
#include <fmt/core.h>

#include <algorithm>
#include <ctime>
#include <vector>

#include "tests/studies/benchmark/figure_case.hpp"

namespace tubule::axisym {
namespace {

double cpu_milliseconds() {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

struct Point {
    double asked, error, estimate, cpu;
};

// The median of several runs.
Point measure(const Case& c, int repeats) {
    std::vector<double> times;
    Point point{};
    for (int i = 0; i < repeats; ++i) {
        ErrorWatch watch;
        const double begin = cpu_milliseconds();
        const RunSummary summary = run_profile(c, watch);
        times.push_back(cpu_milliseconds() - begin);
        point = {c.accuracy.energy, watch.error / summary.reference_energy, summary.estimated_error, 0};
        if (summary.stop.reason != Stop::finished) point.error = INFINITY;
    }
    std::nth_element(times.begin(), times.begin() + times.size() / 2, times.end());
    point.cpu = times[times.size() / 2];
    return point;
}

void print(const std::string& series, const Point& p) {
    fmt::print("{},{:.0e},{:.3e},{:.3e},{:.4f}\n", series, p.asked, p.error, p.estimate, p.cpu);
}

void asked_for(const std::string& series, Integrator integrator) {
    Case c = figure_case();
    c.time.integrator = integrator;
    for (double digits = 3; digits <= 10; digits += 0.5) {
        c.accuracy.energy = std::pow(10.0, -digits);
        print(series, measure(c, 21));
    }
}

// The points that no other point beats in both error and time.
void tuned(const std::string& series, int order, int smoothness) {
    std::vector<Point> points;
    Case c = figure_case();
    c.discretisation.order = order;
    c.discretisation.smoothness = smoothness;
    for (int elements : {4, 6, 8, 10, 12, 16, 20, 24, 28, 32, 40, 48, 64})
        for (double digits = 2.5; digits <= 9.5; digits += 0.5) {
            c.discretisation.elements = elements;
            c.discretisation.time_tolerance = std::pow(10.0, -digits);
            points.push_back(measure(c, 5));
        }
    std::sort(points.begin(), points.end(), [](const Point& a, const Point& b) { return a.cpu < b.cpu; });
    double best = 0.01;
    for (const Point& p : points)
        if (p.error < 0.7 * best) {
            print(series, p);
            best = p.error;
        }
}

}  // namespace
}  // namespace tubule::axisym

int main() {
    using namespace tubule::axisym;
    fmt::print("series,energy_asked,error,estimate,cpu_ms\n");
    asked_for("accuracy asked for, IDA", tubule::Integrator::ida);
    asked_for("accuracy asked for, Rosenbrock", tubule::Integrator::rosenbrock);
    tuned("by hand: cubic spline", 3, 2);
    tuned("by hand: cubic Hermite", 3, 1);
    tuned("by hand: quintic spline", 5, 4);
    tuned("by hand: quintic Hermite", 5, 2);
    tuned("by hand: septic spline", 7, 6);
}
