// Runs of curves that are interrupted end as if nothing had happened: the same number of pairs, and a stated error as
// that of an undisturbed run. What such a run leaves is a checkpoint.
#include <gtest/gtest.h>

#include "common/case/read.hpp"
#include "tests/axisym/runs.hpp"

namespace tubule::axisym::curve_resume_test {

// A prolate spheroid with sharp poles: three pairs of runs for 1e-4, where every pair is left by its error alone.
Case sharp(const std::string& model) {
    return parse_case("tier = \"axisym\"\n[energy]\nk20 = 1.0\nk42 = 0.05\nH0 = -0.5\n[model]\nkind = \"" + model +
                          "\"\n[shape]\nkind = \"ellipsoid\"\na = 0.35\nb = 0.35\nc = 1.2\n[accuracy]\nenergy = 1e-4\n"
                          "[time]\nend = 0.05\noutput = [0.02]\n",
                      {}, "case.toml");
}

// Keeps what a result file would, and interrupts after `most_looks` calls of interrupted().
struct Watch : Recorder {
    int looks = 0, most_looks = 1000000;
    bool interrupted() override { return ++looks > most_looks; }

    // As a result file is rewound: to the checkpoint, or to the last frame. Nothing if the run has saved none.
    std::optional<Restart> rewound() {
        if (frames.empty() && checkpoints.empty()) return std::nullopt;
        const bool saved = !checkpoints.empty() && (frames.empty() || checkpoints.back().time >= frames.back().time);
        const Record record = saved ? checkpoints.back() : frames.back();
        std::erase_if(rows, [&](const auto& row) { return row[0] > record.time; });
        return Restart{record};
    }
};

TEST(CurveResume, endsAsUndisturbedOverSeveralPairs) {
    for (const char* model : {"gradient-flow", "stokes"}) {
        SCOPED_TRACE(model);
        const Case c = sharp(model);
        Watch undisturbed;
        const RunSummary whole = run_profile(c, undisturbed);
        ASSERT_EQ(whole.stop.reason, Stop::finished) << whole.stop.message;
        ASSERT_GE(whole.attempts, 2);
        Watch watch;
        std::optional<Restart> restart;
        int later_pairs = 0;
        RunSummary s;
        for (int times = 0;; ++times) {
            ASSERT_LT(times, 100);
            watch.looks = 0, watch.most_looks = undisturbed.looks / 8;
            s = run_profile(c, watch, restart ? &*restart : nullptr);
            if (s.stop.reason != Stop::interrupted) break;
            later_pairs += s.attempts > 1;
            restart = watch.rewound();
        }
        EXPECT_GT(later_pairs, 0);
        EXPECT_EQ(s.stop.reason, Stop::finished) << s.stop.message;
        EXPECT_EQ(s.attempts, whole.attempts);
        EXPECT_EQ(s.elements, whole.elements);
        // Each resumed run has other steps, as the integrator begins again: its error is another one of that size.
        EXPECT_LT(s.estimated_error, 5 * whole.estimated_error);
        EXPECT_GT(s.estimated_error, whole.estimated_error / 5);
        EXPECT_NEAR(s.energy, whole.energy, 1e-5 * whole.reference_energy);
        EXPECT_EQ(watch.frames.size(), undisturbed.frames.size());
    }
}

TEST(CurveResume, aRunThatIsInterruptedLeavesACheckpointAndNoFrameThatNobodyAskedFor) {
    const Case c = sharp("gradient-flow");
    Watch whole;
    run_profile(c, whole);
    ASSERT_EQ(whole.frames.size(), 3u);  // the start, one output, the end
    struct InReportedRun : Watch {
        bool interrupted() override { return rows.size() > 20; }
    } late;
    const RunSummary s = run_profile(c, late);
    ASSERT_EQ(s.stop.reason, Stop::interrupted);
    ASSERT_EQ(late.checkpoints.size(), 1u);
    EXPECT_EQ(late.checkpoints[0].time, s.stop.time);
    EXPECT_EQ(late.frames.size(), 1u + (s.stop.time >= 0.02));
}

TEST(CurveResume, theCoarserRunResumesToo) {
    Case c = sharp("stokes");
    Watch watch;
    watch.most_looks = 60;
    ASSERT_EQ(run_profile(c, watch).stop.reason, Stop::interrupted);
    const Restart restart = watch.rewound().value();
    const Record coarser = nested(restart.record, "restart_coarser_", RecordKind::curve);
    EXPECT_GE(coarser.time, restart.record.time);
    Watch next;
    next.most_looks = 60;
    run_profile(c, next, &restart);
    ASSERT_EQ(next.checkpoints.size(), 1u);
    EXPECT_GT(nested(next.checkpoints[0], "restart_coarser_", RecordKind::curve).time, coarser.time);
}

// A coarser run that had come to its end continues where the case ends later now: else the error would be unknown.
TEST(CurveResume, aLaterEndHasAKnownError) {
    Case c = sharp("gradient-flow");
    c.time.output.clear();
    for (const bool later_pair : {false, true}) {
        c.accuracy.energy = later_pair ? 1e-4 : 0.05;
        c.time.end = 0.02;
        Watch first;
        EXPECT_EQ(run_profile(c, first).attempts > 1, later_pair);
        c.time.end = 0.03;
        Watch rest, whole;
        const Restart restart{first.frames.back()};
        const RunSummary extended = run_profile(c, rest, &restart), at_once = run_profile(c, whole);
        EXPECT_EQ(extended.stop.reason, Stop::finished) << extended.stop.message;
        EXPECT_LT(extended.estimated_error, c.accuracy.energy);
        EXPECT_TRUE(extended.warnings.empty());
        EXPECT_NEAR(extended.energy, at_once.energy, c.accuracy.energy * at_once.reference_energy);
    }
}

}  // namespace tubule::axisym::curve_resume_test
