// A tube with a wave, in gradient flow, as a result that `tubule show` and `plot` read.
//
// run_a_tube [CASE RESULT]      a case of tier axisym from a file, or the one below
#include <cstdio>
#include <string>
#include <vector>

#include "axisym/run_profile.hpp"
#include "common/case/read.hpp"
#include "common/result/result.hpp"

using namespace tubule;

namespace {

// Writes all rows and frames, and prints some.
class Watch : public RunObserver {
public:
    Watch(ResultWriter& writer, const std::vector<std::string>& series) : writer_(writer) {
        for (std::size_t i = 0; i < series.size(); ++i)
            if (series[i] == "r_min") r_min_ = i;
    }
    void row(std::span<const double> values) override {
        writer_.row(values);
        if (++rows_ % 10 == 1) std::printf("t = %-10.4g r_min = %.6f\n", values[0], values[r_min_]);
    }
    void frame(const std::function<Record()>& make) override { writer_.frame(make()); }
    void discard() override { writer_.discard(); }

private:
    ResultWriter& writer_;
    std::size_t r_min_ = 0;
    int rows_ = 0;
};

const char* const example = R"(
tier = "axisym"
[energy]
k20 = 0.2
H0 = -2.0
k42 = 0.06
[shape]
kind = "tube"
radius = 1.0
length = 2.0
mode = [{amplitude = 0.3, n = 1}]
[accuracy]
energy = 1e-4
[time]
end = 0.4
output = [0.1, 0.2, 0.3]
)";

}  // namespace

int main(int argc, char** argv) {
    const bool given = argc > 2;
    try {
        const Case c = given ? read_case(argv[1])
                             : parse_case(example, {"energy.k42=0.12"}, "in memory");  // overrides as in --set
        const auto series = axisym::series_names(c);
        ResultWriter writer = ResultWriter::create(given ? argv[2] : "run_a_tube.hdf", {c.text, c.sets}, {}, series);
        Watch watch(writer, series);
        const RunSummary run = axisym::run_profile(c, watch);
        writer.finish({{"stop", std::string(name(run.stop.reason))}});
        std::printf("%s: %s\nenergy %.6f, estimated error %.1e of E_ref = %.4f\n",
                    std::string(name(run.stop.reason)).c_str(), run.stop.message.c_str(), run.energy,
                    run.estimated_error, run.reference_energy);
    } catch (const CaseError& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 2;
    }
}
