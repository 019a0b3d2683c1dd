#include "tools/scan/rank_scan.hpp"

#include <memory>
#include <span>
#include <string>
#include <utility>

#include "common/result/record_bytes.hpp"
#include "tools/scan/packet.hpp"

namespace tubule {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Axis, keys, values, logarithmic)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(EnergyCrossing, node, axis, kinds, starts, differences)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(PointResult, point, outcome, stop, value, measures, message)

namespace {

// From a task, {number} or {number, crossing}, to its result.
Compute compute_of(Scan scan) {
    return [scan = std::make_shared<const Scan>(std::move(scan))](const Packet& packet) {
        const nlohmann::json task = unpacked(packet);
        Work work{task[0], {}};
        if (task.size() > 1) work.crossing = task[1].get<EnergyCrossing>();
        return packed(run_one(*scan, work));
    };
}

class ScanTasks : public RankTasks {
public:
    explicit ScanTasks(Dispatcher& dispatcher) : dispatcher_(dispatcher) {}
    NextTask take(Packet& task, bool may_wait) override {
        Work work;
        const NextTask next = dispatcher_.take(work, may_wait);
        if (next != NextTask::ready) return next;
        nlohmann::json words{work.number};
        if (work.crossing) words.push_back(*work.crossing);
        task = packed(words);
        return next;
    }
    void give(const Packet& result) override { dispatcher_.give(unpacked(result).get<PointResult>()); }
    void fail(std::exception_ptr error) override { dispatcher_.fail(std::move(error)); }

private:
    Dispatcher& dispatcher_;
};

}  // namespace

Packet to_packet(const Scan& scan) {
    Bytes inputs;
    put(inputs, scan.inputs);
    return packed({{"path", scan.path},
                   {"case_path", scan.case_path},
                   {"case_text", scan.case_text},
                   {"inputs", std::string(reinterpret_cast<const char*>(inputs.data()), inputs.size())},
                   {"to_the_end", scan.to_the_end},
                   {"sets", scan.sets},
                   {"axes", scan.axes},
                   {"halvings", scan.between().halvings}});
}

Scan scan_from(const Packet& packet) {
    const nlohmann::json in = unpacked(packet);
    Scan scan;
    scan.path = in["path"], scan.case_path = in["case_path"], scan.case_text = in["case_text"];
    const std::string inputs = in["inputs"];
    Payload bytes(std::as_bytes(std::span(inputs)));
    scan.inputs = get_inputs(bytes);
    scan.to_the_end = in["to_the_end"];
    in["sets"].get_to(scan.sets), in["axes"].get_to(scan.axes);
    scan.boundary = BoundaryChoice{.around = {}, .refine = in["halvings"]};  // by which points between are numbered
    return scan;
}

int run_scan(Ranks& ranks, Dispatcher& dispatcher, const Scan& scan) {
    ScanTasks tasks(dispatcher);
    return ranks.run(tasks, to_packet(scan), compute_of(scan));
}

void serve_scan(Ranks& ranks) {
    ranks.serve([](const Packet& header) { return compute_of(scan_from(header)); });
}

}  // namespace tubule
