// Hands out the points of a scan and takes in their results, from any thread: the work queue.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <exception>
#include <mutex>
#include <optional>

#include "tools/scan/ranks.hpp"
#include "tools/scan/scan_file.hpp"
#include "tools/scan/scan_plan.hpp"
#include "tools/scan/scan_progress.hpp"

namespace tubule {

// How much work a scan was, of the points run by this process and those it handed them to.
struct ScanEffort {
    std::size_t points = 0;
    double cpu_seconds = 0;
};

class Dispatcher {
public:
    // Points that `writer` has already are not run again.
    Dispatcher(ScanWriter& writer, bool quiet);

    // Work to do; `over` also where an interrupt came, or something failed. With `may_wait`, waits instead of saying
    // so.
    NextTask take(Work& work, bool may_wait);
    void give(const PointResult& result);  // saves it; a failure to do so ends the scan
    void fail(std::exception_ptr error);

    // When all is over: whether by an interrupt. Throws what failed.
    bool was_interrupted() const;
    ScanEffort effort() const { return effort_; }

private:
    ScanWriter& writer_;
    std::mutex mutex_;
    std::condition_variable changed_;
    ScanPlan plan_;
    std::size_t running_ = 0;
    ScanEffort effort_;
    std::exception_ptr error_;
    ScanProgress progress_;
};

// As many threads as asked for, by default one a processor. Throws CaseError if that is less than one.
int scan_threads(std::optional<int> asked);

// Runs the scan on `jobs` threads of this process, or fewer: at most one a point, as many as the system allows, and
// 256. How many it had.
int run_scan(Dispatcher& dispatcher, const Scan& scan, int jobs);

// One point, from its keys to its result, or one crossing.
PointResult run_one(const Scan& scan, const Work& work);

}  // namespace tubule
