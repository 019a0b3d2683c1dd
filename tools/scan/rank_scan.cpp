#include "tools/scan/rank_scan.hpp"

#include <algorithm>
#include <cstring>
#include <memory>
#include <span>
#include <string>
#include <type_traits>
#include <utility>

#include "common/result/record_bytes.hpp"

namespace tubule {
namespace {

// What points are computed from, one text after another.
class Writer {
public:
    void text(const std::string& text) {
        number(text.size());
        bytes.insert(bytes.end(), text.begin(), text.end());
    }
    void number(std::size_t n) {
        const auto* begin = reinterpret_cast<const char*>(&n);
        bytes.insert(bytes.end(), begin, begin + sizeof n);
    }
    void texts(const std::vector<std::string>& all) {
        number(all.size());
        for (const std::string& one : all) text(one);
    }

    Packet bytes;
};

class Reader {
public:
    explicit Reader(const Packet& bytes) : rest_(bytes) {}
    std::size_t number() {
        std::size_t n = 0;
        std::memcpy(&n, rest_.data(), sizeof n);
        rest_ = rest_.subspan(sizeof n);
        return n;
    }
    std::string text() {
        const std::size_t size = number();
        std::string out(rest_.data(), size);
        rest_ = rest_.subspan(size);
        return out;
    }
    std::vector<std::string> texts() {
        std::vector<std::string> all(number());
        for (std::string& one : all) one = text();
        return all;
    }

private:
    std::span<const char> rest_;
};

// A result but for its message, which follows it.
struct Fixed {
    std::size_t point;
    Outcome outcome;
    int stop;
    double value;
    decltype(PointResult::measures) measures;
};

Packet to_packet(const PointResult& p) {
    const Fixed fixed{p.point, p.outcome, p.stop, p.value, p.measures};
    Packet out(sizeof(fixed) + p.message.size());
    std::memcpy(out.data(), &fixed, sizeof(fixed));
    std::copy(p.message.begin(), p.message.end(), out.begin() + sizeof(fixed));
    return out;
}

PointResult point_from(const Packet& in) {
    Fixed fixed;
    std::memcpy(&fixed, in.data(), sizeof(fixed));
    PointResult p;
    p.point = fixed.point, p.outcome = fixed.outcome, p.stop = fixed.stop, p.value = fixed.value;
    p.measures = fixed.measures;
    p.message.assign(in.begin() + sizeof(fixed), in.end());
    return p;
}

Compute compute_of(std::shared_ptr<const Scan> scan) {
    return [scan](const Packet& task) {
        static_assert(std::is_trivially_copyable_v<Work>);
        Work work;
        std::memcpy(&work, task.data(), sizeof work);
        return to_packet(run_one(*scan, work));
    };
}

class ScanTasks : public RankTasks {
public:
    explicit ScanTasks(Dispatcher& dispatcher) : dispatcher_(dispatcher) {}
    Answer take(Packet& task, bool may_wait) override {
        Work work;
        const auto answer = dispatcher_.take(work, may_wait);
        if (answer == Dispatcher::Answer::wait) return Answer::wait;
        if (answer == Dispatcher::Answer::over) return Answer::over;
        task.resize(sizeof work);
        std::memcpy(task.data(), &work, sizeof work);
        return Answer::task;
    }
    void give(const Packet& result) override { dispatcher_.give(point_from(result)); }
    void fail(std::exception_ptr error) override { dispatcher_.fail(std::move(error)); }

private:
    Dispatcher& dispatcher_;
};

}  // namespace

Packet to_packet(const Scan& scan) {
    Writer out;
    for (const std::string& text : {scan.path, scan.case_path, scan.case_text}) out.text(text);
    Bytes inputs;
    put(inputs, scan.inputs);
    out.text({reinterpret_cast<const char*>(inputs.data()), inputs.size()});
    out.number(scan.to_the_end);
    out.texts(scan.sets);
    out.number(scan.axes.size());
    for (const Axis& axis : scan.axes) {
        out.texts(axis.keys);
        out.number(axis.logarithmic);
        out.number(axis.size());
        for (const auto& setting : axis.values) out.texts(setting);
    }
    const BoundaryChoice none{.around = {}, .seeds = 0, .refine = -1},
        &boundary = scan.boundary ? *scan.boundary : none;
    out.number(static_cast<std::size_t>(boundary.refine + 1));
    return out.bytes;
}

Scan scan_from(const Packet& packet) {
    Reader in(packet);
    Scan scan;
    for (std::string* text : {&scan.path, &scan.case_path, &scan.case_text}) *text = in.text();
    const std::string inputs = in.text();
    Payload bytes(std::as_bytes(std::span(inputs)));
    scan.inputs = get_inputs(bytes);
    scan.to_the_end = in.number() != 0;
    scan.sets = in.texts();
    scan.axes.resize(in.number());
    for (Axis& axis : scan.axes) {
        axis.keys = in.texts();
        axis.logarithmic = in.number() != 0;
        axis.values.resize(in.number());
        for (auto& setting : axis.values) setting = in.texts();
    }
    if (const std::size_t refine = in.number(); refine > 0)
        scan.boundary = BoundaryChoice{.around = {}, .refine = static_cast<int>(refine) - 1};
    return scan;
}

int run_scan(Ranks& ranks, Dispatcher& dispatcher, const Scan& scan) {
    ScanTasks tasks(dispatcher);
    return ranks.run(tasks, to_packet(scan), compute_of(std::make_shared<Scan>(scan)));
}

void serve_scan(Ranks& ranks) {
    ranks.serve([](const Packet& header) { return compute_of(std::make_shared<Scan>(scan_from(header))); });
}

}  // namespace tubule
