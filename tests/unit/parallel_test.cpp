// Loops on several threads: each number once, on threads that exist, and nobody spins who has nothing to do.
#include "common/solve/parallel.hpp"

#include <gtest/gtest.h>
#include <omp.h>

#include <atomic>
#include <chrono>
#include <ctime>
#include <thread>
#include <vector>

namespace tubule::parallel_test {

class Parallel : public ::testing::Test {
protected:
    ~Parallel() override { omp_set_num_threads(before_); }

private:
    int before_ = omp_get_max_threads();
};

TEST_F(Parallel, EveryNumberOnceOnThreadsThatExist) {
    for (const int threads : {1, 2, 5, 3}) {
        omp_set_num_threads(threads);
        ASSERT_EQ(loop_threads(), threads);
        for (const std::size_t count : {0, 1, 2, 7, 64, 1000, 100003}) {
            std::vector<int> seen(count);
            std::atomic<int> wrong = 0;
            parallel_for(count, [&](std::size_t i, int thread) {
                ++seen[i];
                if (thread < 0 || thread >= threads) ++wrong;
            });
            EXPECT_EQ(seen, std::vector<int>(count, 1)) << threads << " threads";
            EXPECT_EQ(wrong, 0);
        }
    }
}

TEST_F(Parallel, ManyShortLoopsDoNotMixTheirNumbers) {
    omp_set_num_threads(4);
    for (int round = 0; round < 20000; ++round) {
        std::vector<int> seen(3 + round % 5);
        parallel_for(seen.size(), [&](std::size_t i) { seen[i] += round; });
        ASSERT_EQ(seen, std::vector<int>(seen.size(), round));
    }
}

// Two things at once can only be seen by each other on two threads.
TEST_F(Parallel, TwoThreadsWorkAtTheSameTime) {
    omp_set_num_threads(2);
    std::atomic<int> here = 0;
    std::atomic<bool> met = false;
    parallel_for(2, [&](std::size_t) {
        ++here;
        const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(20);
        while (!met && std::chrono::steady_clock::now() < until)
            if (here == 2) met = true;
    });
    EXPECT_TRUE(met);
}

TEST_F(Parallel, LoopsWithinLoopsAndOnRequestStayOnTheirThread) {
    omp_set_num_threads(3);
    std::atomic<int> sum = 0, strays = 0;
    parallel_for(10, [&](std::size_t) {
        const auto own = std::this_thread::get_id();
        parallel_for(10, [&](std::size_t i, int thread) {
            sum += static_cast<int>(i);
            if (thread != 0 || std::this_thread::get_id() != own) ++strays;
        });
    });
    EXPECT_EQ(sum, 450);
    EXPECT_EQ(strays, 0);
    std::vector<std::size_t> order;
    parallel_for(
        100, [&](std::size_t i) { order.push_back(i); }, false);
    for (std::size_t i = 0; i < 100; ++i) EXPECT_EQ(order.at(i), i);
}

TEST_F(Parallel, ThreadsOfTheirOwnHaveLoopsOfTheirOwn) {
    std::vector<std::thread> callers;
    std::atomic<long> sum = 0;
    for (int caller = 0; caller < 3; ++caller)
        callers.emplace_back([&] {
            omp_set_num_threads(2);
            for (int round = 0; round < 500; ++round)
                parallel_for(20, [&](std::size_t i) { sum += static_cast<long>(i); });
        });
    for (std::thread& caller : callers) caller.join();
    EXPECT_EQ(sum, 3 * 500 * 190);
}

// Threads of OpenMP would use a processor each for a while. CPU time does not depend on what else the machine does.
TEST_F(Parallel, IdleThreadsSleep) {
    omp_set_num_threads(4);
    const auto cpu = [] { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; };
    double used = 0;
    for (int round = 0; round < 20; ++round) {
        parallel_for(100, [](std::size_t) {});
        const double before = cpu();
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
        used += cpu() - before;
    }
    EXPECT_LT(used, 0.03);  // of 0.1 s times three helpers
}

}  // namespace tubule::parallel_test
