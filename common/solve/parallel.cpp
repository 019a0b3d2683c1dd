#include "common/solve/parallel.hpp"

#include <omp.h>

#include <Eigen/Core>
#include <chrono>
#include <cstdint>
#include <memory>
#include <system_error>
#include <thread>
#include <vector>

namespace tubule {
namespace parallel {
namespace {

// How long a thread looks for work, or for the end of others' work, before it sleeps: about what waking it takes.
constexpr std::chrono::microseconds patience{30};

template <class Condition>
bool soon(const Condition& condition) {
    const auto until = std::chrono::steady_clock::now() + patience;
    while (!condition())
        if (std::chrono::steady_clock::now() > until) return false;
    return true;
}

thread_local bool busy = false;  // in a loop

// Threads that help one other thread with its loops, one loop at a time.
class Crew {
public:
    explicit Crew(int threads) : threads_(threads) {
        try {
            for (int i = 1; i < threads; ++i) helpers_.emplace_back([this, i] { help(i); });
        } catch (const std::system_error&) {  // no more threads are to be had: those that are do the work
        }
    }
    ~Crew() {
        ended_ = true;
        call();
        for (std::thread& helper : helpers_) helper.join();
    }
    Crew(const Crew&) = delete;
    Crew& operator=(const Crew&) = delete;

    int threads() const { return threads_; }

    void run(Loop& loop) {
        loop_ = &loop;
        gate_.store(open, std::memory_order_release);
        call();
        busy = true;
        loop.work(0);
        busy = false;
        gate_.fetch_sub(open);  // who is not inside by now finds nothing to do
        const auto empty = [this] { return gate_.load() == 0; };
        while (!soon(empty)) {
            const std::uint32_t now = gate_.load();
            if (now != 0) gate_.wait(now);
        }
    }

private:
    static constexpr std::uint32_t open = 1, one_helper = 2;

    void call() {
        ++calls_;
        calls_.notify_all();
    }

    bool enter() {
        std::uint32_t now = gate_.load();
        while (now & open)
            if (gate_.compare_exchange_weak(now, now + one_helper)) return true;
        return false;
    }

    void help(int number) {
        busy = true;
        for (std::uint32_t seen = 0;;) {
            if (!soon([&] { return calls_.load() != seen; })) calls_.wait(seen);
            seen = calls_.load();
            if (ended_) return;
            if (!enter()) continue;
            loop_->work(number);
            if (gate_.fetch_sub(one_helper) == one_helper) gate_.notify_one();
        }
    }

    const int threads_;
    Loop* loop_ = nullptr;
    std::atomic<std::uint32_t> calls_ = 0;  // number of loops begun
    std::atomic<std::uint32_t> gate_ = 0;   // whether the loop takes helpers, and how many are inside
    std::atomic<bool> ended_ = false;
    std::vector<std::thread> helpers_;
};

}  // namespace

bool within_loop() {
    return busy;
}

void run(Loop& loop, int threads) {
    static thread_local std::unique_ptr<Crew> crew;
    if (!crew || crew->threads() != threads) {
        crew.reset();
        crew = std::make_unique<Crew>(threads);
    }
    crew->run(loop);
}

}  // namespace parallel

int loop_threads() {
    return omp_get_max_threads();
}

// Not inline: Eigen's setting is a variable of each library that includes it.
void multiply_on_one_thread() {
    Eigen::setNbThreads(1);
}

}  // namespace tubule
