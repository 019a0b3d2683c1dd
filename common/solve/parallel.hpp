// Loops on several threads, for machines that others use as well: nobody waits by spinning for longer than it takes to
// wake up, and no loop waits for a thread that has not begun. (OpenMP's loops wait for all threads, and spin.)
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <type_traits>

namespace tubule {

// Threads that loops of this thread may use, itself included: what OpenMP would take, that is OMP_NUM_THREADS, the
// number of processors without it, or what omp_set_num_threads() has set for this thread.
int loop_threads();

// Products of dense matrices stay on their thread from now on: they are small here, and others would only wait.
void multiply_on_one_thread();

namespace parallel {

// A loop under way: each thread takes the next few numbers until none is left.
class Loop {
public:
    Loop(std::size_t count, int threads)
        : count_(count), grain_(std::max<std::size_t>(1, count / (64 * static_cast<std::size_t>(threads)))) {}
    virtual ~Loop() = default;
    void work(int thread) noexcept {
        for (std::size_t begin; (begin = next_.fetch_add(grain_, std::memory_order_relaxed)) < count_;)
            some(begin, std::min(begin + grain_, count_), thread);
    }

private:
    virtual void some(std::size_t begin, std::size_t end, int thread) = 0;

    std::size_t count_, grain_;
    std::atomic<std::size_t> next_ = 0;
};

// Within a loop there is no other one: it runs on the thread that comes to it.
bool within_loop();
void run(Loop& loop, int threads);

}  // namespace parallel

// Calls work(i), or work(i, thread) with 0 <= thread < loop_threads(), for i = 0 to count - 1, in any order and on all
// threads. `work` must not throw. On this thread alone, in order and as thread 0, unless `parallel`.
template <class Work>
void parallel_for(std::size_t count, Work&& work, bool parallel = true) {
    const auto one = [&](std::size_t i, int thread) {
        if constexpr (std::is_invocable_v<Work&, std::size_t, int>)
            work(i, thread);
        else
            work(i);
    };
    const int threads = parallel && count > 1 && !parallel::within_loop() ? loop_threads() : 1;
    if (threads == 1) {
        for (std::size_t i = 0; i < count; ++i) one(i, 0);
        return;
    }
    struct Own : parallel::Loop {
        Own(std::size_t count, int threads, const decltype(one)& work) : Loop(count, threads), work_(work) {}
        void some(std::size_t begin, std::size_t end, int thread) override {
            for (std::size_t i = begin; i < end; ++i) work_(i, thread);
        }
        const decltype(one)& work_;
    } loop(count, threads, one);
    parallel::run(loop, threads);
}

}  // namespace tubule
