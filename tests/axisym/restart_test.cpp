// An interrupted run resumes from its record as if nothing had happened, within the asked accuracy.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>

#include "common/geometry/profile_point.hpp"
#include "common/result/frame_profile.hpp"
#include "tests/axisym/runs.hpp"
#include "tests/missing_fields.hpp"
#include "tests/support/message_of.hpp"

namespace tubule::axisym::restart_test {

Case relaxing(double asked) {
    Case c = tube_case(bending(0.2, -2, 0, 0.06), 1, 2, {{0.25, 1, 0, -pi / 2}, {0.05, 2}}, 0.5, {0.01, 0.05, 0.2});
    c.accuracy.energy = asked;
    return c;
}
Case pinching(double asked) {  // remeshes on its way
    Case c = tube_case(bending(0.2, -2), 1, 2, {{0.6, 1}}, 1, {0.1});
    c.accuracy.energy = asked;
    return c;
}

// Interrupted after the first step beyond a time.
Outcome interrupted_at(const Case& c, double time) {
    return run_case(c, nullptr, [=](double t) { return t > time; });
}

TEST(Restart, endsWithinTheAskedAccuracy) {
    for (double asked : {1e-4, 1e-7})
        for (const auto& [c, time] :
             {std::pair{relaxing(asked), 0.02}, {relaxing(asked), 0.1}, {pinching(asked), 0.05}}) {
            const Outcome whole = run_case(c), first = interrupted_at(c, time);
            ASSERT_EQ(first.summary.stop.reason, Stop::interrupted);
            ASSERT_EQ(first.log.checkpoints.size(), 1u);
            const Record& record = first.log.checkpoints[0];
            EXPECT_EQ(record.time, first.summary.stop.time);
            const Outcome second = run_case(c, &record);
            EXPECT_EQ(second.summary.stop.reason, whole.summary.stop.reason) << second.summary.stop.message;
            const double E_ref = whole.summary.reference_energy;
            EXPECT_NEAR(second.summary.reference_energy, E_ref, 1e-3 * E_ref);
            if (second.log.discards == 0) {  // else it had to begin again with finer settings
                EXPECT_GT(second["time"].front(), record.time);
                EXPECT_EQ(second.summary.reference_energy, first.summary.reference_energy);
                EXPECT_GE(second.summary.estimated_error, 0.999 * first.summary.estimated_error);  // and continues
            }
            EXPECT_NEAR(second.summary.energy, whole.summary.energy, asked * E_ref);
            EXPECT_NEAR(second.summary.stop.time, whole.summary.stop.time, 100 * asked * whole.summary.stop.time);
            EXPECT_LE(second.summary.estimated_error, asked);
            // The dissipation identity spans both parts.
            EXPECT_NEAR(second.last("identity_defect"), whole.last("identity_defect"), 100 * asked * E_ref);
        }
}

TEST(Restart, isTheSameEachTimeAlsoThroughTheFile) {
    const Case c = pinching(1e-6);
    const Outcome first = interrupted_at(c, 0.05);
    ASSERT_EQ(first.log.checkpoints.size(), 1u);
    const auto file = std::filesystem::path(testing::TempDir()) / ("restart_" + std::to_string(getpid()) + ".hdf");
    {
        ResultWriter writer = ResultWriter::create(file, {"tier = \"axisym\"\n", {}}, {}, series_names(c));
        for (const auto& row : first.log.rows) writer.row(row);
        for (const Record& frame : first.log.frames) writer.frame(frame);
        writer.checkpoint(first.log.checkpoints[0]);
        writer.finish({});
    }
    const Result result = read_result(file);
    std::filesystem::remove(file);
    ASSERT_TRUE(result.checkpoint);
    const Outcome a = run_case(c, &first.log.checkpoints[0]), b = run_case(c, &*result.checkpoint);
    EXPECT_NEAR(a.summary.energy, b.summary.energy, 1e-10 * a.summary.energy);
    EXPECT_NEAR(a.summary.stop.time, b.summary.stop.time, 1e-10);
    EXPECT_EQ(a.log.rows.size(), b.log.rows.size());
}

TEST(Restart, fromAFrame) {
    // Frames are restart records too. Expected: the uninterrupted run.
    const Case c = relaxing(1e-6);
    const Outcome whole = run_case(c);
    ASSERT_EQ(whole.log.frames.size(), 5u);  // 0, three outputs, the end
    for (int i : {0, 1, 3}) {
        const Outcome again = run_case(c, &whole.log.frames[i]);
        EXPECT_NEAR(again.summary.energy, whole.summary.energy, 1e-6 * whole.summary.reference_energy) << i;
        EXPECT_EQ(again.log.frames.size(), 4u - i) << i;  // none twice
        EXPECT_EQ(again.log.frames.back().time, 0.5);
    }
}

TEST(Restart, refusesRecordsOfAnotherKind) {
    const Case c = relaxing(1e-4);
    const auto message = [&](const Record& record) -> std::string {
        return test::message_of<std::runtime_error>([&] { run_case(c, &record); });
    };
    Record record = run_case(c).log.frames[1];
    EXPECT_EQ(message(record), "accepted");
    record.kind = RecordKind::equilibrium;
    EXPECT_EQ(message(record),
              "cannot resume from this frame: its kind is equilibrium, not graph; run the case without --resume");
}

// Expected: every field of the state is needed, for a run as a graph and one as a curve.
TEST(Restart, refusesARecordThatLacksAField) {
    Case c = relaxing(1e-3);
    c.time.end = 1e-3, c.time.output.clear();
    const Record graph = run_case(c).log.frames.front();
    EXPECT_EQ(kind_of(graph), RecordKind::graph);
    expect_each_field_is_needed<std::runtime_error>(graph, "restart_", check_restart);
    c.discretisation.parametrisation = Parametrisation::even;
    const Record curve = run_case(c).log.frames.front();
    EXPECT_EQ(kind_of(curve), RecordKind::curve);
    expect_each_field_is_needed<std::runtime_error>(curve, "restart_", check_restart);
}

// What a case may start from: the spline of a graph, else points.
TEST(Frame, isNoStartWithoutItsProfile) {
    const auto profile = [](const Record& record) { return frame_curve(record); };
    Case c = relaxing(1e-3);
    c.time.end = 1e-3, c.time.output.clear();
    Record frame = run_case(c).log.frames.front();
    for (const char* field : {"degree", "length", "knots", "coefficients"})
        expect_each_field_is_needed<std::invalid_argument>(frame, field, profile);
    frame.kind = RecordKind::equilibrium;
    for (const char* field : {"r", "z", "length"}) {
        std::erase_if(frame.arrays, [](const Array& a) { return a.name.starts_with("restart_"); });
        std::erase_if(frame.numbers, [](const auto& n) { return n.first.starts_with("restart_"); });
        expect_each_field_is_needed<std::invalid_argument>(frame, field, profile);
    }
}

TEST(Frame, holdsTheProfileOverThePeriod) {
    // Expected: at t = 0 the given profile and its curvatures; u_n = r_t/g with the flow's dE/dt = -INT u_n^2 dS.
    Case c = relaxing(1e-7);
    const Outcome o = run_case(c);
    const Record& frame = o.log.frames[0];
    const auto array = [&](const char* name) -> const std::vector<double>& {
        for (const Array& a : frame.arrays)
            if (a.name == name) return a.data;
        throw std::runtime_error(name);
    };
    const auto &z = array("z"), &r = array("r"), &H = array("H"), &K = array("K"), &u = array("u_n");
    EXPECT_EQ(z.front(), 0);
    EXPECT_EQ(z.back(), 2);
    double dissipation = 0, previous = 0;
    for (std::size_t i = 0; i < z.size(); ++i) {
        const double w = pi * z[i], r0 = 1 + 0.25 * std::sin(w) + 0.05 * std::cos(2 * w);
        const double r1 = pi * (0.25 * std::cos(w) - 0.1 * std::sin(2 * w));
        const double r2 = -pi * pi * (0.25 * std::sin(w) + 0.2 * std::cos(2 * w));
        const auto p = graph_point(r0, r1, r2);
        EXPECT_NEAR(r[i], r0, 1e-6);
        EXPECT_NEAR(H[i], p.H, 2e-3);
        EXPECT_NEAR(K[i], p.K, 2e-3);
        const double density = u[i] * u[i] * p.area;
        if (i > 0) dissipation += (z[i] - z[i - 1]) * (density + previous) / 2;
        previous = density;
    }
    EXPECT_NEAR(dissipation, o["dissipation"].front(), 0.02 * dissipation);
    for (const auto& [name, value] : frame.numbers) {
        if (name.starts_with("restart_")) continue;
        const double expected = name == "degree" ? 5 : name == "length" ? 2 : o["energy"].front();
        EXPECT_EQ(value, expected) << name;
    }
}

}  // namespace tubule::axisym::restart_test
