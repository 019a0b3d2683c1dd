#include "surface3d/mesh/half_edges.hpp"

#include <algorithm>
#include <map>
#include <stdexcept>

namespace tubule::surface3d {

HalfEdges::HalfEdges(const TriangleMesh& mesh)
    : points(mesh.points), leaving(mesh.points.size(), -1), period(mesh.period) {
    std::map<std::array<int, 2>, int> edges;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (int c = 0; c < 3; ++c) {
            const int from = mesh.triangles[t][c], to = mesh.triangles[t][(c + 1) % 3], h = size();
            origin.push_back(from);
            shift.push_back(period > 0 ? mesh.shifts[t][c] : 0);
            leaving[from] = h;
            if (from == to || !edges.insert({{from, to}, h}).second)
                throw std::invalid_argument("two vertices of the mesh are joined by more than one edge: " +
                                            std::to_string(from) + " and " + std::to_string(to));
        }
    twin.resize(origin.size());
    for (const auto& [ends, h] : edges) {
        const auto other = edges.find({ends[1], ends[0]});
        if (other == edges.end()) throw std::invalid_argument("the mesh is open or not oriented");
        twin[h] = other->second;
    }
}

int HalfEdges::valence(int vertex) const {
    int count = 0;
    around(vertex, [&](int) { ++count; });
    return count;
}

bool HalfEdges::adjacent(int a, int b) const {
    bool found = false;
    around(a, [&](int h) { found |= target(h) == b; });
    return found;
}

int HalfEdges::live_triangles() const {
    int count = 0;
    for (int h = 0; h < size(); h += 3) count += exists(h);
    return count;
}

bool HalfEdges::can_flip(int h) const {
    const int c = origin[previous(h)], d = origin[previous(twin[h])];
    return c != d && !adjacent(c, d) && valence(origin[h]) > 3 && valence(target(h)) > 3;
}

bool HalfEdges::can_collapse(int h) const {
    const int a = origin[h], b = target(h);
    if (valence(origin[previous(h)]) <= 3 || valence(origin[previous(twin[h])]) <= 3) return false;
    std::vector<int> near;
    around(a, [&](int g) { near.push_back(target(g)); });
    int common = 0;
    around(b, [&](int g) { common += std::find(near.begin(), near.end(), target(g)) != near.end(); });
    return common == 2 && valence(a) + valence(b) - 4 >= 3;
}

void HalfEdges::join(int h, int other) {
    twin[h] = other;
    twin[other] = h;
}

void HalfEdges::set(int h, int vertex, int by) {
    origin[h] = vertex;
    shift[h] = by;
    leaving[vertex] = h;
}

// Triangles abc, bad (h from a to b) become dca... : h from c to d in both.
void HalfEdges::flip(int h) {
    const int g = twin[h], hn = next(h), hp = previous(h), gn = next(g), gp = previous(g);
    const int a = origin[h], b = origin[g], c = origin[hp], d = origin[gp];
    const int by = shift[h] - shift[gn];  // from g's triangle to h's
    const int sa = shift[h], sb = shift[hn], sc = shift[hp], sd = shift[gp] + by;
    const int bc = twin[hn], ca = twin[hp], ad = twin[gn], db = twin[gp];
    set(h, c, sc), set(hn, d, sd), set(hp, b, sb);  // c d b
    set(g, d, sd), set(gn, c, sc), set(gp, a, sa);  // d c a
    join(hn, db), join(hp, bc);
    join(gn, ca), join(gp, ad);
}

int HalfEdges::split(int h, const Eigen::Vector3d& x) {
    const int g = twin[h], hn = next(h), hp = previous(h), gn = next(g), gp = previous(g);
    const int b = origin[g], c = origin[hp], d = origin[gp], m = static_cast<int>(points.size());
    const int by = shift[h] - shift[gn], sb = shift[hn], sc = shift[hp], gb = shift[g], gd = shift[gp];
    const int bc = twin[hn], db = twin[gp], n = size();
    points.push_back(x);
    leaving.push_back(-1);
    for (std::vector<int>* v : {&origin, &shift, &twin}) v->resize(v->size() + 6, 0);
    set(n, m, 0), set(n + 1, b, sb), set(n + 2, c, sc);        // m b c
    set(n + 3, b, gb), set(n + 4, m, -by), set(n + 5, d, gd);  // b m d
    set(hn, m, 0);                                             // a m c
    set(g, m, -by);                                            // m a d
    join(n, n + 3), join(n + 1, bc), join(n + 2, hn);
    join(n + 5, db), join(n + 4, gp);
    return m;
}

void HalfEdges::collapse(int h) {
    const int g = twin[h], a = origin[h], b = origin[g];
    const int sa = shift[h], sb = shift[next(h)];
    std::vector<int> from_a;
    around(a, [&](int e) { from_a.push_back(e); });
    for (const int e : from_a) origin[e] = b, shift[e] += sb - sa;
    const int left = twin[next(h)], right = twin[previous(h)], low = twin[next(g)], high = twin[previous(g)];
    join(left, right), join(low, high);
    for (const int e : {h, g})
        for (const int side : {e, next(e), previous(e)}) origin[side] = -1;
    leaving[a] = -1;
    for (const int e : {left, right, low, high}) leaving[origin[e]] = e;
}

TriangleMesh HalfEdges::triangles() const {
    TriangleMesh out{.points = {}, .triangles = {}, .period = period, .shifts = {}};
    std::vector<int> number(points.size(), -1);
    for (std::size_t v = 0; v < points.size(); ++v) {
        if (leaving[v] < 0) continue;
        number[v] = static_cast<int>(out.points.size());
        out.points.push_back(points[v]);
    }
    for (int h = 0; h < size(); h += 3) {
        if (!exists(h)) continue;
        out.triangles.push_back({number[origin[h]], number[origin[h + 1]], number[origin[h + 2]]});
        if (period > 0) out.shifts.push_back({shift[h], shift[h + 1], shift[h + 2]});
    }
    return out;
}

}  // namespace tubule::surface3d
