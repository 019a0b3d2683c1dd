#include "tools/scan/dispatcher.hpp"

#include <fmt/format.h>
#include <omp.h>

#include <algorithm>
#include <chrono>
#include <system_error>
#include <thread>
#include <vector>

#include "common/case/read.hpp"
#include "common/solve/interrupt.hpp"
#include "common/solve/pause.hpp"

namespace tubule {
namespace {

constexpr std::size_t most_threads = 256;

}  // namespace

Dispatcher::Dispatcher(ScanWriter& writer, bool quiet)
    : writer_(writer), plan_(plan_of(writer.result())), progress_({.quiet = quiet}) {
    progress_.begin(plan_.known());
}

NextTask Dispatcher::take(Work& work, bool may_wait) {
    std::unique_lock lock(mutex_);
    while (true) {
        if (error_ || interrupted() || pause_is_due()) return NextTask::over;
        if (const auto next = plan_.next()) {
            work = *next;
            ++running_;
            return NextTask::ready;
        }
        if (running_ == 0) return NextTask::over;
        if (!may_wait) return NextTask::wait;
        changed_.wait_for(lock, std::chrono::milliseconds(100));  // a signal wakes nobody
    }
}

void Dispatcher::give(const PointResult& result) {
    const std::lock_guard lock(mutex_);
    --running_;
    changed_.notify_all();
    if (result.stop == stop_word(Stop::interrupted)) return;  // not finished: to be run again
    try {
        writer_.point(result);
    } catch (...) {
        error_ = std::current_exception();
        return;
    }
    plan_.done(result);
    ++effort_.points;
    if (result[Measure::cpu_seconds] > 0) effort_.cpu_seconds += result[Measure::cpu_seconds];
    progress_(plan_.known(), plan_.wanted(), plan_.follows());
}

void Dispatcher::fail(std::exception_ptr error) {
    const std::lock_guard lock(mutex_);
    if (!error_) error_ = std::move(error);
    changed_.notify_all();
}

bool Dispatcher::was_interrupted() const {
    if (error_) std::rethrow_exception(error_);
    return interrupted();
}

PointResult run_one(const Scan& scan, const Work& work) {
    const auto stopped = [] { return interrupted(); };
    PointResult result;
    try {
        result = work.crossing ? find_crossing(scan, *work.crossing, stopped)
                               : run_point(scan.case_of(work.number), scan.to_the_end, stopped);
    } catch (const CaseError& error) {
        result = refused_point(error.what());
    }
    result.point = work.number;
    return result;
}

int scan_threads(std::optional<int> asked) {
    const int processors = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
    if (asked.value_or(1) < 1) throw CaseError(fmt::format("--jobs must be 1 or more, not {}", *asked));
    return std::min(asked.value_or(processors), static_cast<int>(most_threads));
}

int run_scan(Dispatcher& dispatcher, const Scan& scan, int jobs) {
    jobs = static_cast<int>(std::min<std::size_t>({static_cast<std::size_t>(jobs), scan.size(), most_threads}));
    const int processors = omp_get_max_threads();
    const auto work = [&] {
        omp_set_num_threads(std::max(1, processors / jobs));  // of this thread: points share the processors
        try {
            for (Work work; dispatcher.take(work, true) == NextTask::ready;) dispatcher.give(run_one(scan, work));
        } catch (...) {
            dispatcher.fail(std::current_exception());
        }
    };
    std::vector<std::thread> crew;
    crew.reserve(static_cast<std::size_t>(jobs));
    try {
        for (int i = 1; i < jobs; ++i) crew.emplace_back(work);
    } catch (const std::system_error&) {  // no more threads are to be had: those that are do the work
    }
    work();
    for (std::thread& thread : crew) thread.join();
    return static_cast<int>(crew.size()) + 1;
}

}  // namespace tubule
