#include "tools/scan/scan_plan.hpp"

namespace tubule {
namespace {

Plan plan_on(const GridShape& shape, const std::optional<BoundaryChoice>& boundary) {
    return boundary ? Plan(shape, boundary->seeds, boundary->around, boundary->refine) : Plan(shape);
}

}  // namespace

ScanPlan::ScanPlan(const Scan& scan) : scan_(scan), nodes_(scan), plan_(plan_on(nodes_.shape(), scan.boundary)) {
    if (!nodes_.has_starts()) return;
    points_ = unknown_points(scan.size());
}

std::size_t ScanPlan::wanted() const {
    return plan_.wanted() * nodes_.starts() + asked_crossings_.size();
}

std::optional<Work> ScanPlan::next() {
    while (true) {
        while (!pending_.empty()) {
            const std::size_t point = pending_.front();
            pending_.pop_front();
            if (points_[point].outcome == Outcome::not_run) return Work{point, {}};
        }
        const auto node = plan_.next();
        if (!node) break;
        if (!nodes_.has_starts()) return Work{*node, {}};
        for (std::size_t s = 0; s < nodes_.starts(); ++s) pending_.push_back(nodes_.point_of(*node, s));
    }
    while (!crossings_.empty()) {
        const EnergyCrossing crossing = crossings_.front();
        crossings_.pop_front();
        const std::size_t number = number_of(scan_, crossing);
        if (!known_crossings_.contains(number)) return Work{number, crossing};
    }
    return std::nullopt;
}

void ScanPlan::done(const PointResult& result) {
    ++known_;
    if (!nodes_.has_starts()) return plan_.done(result.point, result.outcome);
    if (result.point >= points_.size()) {
        known_crossings_.insert(result.point);
        return;
    }
    points_[result.point] = result;
    node_done(nodes_.node_of(result.point));
}

// If it is, now that one of its points is known.
void ScanPlan::node_done(std::size_t node) {
    for (std::size_t s = 0; s < nodes_.starts(); ++s)
        if (points_[nodes_.point_of(node, s)].outcome == Outcome::not_run) return;
    plan_.done(node, points_[nodes_.point_of(node, best_start(nodes_, node, points_))].outcome);
    for (const EnergyCrossing& crossing : energy_crossings(nodes_, points_, node))
        if (asked_crossings_.insert(number_of(scan_, crossing)).second) crossings_.push_back(crossing);
}

}  // namespace tubule
