#include "tools/scan/dispatcher.hpp"

#include <fmt/format.h>
#include <omp.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>
#include <system_error>
#include <thread>
#include <vector>

#include "common/case/read.hpp"
#include "common/solve/interrupt.hpp"
#include "common/solve/pause.hpp"

namespace tubule {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Axis, keys, values, logarithmic)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(CaseInput, name, size, crc, bytes)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(EnergyCrossing, node, axis, kinds, starts, differences)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(PointResult, point, outcome, stop, value, measures, message)

namespace {

constexpr std::size_t most_threads = 256;

// From a task, {number} or {number, crossing}, to its result.
Compute compute_of(const Scan& scan) {
    return [scan = std::make_shared<const Scan>(scan)](const Packet& task) -> Packet {
        Work work{task[0], {}};
        if (task.size() > 1) work.crossing = task[1].get<EnergyCrossing>();
        return run_one(*scan, work);
    };
}

}  // namespace

Dispatcher::Dispatcher(ScanWriter& writer, bool quiet)
    : writer_(writer), plan_(plan_of(writer.result())), progress_({.quiet = quiet}) {
    progress_.begin(plan_.known());
}

NextTask Dispatcher::take(Packet& task, bool may_wait) {
    std::unique_lock lock(mutex_);
    while (true) {
        if (error_ || interrupted() || pause_is_due()) return NextTask::over;
        if (const auto next = plan_.next()) {
            task = Packet::array({next->number});
            if (next->crossing) task.push_back(*next->crossing);
            ++running_;
            return NextTask::ready;
        }
        if (running_ == 0) return NextTask::over;
        if (!may_wait) return NextTask::wait;
        changed_.wait_for(lock, std::chrono::milliseconds(100));  // a signal wakes nobody
    }
}

void Dispatcher::give(const Packet& packet) {
    const auto result = packet.get<PointResult>();
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
    PointResult result;
    try {
        result =
            work.crossing ? find_crossing(scan, *work.crossing) : run_point(scan.case_of(work.number), scan.to_the_end);
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
    const Compute compute = compute_of(scan);
    const auto work = [&] {
        omp_set_num_threads(std::max(1, processors / jobs));  // of this thread: points share the processors
        work_off(dispatcher, compute);
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

Packet to_packet(const Scan& scan) {
    Packet inputs = Packet::array();
    for (const auto& input : scan.inputs) inputs.push_back(*input);
    return {{"path", scan.path}, {"case_path", scan.case_path},        {"case_text", scan.case_text},
            {"inputs", inputs},  {"to_the_end", scan.to_the_end},      {"sets", scan.sets},
            {"axes", scan.axes}, {"halvings", scan.between().halvings}};
}

Scan scan_from(const Packet& in) {
    Scan scan;
    scan.path = in["path"], scan.case_path = in["case_path"], scan.case_text = in["case_text"];
    for (const Packet& input : in["inputs"])
        scan.inputs.push_back(std::make_shared<const CaseInput>(input.get<CaseInput>()));
    scan.to_the_end = in["to_the_end"];
    in["sets"].get_to(scan.sets), in["axes"].get_to(scan.axes);
    scan.boundary = BoundaryChoice{.around = {}, .refine = in["halvings"]};  // by which points between are numbered
    return scan;
}

int run_scan(Ranks& ranks, Dispatcher& dispatcher, const Scan& scan) {
    return ranks.run(dispatcher, to_packet(scan), compute_of(scan));
}

void serve_scan(Ranks& ranks) {
    ranks.serve([](const Packet& header) { return compute_of(scan_from(header)); });
}

ScanProgress::~ScanProgress() {
    if (drawn_) style_.wipe();
}

void ScanProgress::begin(std::size_t known) {
    begun_with_ = known;
    begun_at_ = style_.clock();
    next_ = begun_at_ + style_.interval();
}

void ScanProgress::operator()(std::size_t known, std::size_t wanted, bool follows) {
    if (style_.quiet) return;
    const double now = style_.clock();
    if (now < next_) return;
    next_ = now + style_.interval();
    wanted = std::max(wanted, known);
    const double left =
        (now - begun_at_) / static_cast<double>(known - begun_with_) * static_cast<double>(wanted - known);
    const auto words = fmt::format("{} of {} points{}, left {}", known, wanted, follows ? " so far" : "",
                                   (follows ? "at least " : "") + duration(left));
    style_.show(ProgressStyle::bar_width * known / std::max<std::size_t>(wanted, 1), words);
    drawn_ = true;
}

}  // namespace tubule
