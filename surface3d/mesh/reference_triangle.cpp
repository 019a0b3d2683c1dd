#include "surface3d/mesh/reference_triangle.hpp"

#include <gsl/gsl_integration.h>

#include <cassert>

#include "common/geometry/jet.hpp"

namespace tubule::surface3d {
namespace {

// Points of equal weight (of a triangle of area 1) that the symmetries of the triangle exchange: barycentric
// coordinates (a, a, 1 - 2a), 3 points, where b < 0, else (a, b, 1 - a - b), 6 points.
struct Orbit {
    double weight, a, b;
};
struct SymmetricRule {
    int degree;
    double centre;  // weight of the centre
    std::vector<Orbit> orbits;
};

// The numbers solve the moment equations of the invariant polynomials to 18 digits, found by Newton's method; the
// numbers of orbits are those of Dunavant (1985).
const std::vector<SymmetricRule>& symmetric_rules() {
    static const std::vector<SymmetricRule> rules{
        {4,
         0,
         {{0.223381589678011466, 0.445948490915964886, -1},  //
          {0.109951743655321868, 0.0915762135097707435, -1}}},
        {6,
         0,
         {{0.116786275726379366, 0.249286745170910421, -1},
          {0.0508449063702068169, 0.0630890144915022283, -1},
          {0.0828510756183735752, 0.0531450498448169474, 0.310352451033784405}}},
        {8,
         0.144315607677787168,
         {{0.10321737053471825, 0.170569307751760207, -1},
          {0.0950916342672846248, 0.459292588292723156, -1},
          {0.0324584976231980803, 0.0505472283170309755, -1},
          {0.0272303141744349943, 0.00839477740995760534, 0.263112829634638113}}},
        {10,
         0.0817433291462859664,
         {{0.045957963604744728, 0.142161101056564385, -1},
          {0.0133529688131495663, 0.0320553732169435129, -1},
          {0.0341846481629594286, 0.0296198894887297676, 0.369146781827810987},
          {0.0252977577072883844, 0.0283676653399384393, 0.163701733737182496},
          {0.0639049063964240454, 0.14813288578382055, 0.321812995288835421}}},
        {12,
         0,
         {{0.0257310664404553354, 0.488217389773804883, -1},
          {0.0436925445380384021, 0.439724392294460273, -1},
          {0.0628582242178851004, 0.271210385012115922, -1},
          {0.034796112930708943, 0.127576145541585925, -1},
          {0.00616626105155901723, 0.0213173504532103702, -1},
          {0.0403715577663809295, 0.115343494534697999, 0.275713269685514194},
          {0.0223567732023034457, 0.0228383322222570296, 0.281325580989939548},
          {0.0173162311086588924, 0.0257340505483302282, 0.116251915907597141}}}};
    return rules;
}

std::vector<QuadraturePoint> points_of(const SymmetricRule& rule) {
    std::vector<QuadraturePoint> points;
    if (rule.centre > 0) points.push_back({1.0 / 3, 1.0 / 3, rule.centre / 2});
    for (const auto& [weight, a, b] : rule.orbits) {
        if (b < 0) {
            const double c = 1 - 2 * a;
            for (const auto& [xi, eta] : {std::array{a, a}, {a, c}, {c, a}}) points.push_back({xi, eta, weight / 2});
        } else {
            const double c = 1 - a - b;
            for (const auto& [xi, eta] : {std::array{a, b}, {b, a}, {b, c}, {c, b}, {c, a}, {a, c}})
                points.push_back({xi, eta, weight / 2});
        }
    }
    return points;
}

// xi = u, eta = v (1 - u), with Gauss points in u and v; the Jacobian 1 - u costs one degree.
std::vector<QuadraturePoint> collapsed_gauss(int degree) {
    std::vector<QuadraturePoint> points;
    const auto gauss = gauss_points((degree + 3) / 2);
    for (const auto& [u, wu] : gauss)
        for (const auto& [v, wv] : gauss) points.push_back({u, v * (1 - u), wu * wv * (1 - u)});
    return points;
}

// The Lagrange function of lattice node (i, j, l) as a product of linear factors, one for each lattice line that it
// vanishes on.
template <class S>
S lagrange(int order, const std::array<int, 3>& node, const S& xi, const S& eta) {
    const std::array<S, 3> lambda{1.0 - xi - eta, xi, eta};
    S out(1.0);
    for (int c = 0; c < 3; ++c)
        for (int a = 0; a < node[c]; ++a) out = out * ((static_cast<double>(order) * lambda[c] - a) * (1.0 / (a + 1)));
    return out;
}

}  // namespace

std::vector<std::array<int, 3>> lattice(int order) {
    const int k = order;
    std::vector<std::array<int, 3>> nodes{{k, 0, 0}, {0, k, 0}, {0, 0, k}};
    for (int edge = 0; edge < 3; ++edge)
        for (int step = 1; step < k; ++step) {
            std::array<int, 3> node{};
            node[edge] = k - step;
            node[(edge + 1) % 3] = step;
            nodes.push_back(node);
        }
    // VTK fills the interior with the nodes of P_{k-3}, of which only the corners are needed up to k = 4.
    assert(k <= max_order);
    if (k == 3) nodes.push_back({1, 1, 1});
    if (k == 4) nodes.insert(nodes.end(), {{2, 1, 1}, {1, 2, 1}, {1, 1, 2}});
    return nodes;
}

std::vector<std::array<double, 2>> gauss_points(int n) {
    std::vector<std::array<double, 2>> points(n);
    gsl_integration_glfixed_table* table = gsl_integration_glfixed_table_alloc(n);
    for (int i = 0; i < n; ++i) gsl_integration_glfixed_point(0, 1, i, &points[i][0], &points[i][1], table);
    gsl_integration_glfixed_table_free(table);
    return points;
}

std::vector<QuadraturePoint> quadrature(int degree) {
    for (const SymmetricRule& rule : symmetric_rules())
        if (rule.degree >= degree) return points_of(rule);
    return collapsed_gauss(degree);
}

Tabulation::Tabulation(int order, const std::vector<QuadraturePoint>& points) {
    const auto nodes = lattice(order);
    const int rows = static_cast<int>(nodes.size()), columns = static_cast<int>(points.size());
    weight.resize(columns);
    point.resize(2, columns);
    for (Eigen::MatrixXd* m : {&value, &d[0], &d[1], &dd[0], &dd[1], &dd[2]}) m->resize(rows, columns);
    using Second = Jet<double, 2, 2>;
    for (int q = 0; q < columns; ++q) {
        weight[q] = points[q].weight;
        point.col(q) << points[q].xi, points[q].eta;
        const Second xi = Second::variable(points[q].xi, 0), eta = Second::variable(points[q].eta, 1);
        for (int a = 0; a < rows; ++a) {
            const Second f = lagrange(order, nodes[a], xi, eta);
            value(a, q) = f.v;
            for (int i = 0; i < 2; ++i) d[i](a, q) = f.d[i];
            for (int i = 0; i < 3; ++i) dd[i](a, q) = f.dd[i];
        }
    }
}

}  // namespace tubule::surface3d
