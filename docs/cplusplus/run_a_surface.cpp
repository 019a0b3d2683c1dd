// An ellipsoid in three dimensions, overdamped: its energy at some times, and its points at the end.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "common/case/read.hpp"
#include "surface3d/run/run_surface.hpp"

using namespace tubule;

namespace {

class Watch : public RunObserver {
public:
    explicit Watch(const std::vector<std::string>& series) {
        energy_ = static_cast<std::size_t>(std::find(series.begin(), series.end(), "energy") - series.begin());
    }
    std::size_t mesh(const SurfaceCells& cells) override {
        cells_ = cells;
        return 0;
    }
    void row(std::span<const double> values) override { rows_.emplace_back(values[0], values[energy_]); }
    void frame(const std::function<Record()>& make) override { last_ = make(); }
    void discard() override { rows_.clear(); }

    void print() const {
        for (const auto& [t, energy] : rows_) std::printf("t = %-8.4g energy %.4f\n", t, energy);
        for (const Array& array : last_.arrays) {
            if (array.name != "points") continue;
            double width = 0;
            for (std::size_t i = 0; i < array.data.size(); i += 3) width = std::max(width, std::abs(array.data[i]));
            std::printf("%zu nodes in cells of order %d, largest |x| %.4f\n", cells_.nodes, cells_.order, width);
        }
    }

private:
    std::size_t energy_ = 0;
    SurfaceCells cells_;
    std::vector<std::pair<double, double>> rows_;
    Record last_;
};

}  // namespace

int main() {
    const Case c = parse_case(R"(
tier = "surface3d"
[energy]
k20 = 0.5
[shape]
kind = "ellipsoid"
a = 0.8
b = 1.0
c = 1.3
[model]
kind = "overdamped"
[accuracy]
energy = 0.1
[discretisation]
elements = 60
order = 3
[time]
end = 0.02
output = [0.01]
)",
                              {}, "in memory");
    Watch watch(surface3d::series_names(c));
    const RunSummary run = surface3d::run_surface(c, watch);
    watch.print();
    std::printf("%s at t = %g\n", std::string(name(run.stop.reason)).c_str(), run.stop.time);
    return exit_code(run.stop.reason);
}
