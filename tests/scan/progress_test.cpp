// How far a scan has come, in words.
#include <gtest/gtest.h>

#include "tests/support/screen.hpp"
#include "tools/scan/dispatcher.hpp"

namespace tubule::progress_test {

using test::Screen;

// 20 points were known before; 30 more take 10 s, so that the other 50 take 16.7 s.
TEST(ScanProgress, LinesOffATerminal) {
    Screen screen;
    ScanProgress progress(screen.style(false));
    progress.begin(20);
    screen.now += 9.9;
    progress(49, 100, false);
    screen.now += 0.1;
    progress(50, 100, false);
    EXPECT_EQ(screen.text(), "50 of 100 points, left 17 s\n");
}

// A line may ask for more points as it goes.
TEST(ScanProgress, ALineDoesNotKnowItsEnd) {
    Screen screen;
    ScanProgress progress(screen.style(false));
    progress.begin(0);
    screen.now += 10;
    progress(50, 100, true);
    EXPECT_EQ(screen.text(), "50 of 100 points so far, left at least 10 s\n");
}

TEST(ScanProgress, BarOnATerminal) {
    Screen screen;
    {
        ScanProgress progress(screen.style(true));
        progress.begin(0);
        screen.now += 1;
        progress(25, 100, false);
    }
    EXPECT_EQ(screen.text(), "\r[######..................] 25 of 100 points, left 3 s\x1b[K\r\x1b[K");
}

}  // namespace tubule::progress_test
