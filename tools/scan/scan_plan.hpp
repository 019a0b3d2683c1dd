// What a scan computes, and in what order.
#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <set>
#include <vector>

#include "tools/scan/starts.hpp"

namespace tubule {

// A point of the grid or between two of them; or where two kinds of shapes have the same energy.
struct Work {
    std::size_t number = 0;
    std::optional<EnergyCrossing> crossing;
};

// The plan of a scan: Plan, on the nodes of the grid. With several starts a node is all its points, and its outcome
// that of the least energy; where energies of two kinds cross between two nodes, the place of the crossing is asked
// for, too. The result does not depend on the order in which work is finished.
class ScanPlan {
public:
    explicit ScanPlan(const Scan& scan);  // which must stay

    std::optional<Work> next();  // something to compute, if there is anything by now
    void done(const PointResult& result);

    std::size_t known() const { return known_; }
    std::size_t wanted() const;
    bool follows() const { return plan_.follows(); }
    const Plan& nodes() const { return plan_; }

private:
    void node_done(std::size_t node);

    const Scan& scan_;
    Nodes nodes_;
    Plan plan_;
    std::size_t known_ = 0;
    // With several starts:
    std::vector<PointResult> points_;
    std::deque<std::size_t> pending_;
    std::deque<EnergyCrossing> crossings_;
    std::set<std::size_t> asked_crossings_, known_crossings_;
};

}  // namespace tubule
