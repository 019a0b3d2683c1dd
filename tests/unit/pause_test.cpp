// Work that is told to pause, and what does not fit into memory.
#include "common/solve/pause.hpp"

#include <gtest/gtest.h>

#include "common/solve/memory.hpp"
#include "tests/support/message_of.hpp"

namespace tubule::pause_test {

bool never() {
    return false;
}
constexpr double passed = -1;  // a limit that no clock is within

TEST(Pause, nothingEndsWorkThatNobodyWatches) {
    EXPECT_NO_THROW(check_pause());
    EXPECT_NO_THROW(check_pause(1e9));
    EXPECT_FALSE(SharedPause().look());
}

TEST(Pause, aLimitIsToldOnceSoThatTheStateCanBeSaved) {
    const PauseWatch watch(passed, never);
    SharedPause loop;
    EXPECT_TRUE(loop.look());
    try {
        loop.check();
        FAIL() << "not told";
    } catch (const Paused& pause) {
        EXPECT_EQ(pause.reason, Stop::time_limit);
        EXPECT_EQ(pause.limit, passed);
    }
    EXPECT_NO_THROW(check_pause());
    EXPECT_FALSE(SharedPause().look());
    EXPECT_TRUE(watch.due());  // between steps it still is
}

TEST(Pause, trialRunsAreEndedByTheWatchesAroundThem) {
    EXPECT_NO_THROW(pause_if_due());
    const PauseWatch outer(passed, never);
    {
        const PauseWatch trial(std::nullopt, never);
        EXPECT_EQ(trial.due().value().limit, passed);
        EXPECT_THROW(check_pause(), Paused);
        EXPECT_NO_THROW(check_pause());  // the trial has been told
    }
    EXPECT_TRUE(pause_is_due());
    EXPECT_THROW(pause_if_due(), Paused);
    EXPECT_THROW(check_pause(), Paused);  // not told yet
}

TEST(Pause, aLimitCountsFromItsOwnBeginningSecondsFromTheOutermost) {
    PauseWatch outer(1000, never);
    outer.discount(-100);
    EXPECT_FALSE(outer.due());
    const PauseWatch inner(50, never);
    EXPECT_FALSE(inner.due());
    EXPECT_NEAR(inner.seconds(), 100, 5);
    outer.discount(-1000);
    EXPECT_TRUE(inner.due());
}

TEST(Pause, anInterruptLeavesAStepTheTimeToEnd) {
    bool raised = false;
    const PauseWatch watch(std::nullopt, [&] { return raised; });
    EXPECT_FALSE(watch.due());
    raised = true;
    EXPECT_EQ(watch.due().value().reason, Stop::interrupted);
    EXPECT_NO_THROW(check_pause());         // a quarter of a second
    EXPECT_THROW(check_pause(10), Paused);  // which is too short for this
}

TEST(Pause, workThatNothingCanEndIsNotBegunWhenItWouldGoFarBeyondTheLimit) {
    const PauseWatch watch(100, never);
    EXPECT_NO_THROW(check_pause(99));
    EXPECT_NO_THROW(check_pause(104));  // 5 percent
    EXPECT_THROW(check_pause(110), Paused);
}

TEST(Memory, whatCannotBeHadIsFoundBefore) {
    EXPECT_TRUE(can_allocate(1 << 20));
    EXPECT_FALSE(can_allocate(std::size_t{1} << 60));
}

TEST(Memory, saysWhatIsTooLargeAndWhatToTry) {
    EXPECT_GT(free_memory(), 0);
    EXPECT_NO_THROW(require_memory(1e6, "a vector"));
    const std::string message = test::message_of<TooLarge>([] { require_memory(1e20, "a matrix"); });
    EXPECT_TRUE(message.starts_with("a matrix would take about 1e+11 GB of memory, but only ")) << message;
    EXPECT_TRUE(message.ends_with(" GB are free: use fewer elements (discretisation.elements)")) << message;
}

}  // namespace tubule::pause_test
