#include "tests/sphere_matrices.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <utility>

#include "common/solve/dense.hpp"

namespace tubule::sphere {

Triangles icosphere(int level) {
    Triangles t;
    const double g = (1 + std::sqrt(5.0)) / 2;
    for (const double a : {-1.0, 1.0})
        for (const double b : {-g, g})
            for (const Eigen::Vector3d& x :
                 {Eigen::Vector3d(0, a, b), Eigen::Vector3d(a, b, 0), Eigen::Vector3d(b, 0, a)})
                t.points.push_back(x.normalized());
    const double edge = 2 / std::sqrt(1 + g * g);  // of the icosahedron in the unit sphere
    const auto close = [&](int i, int j) { return (t.points[i] - t.points[j]).norm() < 1.01 * edge; };
    for (int i = 0; i < 12; ++i)
        for (int j = i + 1; j < 12; ++j)
            for (int k = j + 1; k < 12; ++k)
                if (close(i, j) && close(j, k) && close(i, k)) t.corners.push_back({i, j, k});
    for (; level > 0; --level) {
        std::map<std::pair<int, int>, int> middles;
        const auto middle = [&](int i, int j) {
            const auto [at, fresh] = middles.try_emplace(std::minmax(i, j), static_cast<int>(t.points.size()));
            if (fresh) t.points.push_back((t.points[i] + t.points[j]).normalized());
            return at->second;
        };
        std::vector<std::array<int, 3>> finer;
        for (const auto& [i, j, k] : t.corners) {
            const int ij = middle(i, j), jk = middle(j, k), ki = middle(k, i);
            for (const std::array<int, 3>& small : {std::array{i, ij, ki}, {j, jk, ij}, {k, ki, jk}, {ij, jk, ki}})
                finer.push_back(small);
        }
        t.corners = std::move(finer);
    }
    return t;
}

namespace {

// The nodes of P_k. A node is known by its corners and their weights, which add up to k.
struct Nodes {
    using Key = std::map<int, int>;
    int order = 1;
    std::map<Key, int> number;
    std::vector<std::vector<int>> of_element;

    Nodes(const Triangles& t, int k) : order(k) {
        for (const auto& corners : t.corners) {
            auto& nodes = of_element.emplace_back();
            for (int a = k; a >= 0; --a)
                for (int b = k - a; b >= 0; --b) {
                    Key key;
                    const int weights[3] = {a, b, k - a - b};
                    for (int i = 0; i < 3; ++i)
                        if (weights[i]) key[corners[i]] = weights[i];
                    nodes.push_back(number.try_emplace(key, static_cast<int>(number.size())).first->second);
                }
        }
    }
    int count() const { return static_cast<int>(number.size()); }
};

// Values (n) and derivatives (n x 2) of the P_k basis at a point (s, t) of the reference triangle, in the order of
// Nodes.
struct Basis {
    Eigen::VectorXd value;
    Eigen::MatrixX2d derivative;

