// A bounding-volume hierarchy, to find the items nearest to a point or those that intersect a box.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <vector>

namespace tubule::surface3d {

// In D dimensions. A surface that is periodic in its last coordinate stands for all its images.
template <int D>
class BoxTree {
public:
    using Point = Eigen::Matrix<double, D, 1>;
    using Box = Eigen::AlignedBox<double, D>;

    BoxTree() = default;
    explicit BoxTree(std::vector<Box> items) : item_(std::move(items)), order_(item_.size()) {
        std::iota(order_.begin(), order_.end(), 0);
        build(0, 0, order_.size());
    }

    const Box& item(std::size_t i) const { return item_[i]; }

    // Calls visit(item) for those whose boxes intersect `box`.
    template <class Visit>
    void meeting(const Box& box, const Visit& visit) const {
        descend(0, 0, order_.size(), box, visit);
    }

    // Calls visit(item, x) for the items whose boxes are nearer than the square root of `best`, which visit may lower;
    // the nearer ones early. With period > 0 also visit(item, x moved by whole periods), which sees the images: the
    // next ones, and more while `best` is finite and farther than they are.
    template <class Visit>
    void nearest(Point x, double period, const double& best, const Visit& visit) const {
        double& z = x[D - 1];
        if (period == 0) return descend(0, 0, order_.size(), x, best, visit);
        const double home = z - period * std::round((z - node_[0].center()[D - 1]) / period);
        for (int step = 0;; ++step) {
            bool within = false;
            for (const int side : {1, -1}) {
                if (step == 0 && side < 0) continue;
                z = home + side * step * period;
                if (node_[0].squaredExteriorDistance(x) >= best) continue;
                within = true;
                descend(0, 0, order_.size(), x, best, visit);
            }
            if (!within || (step > 0 && std::isinf(best))) return;
        }
    }

private:
    static constexpr std::size_t leaf = 2;

    void build(std::size_t node, std::size_t begin, std::size_t end) {
        if (node >= node_.size()) node_.resize(node + 1);
        Box all;
        for (std::size_t i = begin; i < end; ++i) all.extend(item_[order_[i]]);
        node_[node] = all;
        if (end - begin <= leaf) return;
        Eigen::Index axis;
        all.sizes().maxCoeff(&axis);
        const std::size_t middle = (begin + end) / 2;
        std::nth_element(
            order_.begin() + static_cast<std::ptrdiff_t>(begin), order_.begin() + static_cast<std::ptrdiff_t>(middle),
            order_.begin() + static_cast<std::ptrdiff_t>(end),
            [&](std::size_t a, std::size_t b) { return item_[a].center()[axis] < item_[b].center()[axis]; });
        build(2 * node + 1, begin, middle);
        build(2 * node + 2, middle, end);
    }

    template <class Visit>
    void descend(std::size_t node, std::size_t begin, std::size_t end, const Box& box, const Visit& visit) const {
        if (!node_[node].intersects(box)) return;
        if (end - begin <= leaf) {
            for (std::size_t i = begin; i < end; ++i)
                if (item_[order_[i]].intersects(box)) visit(order_[i]);
            return;
        }
        const std::size_t middle = (begin + end) / 2;
        descend(2 * node + 1, begin, middle, box, visit);
        descend(2 * node + 2, middle, end, box, visit);
    }

    template <class Visit>
    void descend(std::size_t node, std::size_t begin, std::size_t end, const Point& x, const double& best,
                 const Visit& visit) const {
        if (end - begin <= leaf) {
            for (std::size_t i = begin; i < end; ++i)
                if (item_[order_[i]].squaredExteriorDistance(x) < best) visit(order_[i], x);
            return;
        }
        const std::size_t middle = (begin + end) / 2, left = 2 * node + 1, right = left + 1;
        const double to_left = node_[left].squaredExteriorDistance(x),
                     to_right = node_[right].squaredExteriorDistance(x);
        const bool left_first = to_left <= to_right;
        if (left_first && to_left < best) descend(left, begin, middle, x, best, visit);
        if (to_right < best) descend(right, middle, end, x, best, visit);
        if (!left_first && to_left < best) descend(left, begin, middle, x, best, visit);
    }

    std::vector<Box> item_, node_;
    std::vector<std::size_t> order_;
};

}  // namespace tubule::surface3d
