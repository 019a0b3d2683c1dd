// What a run goes on from is what it had saved, to the last bit: through the file, and as the state that is read from
// it.
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>

#include "axisym/curve/curve_output.hpp"
#include "axisym/graph/graph_output.hpp"
#include "axisym/run_profile.hpp"
#include "common/case/read.hpp"
#include "common/result/record.hpp"
#include "surface3d/run/motion_frame.hpp"
#include "surface3d/run/run_surface.hpp"

namespace tubule::restored_state_test {

// Writes a result, and interrupts the run after so many rows.
struct Interrupted : RunObserver {
    explicit Interrupted(const Case& c, const std::vector<std::string>& series, const std::string& name)
        : file(std::filesystem::path(testing::TempDir()) / name),
          writer(ResultWriter::create(file, {c.text, c.sets}, {}, series)) {}
    void row(std::span<const double> values) override { writer.row(values), ++rows; }
    std::size_t mesh(const SurfaceCells& cells) override { return writer.mesh(cells); }
    void frame(const std::function<Record()>& make) override { writer.frame(make()); }
    void checkpoint(const Record& state) override { writer.checkpoint(state), saved = state; }
    void discard() override { writer.discard(), rows = 0; }
    bool interrupted() override { return rows > 5; }

    std::filesystem::path file;
    ResultWriter writer;
    Record saved;
    int rows = 0;
};

bool same_bits(const std::vector<double>& a, const std::vector<double>& b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
}

template <class Values>
std::vector<double> list(const Values& values) {
    return {values.data(), values.data() + values.size()};
}

// All numbers and arrays of `part` are in the record, bit for bit.
void expect_holds(const Record& record, const Record& part) {
    ASSERT_FALSE(part.arrays.empty());
    for (const auto& [name, value] : part.numbers) {
        const auto found = find_number(record, name);
        ASSERT_TRUE(found) << name;
        EXPECT_TRUE(same_bits({*found}, {value})) << name;
    }
    for (const Array& a : part.arrays) {
        const Array* found = find_array(record, a.name);
        ASSERT_TRUE(found) << a.name;
        EXPECT_EQ(found->shape, a.shape) << a.name;
        EXPECT_TRUE(same_bits(found->data, a.data)) << a.name;
    }
}

// The record as a resumed run gets it from the file.
Record read_back(Interrupted& run) {
    run.writer.finish({});
    const Record record = ResultWriter::resume(run.file).restart_record();
    std::filesystem::remove(run.file);
    EXPECT_EQ(record.time, run.saved.time);
    EXPECT_GT(record.time, 0);
    EXPECT_EQ(record.numbers.size(), run.saved.numbers.size());
    EXPECT_EQ(record.arrays.size(), run.saved.arrays.size());
    expect_holds(record, run.saved);
    return record;
}

std::string tube(const std::string& model) {
    return "tier = \"axisym\"\n[energy]\nk20 = 0.5\nH0 = -1.0\nk42 = 0.1\n[model]\nkind = \"" + model +
           "\"\n[shape]\nkind = \"tube\"\nradius = 1.0\nlength = 3.0\nmode = [{amplitude = 0.12, n = 1, phase = 0.3}]\n"
           "[accuracy]\nenergy = 1e-4\n[time]\nend = 0.2\n";
}

TEST(RestoredState, ofAGraph) {
    const Case c = parse_case(tube("gradient-flow"), {}, "case.toml");
    Interrupted run(c, axisym::series_names(c), "graph.hdf");
    ASSERT_EQ(axisym::run_profile(c, run).stop.reason, Stop::interrupted);
    const Record record = read_back(run);
    const axisym::GraphRestart s = axisym::graph_restart(record);
    Record state;
    RecordWriter w(state);
    w.array("restart_breaks", s.breaks), w.array("restart_coefficients", s.coefficients);
    w.array("restart_error_total", s.error_total), w.array("restart_error_spatial", s.error_spatial);
    w.number("restart_dissipated", s.dissipated), w.number("restart_time_tolerance", s.time_tolerance);
    w.number("restart_defect", s.mesh_loss), w.number("restart_error_max", s.error_max);
    expect_holds(record, state);
}

TEST(RestoredState, ofACurveAndItsPair) {
    const Case c = parse_case(tube("overdamped"), {}, "case.toml");
    Interrupted run(c, axisym::series_names(c), "curve.hdf");
    ASSERT_EQ(axisym::run_profile(c, run).stop.reason, Stop::interrupted);
    const Record record = read_back(run);
    const axisym::CurveRestart s = axisym::curve_restart(record);
    Record state;
    RecordWriter w(state);
    w.array("restart_breaks", s.breaks), w.array("restart_y", s.y), w.array("restart_rate", s.rate);
    w.number("restart_dissipated", s.dissipated), w.number("restart_error", s.error);
    expect_holds(record, state);
    const axisym::CurveRestart coarser = axisym::curve_restart(nested(record, "restart_coarser_", RecordKind::curve));
    EXPECT_TRUE(coarser.settings.is_coarser);
    EXPECT_GE(coarser.trace.end(), record.time);  // it leads
}

TEST(RestoredState, ofASurface) {
    const Case c = parse_case(
        "tier = \"surface3d\"\n[energy]\nk20 = 0.2\n[model]\nkind = \"fluid\"\n[shape]\nkind = \"sphere\"\nradius = "
        "1.0\n"
        "mode = [{amplitude = 0.2, l = 2, m = 1}]\n[discretisation]\nelements = 80\norder = 2\nstep = 1e-3\n"
        "[accuracy]\nenergy = 0.1\n[time]\nend = 0.2\n",
        {}, "case.toml");
    Interrupted run(c, surface3d::series_names(c), "surface.hdf");
    ASSERT_EQ(surface3d::run_surface(c, run).stop.reason, Stop::interrupted);
    const Record record = read_back(run);
    const auto restored = surface3d::motion_restart(record, Problem(c).scheme);
    Record state = surface3d::state_record(restored.state, restored.memory);
    std::erase_if(state.arrays, [](const Array& a) { return !a.name.starts_with("restart_"); });
    expect_holds(record, state);
    EXPECT_TRUE(same_bits(list(restored.state.X.reshaped()), find_array(record, "points")->data));
}

}  // namespace tubule::restored_state_test