    Basis(int k, double s, double t) : value((k + 1) * (k + 2) / 2), derivative(value.size(), 2) {
        // Product over i < a of (k x - i) / (i + 1), and its derivative.
        const auto factor = [k](int a, double x) {
            std::pair<double, double> f{1, 0};
            for (int i = 0; i < a; ++i) {
                f.second = (f.second * (k * x - i) + f.first * k) / (i + 1);
                f.first *= (k * x - i) / (i + 1);
            }
            return f;
        };
        int n = 0;
        for (int a = k; a >= 0; --a)
            for (int b = k - a; b >= 0; --b, ++n) {
                const auto [f, df] = factor(a, 1 - s - t);
                const auto [g, dg] = factor(b, s);
                const auto [h, dh] = factor(k - a - b, t);
                value[n] = f * g * h;
                derivative.row(n) << (f * dg - df * g) * h, (f * dh - df * h) * g;
            }
    }
};

// Points (s, t, weight) of a product Gauss rule of n points each way, folded into the reference triangle.
std::vector<Eigen::Vector3d> quadrature(int n) {
    Eigen::MatrixXd jacobi = Eigen::MatrixXd::Zero(n, n);
    for (int i = 1; i < n; ++i) jacobi(i, i - 1) = i / std::sqrt(4.0 * i * i - 1);
    const Eigenpairs gauss = eigenpairs(jacobi, true);
    const Eigen::ArrayXd x = (gauss.values.array() + 1) / 2, w = gauss.vectors.row(0).array().square();
    std::vector<Eigen::Vector3d> points;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) points.emplace_back(x[i], x[j] * (1 - x[i]), w[i] * w[j] * (1 - x[i]));
    return points;
}

// What a weak form sees at a point of an element: weight, normal, velocity of a rotation, basis of degree k, k - 1.
struct Point {
    double weight;
    Eigen::Vector3d nu, rotation;
    Eigen::VectorXd phi, psi;
    Eigen::MatrixX3d grad;  // tangential gradients of phi
};

// A matrix with these unknowns per element, from what `add` puts into the local matrix at each point;
// blocks left zero are not in its pattern.
Matrix assemble(const Triangles& t, int k, const std::vector<std::vector<int>>& unknowns, int size,
                const std::function<void(const Point&, Eigen::MatrixXd&)>& add) {
    std::vector<Eigen::Triplet<double>> entries;
    const auto rule = quadrature(k + 1);
    std::vector<std::pair<Basis, Basis>> bases;
    for (const auto& q : rule) bases.emplace_back(Basis(k, q[0], q[1]), Basis(k - 1, q[0], q[1]));
    for (std::size_t e = 0; e < t.corners.size(); ++e) {
        const Eigen::Vector3d x0 = t.points[t.corners[e][0]];
        Eigen::Matrix<double, 3, 2> tangents;
        tangents << t.points[t.corners[e][1]] - x0, t.points[t.corners[e][2]] - x0;
        const Eigen::Matrix2d metric = tangents.transpose() * tangents;
        Eigen::MatrixXd local = Eigen::MatrixXd::Zero(unknowns[e].size(), unknowns[e].size());
        for (std::size_t q = 0; q < rule.size(); ++q) {
            const Eigen::Vector3d nu = (x0 + tangents * rule[q].head<2>()).normalized();
            add({rule[q][2] * std::sqrt(metric.determinant()), nu, Eigen::Vector3d(1, 2, 3).cross(nu),
                 bases[q].first.value, bases[q].second.value,
                 bases[q].first.derivative * metric.inverse() * tangents.transpose()},
                local);
        }
        for (int j = 0; j < local.cols(); ++j)
            for (int i = 0; i < local.rows(); ++i)
                if (local(i, j) != 0 || local(j, i) != 0)
                    entries.emplace_back(unknowns[e][i], unknowns[e][j], local(i, j));
    }
    Matrix A(size, size);
    A.setFromTriplets(entries.begin(), entries.end());
    return A;
}

}  // namespace

Matrix helmholtz(const Triangles& t, int k, double mass, double stiffness) {
    const Nodes nodes(t, k);
    return assemble(t, k, nodes.of_element, nodes.count(), [&](const Point& q, Eigen::MatrixXd& local) {
        local += q.weight * (mass * q.phi * q.phi.transpose() + stiffness * q.grad * q.grad.transpose());
    });
}

System saddle(const Triangles& t, int k, double wind) {
    const Nodes nodes(t, k);
    const int n = nodes.count();
    System s;
    for (int i = 0; i < 4 * n; ++i) s.node_of_unknown.push_back(i % n);
    std::vector<std::vector<int>> unknowns;
    for (const auto& element : nodes.of_element) {
        auto& u = unknowns.emplace_back();
        for (int d = 0; d < 4; ++d)
            for (const int i : element) u.push_back(d * n + i);
    }
    s.A = assemble(t, k, unknowns, 4 * n, [&](const Point& q, Eigen::MatrixXd& local) {
        const auto m = q.phi.size();
        const Eigen::MatrixXd mass = q.weight * q.phi * q.phi.transpose();
        const Eigen::MatrixXd motion =
            q.weight * (q.grad * q.grad.transpose() + wind * q.phi * (q.grad * q.rotation).transpose());
        for (int d = 0; d < 3; ++d) {
            local.block(d * m, d * m, m, m) += motion;
            local.block(d * m, 3 * m, m, m) += q.nu[d] * mass;
            local.block(3 * m, d * m, m, m) += q.nu[d] * mass;
        }
    });
    return s;
}

