#include "tools/compare/distance.hpp"

#include <algorithm>
#include <cmath>

#include "common/geometry/profile_point.hpp"
#include "common/solve/parallel.hpp"
#include "common/solve/pause.hpp"
#include "tools/compare/surfaces.hpp"

namespace tubule::compare {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr std::size_t pieces_searched = 32;
constexpr int halvings = 12;  // of the search step; the error of the maximum is quadratic in it

struct OneWay {
    double largest = 0, mean_square = 0, area = 0;
    Vector3d where;
};

// A local maximum of the distance near a sample, by coordinate steps that are halved when none increases it.
double climb(const Surface& from, const Surface& to, const RigidMotion& motion, Place place, Vector2d reach,
             double value) {
    static const Vector2d ways[] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, -1}, {-1, 1}};
    for (int i = 0; i < halvings;) {
        bool higher = false;
        for (const Vector2d& way : ways) {
            Place next{place.piece, place.at + reach.cwiseProduct(way)};
            from.confine(next);
            const double there = to.foot(motion(from.at(next))).distance;
            if (there > value) value = there, place = next, higher = true;
        }
        if (!higher) reach /= 2, ++i;
    }
    return value;
}

// From points x of `from`, moved, to `to`.
OneWay one_way(const Surface& from, const Surface& to, const RigidMotion& motion) {
    const std::vector<Sample> samples = from.samples(to.grain());
    std::vector<double> away(samples.size());
    SharedPause pause;
    parallel_for(samples.size(), [&](std::size_t i) {
        if (!pause.look(i)) away[i] = to.foot(motion(samples[i].x)).distance;
    });
    pause.check();

    OneWay out;
    for (std::size_t i = 0; i < samples.size(); ++i) {
        out.area += samples[i].weight;
        out.mean_square += samples[i].weight * away[i] * away[i];
    }
    out.mean_square /= out.area;

    // The farthest sample of each piece, the farthest pieces first. A surface of revolution is one piece: its samples
    // are separated by distance.
    std::vector<std::size_t> order(samples.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::sort(order.begin(), order.end(), [&](std::size_t i, std::size_t j) { return away[i] > away[j]; });
    out.largest = away[order[0]], out.where = samples[order[0]].x;
    std::vector<std::size_t> chosen;
    for (const std::size_t i : order) {
        const auto near = [&](std::size_t j) {
            const Place &p = samples[i].place, &q = samples[j].place;
            const Vector2d apart = (p.at - q.at).cwiseAbs() - 4 * samples[i].reach;
            return p.piece == q.piece && (from.grain() > 0 || apart.maxCoeff() <= 0);
        };
        if (std::none_of(chosen.begin(), chosen.end(), near)) chosen.push_back(i);
        if (chosen.size() == pieces_searched || away[i] < out.largest / 2) break;
    }
    std::vector<double> higher(chosen.size());
    parallel_for(chosen.size(), [&](std::size_t c) {
        const Sample& sample = samples[chosen[c]];
        higher[c] = climb(from, to, motion, sample.place, sample.reach, away[chosen[c]]);
    });
    for (std::size_t c = 0; c < chosen.size(); ++c)
        if (higher[c] > out.largest) out.largest = higher[c], out.where = samples[chosen[c]].x;
    return out;
}

}  // namespace

Distance distance(const Surface& a, const Surface& b, const RigidMotion& motion) {
    require_same_kind(a, b);
    const OneWay there = one_way(a, b, motion.inverse()), back = one_way(b, a, motion);
    Distance out;
    out.hausdorff = std::max(there.largest, back.largest);
    out.where = there.largest >= back.largest ? there.where : motion(back.where);
    out.l2 = std::sqrt((there.mean_square + back.mean_square) / 2);
    out.size = a.period() > 0 ? there.area / (2 * pi * a.period()) : std::sqrt(there.area / (4 * pi));
    return out;
}

}  // namespace tubule::compare
