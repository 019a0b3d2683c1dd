#include "surface3d/fem/group_pattern.hpp"

#include <algorithm>

namespace tubule::surface3d {

GroupPattern group_pattern(int size, const std::vector<int>& members, int width) {
    std::vector<int> first(size + 1, 0), places(members.size());  // in `members`, of each unknown
    for (int i : members) ++first[i + 1];
    for (int i = 0; i < size; ++i) first[i + 1] += first[i];
    std::vector<int> next(first.begin(), first.end() - 1);
    for (std::size_t k = 0; k < members.size(); ++k) places[next[members[k]]++] = static_cast<int>(k);

    GroupPattern out;
    out.slots.resize(members.size() * width);
    std::vector<int> outer{0}, inner, seen_by(size, -1), slot(size);
    for (int column = 0; column < size; ++column) {
        const auto each_group = [&](auto&& visit) {
            for (int k = first[column]; k < first[column + 1]; ++k) visit(places[k], places[k] - places[k] % width);
        };
        each_group([&](int, int begin) {
            for (int a = begin; a < begin + width; ++a) {
                if (seen_by[members[a]] == column) continue;
                seen_by[members[a]] = column;
                inner.push_back(members[a]);
            }
        });
        std::sort(inner.begin() + outer.back(), inner.end());
        for (int k = outer.back(); k < static_cast<int>(inner.size()); ++k) slot[inner[k]] = k;
        each_group([&](int place, int begin) {
            int* to = &out.slots[static_cast<std::size_t>(place) * width];
            for (int a = 0; a < width; ++a) to[a] = slot[members[begin + a]];
        });
        outer.push_back(static_cast<int>(inner.size()));
    }
    const std::vector<double> zeros(inner.size(), 0.0);
    out.zero = Eigen::Map<const Eigen::SparseMatrix<double>>(size, size, static_cast<Eigen::Index>(inner.size()),
                                                             outer.data(), inner.data(), zeros.data());
    return out;
}

}  // namespace tubule::surface3d