constexpr double flow_f_HH = 0.25, flow_f_KK = 0.24;
System flow(const Triangles& t, int k, double tau) {
    const double f_HH = flow_f_HH, f_KK = flow_f_KK;
    const Nodes nodes(t, k), pressures(t, k - 1);
    const int n = nodes.count(), np = pressures.count(), size = 5 * n + np;
    System s{.A = {}, .node_of_unknown = std::vector<int>(size)};
    for (int i = 0; i < 5 * n; ++i) s.node_of_unknown[i < 3 * n ? i : i + np] = i % n;
    for (const auto& [place, p] : pressures.number) {  // a node of P_k in the same corner, edge or interior
        Nodes::Key key = place;
        ++key.begin()->second;
        s.node_of_unknown[3 * n + p] = nodes.number.at(key);
    }
    std::vector<std::vector<int>> unknowns;
    for (std::size_t e = 0; e < t.corners.size(); ++e) {
        auto& u = unknowns.emplace_back();
        for (int d = 0; d < 3; ++d)
            for (const int i : nodes.of_element[e]) u.push_back(d * n + i);
        for (const int i : pressures.of_element[e]) u.push_back(3 * n + i);
        for (int field = 0; field < 2; ++field)
            for (const int i : nodes.of_element[e]) u.push_back((3 + field) * n + np + i);
    }
    s.A = assemble(t, k, unknowns, size, [&](const Point& q, Eigen::MatrixXd& local) {
        const auto m = q.phi.size(), mp = q.psi.size(), H = 3 * m + mp, K = H + m;
        const Eigen::Matrix3d P = Eigen::Matrix3d::Identity() - q.nu * q.nu.transpose();
        const Eigen::MatrixXd mass = q.weight * q.phi * q.phi.transpose(), grad = q.grad * P;
        const Eigen::MatrixXd inertia = mass / tau + q.weight * q.phi * (grad * q.rotation).transpose();
        for (int d = 0; d < 3; ++d) {
            local.block(d * m, d * m, m, m) += inertia;
            for (int c = 0; c < 3; ++c)  // 2 sigma : grad v = SUM P_cd grad a . grad b + d_d a d_c b
                local.block(d * m, c * m, m, m) +=
                    q.weight * (P(c, d) * grad * grad.transpose() + grad.col(c) * grad.col(d).transpose());
            const Eigen::MatrixXd divergence = q.weight * q.psi * grad.col(d).transpose();
            local.block(3 * m, d * m, mp, m) += divergence;
            local.block(d * m, 3 * m, m, mp) -= divergence.transpose();
            // G(v) = nu_d grad v + P e_d v; (G(v), grad phi), and the zero-order terms of H and K
            const Eigen::MatrixXd g = q.weight * (q.nu[d] * grad * grad.transpose() + grad.col(d) * q.phi.transpose());
            local.block(H, d * m, m, m) += tau * (g - 2 * q.nu[d] * mass);
            local.block(K, d * m, m, m) += tau * (-g + 2 * q.nu[d] * mass);
            local.block(d * m, H, m, m) -= f_HH * g.transpose();
            local.block(d * m, K, m, m) += f_KK * g.transpose();
        }
        local.block(H, H, m, m) += mass;
        local.block(K, K, m, m) += mass;
    });
    return s;
}

System almost_symmetric(System flow, double tau) {
    const auto size = flow.A.rows();
    const int n = *std::max_element(flow.node_of_unknown.begin(), flow.node_of_unknown.end()) + 1;
    Eigen::VectorXd row = Eigen::VectorXd::Ones(size);
    row.segment(3 * n, size - 5 * n).setConstant(-1);
    row.segment(size - 2 * n, n).setConstant(-flow_f_HH / tau);
    row.tail(n).setConstant(-flow_f_KK / tau);
    flow.A = row.asDiagonal() * flow.A;
    return flow;
}

}  // namespace tubule::sphere
