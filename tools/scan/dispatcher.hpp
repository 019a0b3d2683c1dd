// Hands out the points of a scan and takes in their results, from any thread: the work queue.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <exception>
#include <mutex>
#include <optional>
#include <utility>

#include "common/solve/progress.hpp"
#include "tools/scan/ranks.hpp"
#include "tools/scan/scan_file.hpp"
#include "tools/scan/scan_plan.hpp"

namespace tubule {

// How much work a scan was, of the points run by this process and those it handed them to.
struct ScanEffort {
    std::size_t points = 0;
    double cpu_seconds = 0;
};

// Shows how far a scan has come: a bar on a terminal, a line every ten seconds elsewhere.
class ScanProgress {
public:
    explicit ScanProgress(ProgressStyle style = {}) : style_(std::move(style)) {}
    ScanProgress(const ScanProgress&) = delete;
    ~ScanProgress();

    void begin(std::size_t known);  // points that are done before anything is run
    // Points done and wanted; `follows`: more may be added, so that no remaining time is shown.
    void operator()(std::size_t known, std::size_t wanted, bool follows);

private:
    ProgressStyle style_;
    std::size_t begun_with_ = 0;
    double begun_at_ = 0, next_ = 0;
    bool drawn_ = false;
};

class Dispatcher : public Tasks {
public:
    // Points that `writer` has already are not run again.
    Dispatcher(ScanWriter& writer, bool quiet);

    // `over` also where an interrupt came, or something failed.
    NextTask take(Packet& task, bool may_wait) override;
    void give(const Packet& result) override;  // saves it; a failure to do so ends the scan
    void fail(std::exception_ptr error) override;

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

// For rank 0: runs the scan on all ranks; returns their number. serve_scan() is for the others.
int run_scan(Ranks& ranks, Dispatcher& dispatcher, const Scan& scan);
void serve_scan(Ranks& ranks);
// The scan as it is sent to them.
Packet to_packet(const Scan& scan);
Scan scan_from(const Packet& packet);

// One point, from its keys to its result, or one crossing.
PointResult run_one(const Scan& scan, const Work& work);

}  // namespace tubule
