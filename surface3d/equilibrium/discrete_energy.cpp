#include "surface3d/equilibrium/discrete_energy.hpp"

#include <algorithm>
#include <map>

#include "common/energy/principal_symbol.hpp"
#include "surface3d/fem/places.hpp"

namespace tubule::surface3d {
namespace {

constexpr int most_own = max_cell_nodes + 1, most_columns = 2 * max_cell_nodes + 1;  // of a triangle; of two
// One column for each unknown of a triangle, the stretch after its nodes, then zeros.
template <int rows>
using Rows = Eigen::Matrix<double, rows, most_own, Eigen::RowMajor>;
using Row = Eigen::Matrix<double, 1, Eigen::Dynamic, Eigen::RowMajor, 1, most_columns>;
using RowStack = Eigen::Matrix<double, Eigen::Dynamic, most_own, Eigen::RowMajor>;
using Own = Eigen::Matrix<double, most_own, most_own, Eigen::RowMajor>;
using Square = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, most_columns, most_columns>;
using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector9 = Eigen::Matrix<double, 9, 1>;
using Matrix9 = Eigen::Matrix<double, 9, 9>;

template <int N>
Eigen::Matrix<double, N, 1> gradient(const Jet<double, N, 2>& f) {
    return Eigen::Map<const Eigen::Matrix<double, N, 1>>(f.d.data());
}
template <int N>
Eigen::Matrix<double, N, N> hessian(const Jet<double, N, 2>& f) {
    Eigen::Matrix<double, N, N> out;
    for (int i = 0; i < N; ++i)
        for (int j = 0; j < N; ++j) out(i, j) = f.dd[packed<N>(i, j)];
    return out;
}

// Functions of four combinations of the metric and the second fundamental form: det g, b11 g22 - 2 b12 g12 + b22 g11,
// det b and b11/g11.
using Invariant = Jet<double, 4, 2>;
template <class T>
struct Curvatures {
    T area, H, K;
    Curvatures(const T& det, const T& trace, const T& gauss) {
        using std::sqrt;
        const T inverse_det = inverse(det);
        area = sqrt(det), H = trace * inverse_det, K = gauss * inverse_det;
    }
};

// A point of a surface: its tangents X_u, X_v, their duals, the second derivatives X_uu, X_uv, X_vv, and both forms.
struct Point {
    Eigen::Vector3d x, tangent[2], dual[2], second[3], normal;
    double g[3], b[3], area, invariant[4];

    // `at`: the place and its derivatives, one row each.
    explicit Point(const Eigen::Matrix<double, 6, 3>& at) : x(at.row(0)), tangent{at.row(1), at.row(2)} {
        const Eigen::Vector3d N = tangent[0].cross(tangent[1]);
        area = N.norm(), normal = N / area;
        for (int i = 0; i < 3; ++i) second[i] = at.row(3 + i), b[i] = second[i].dot(normal);
        for (int i = 0; i < 3; ++i) g[i] = tangent[i / 2].dot(tangent[(i + 1) / 2]);
        const double det = g[0] * g[2] - g[1] * g[1];
        dual[0] = (g[2] * tangent[0] - g[1] * tangent[1]) / det,
        dual[1] = (g[0] * tangent[1] - g[1] * tangent[0]) / det;
        invariant[0] = det, invariant[1] = b[0] * g[2] - 2 * b[1] * g[1] + b[2] * g[0];
        invariant[2] = b[0] * b[2] - b[1] * b[1], invariant[3] = b[0] / g[0];
    }
    Curvatures<double> curvatures() const { return {invariant[0], invariant[1], invariant[2]}; }
    Invariant variable(int i) const { return Invariant::variable(invariant[i], i); }
    Curvatures<Invariant> curvature_jets() const { return {variable(0), variable(1), variable(2)}; }

    // How the invariants change with g11, g12, g22, b11, b12, b22; the first and second derivatives of a function of
    // them in these.
    Eigen::Matrix<double, 4, 6> slopes() const {
        Eigen::Matrix<double, 4, 6> J = Eigen::Matrix<double, 4, 6>::Zero();
        J.topLeftCorner<1, 3>() << g[2], -2 * g[1], g[0];
        J.row(1) << b[2], -2 * b[1], b[0], g[2], -2 * g[1], g[0];
        J.block<1, 3>(2, 3) << b[2], -2 * b[1], b[0];
        J(3, 0) = -b[0] / (g[0] * g[0]), J(3, 3) = 1 / g[0];
        return J;
    }
    Matrix6 second_in_forms(const Eigen::Matrix<double, 4, 6>& J, const Invariant& f) const {
        Matrix6 out = J.transpose() * (hessian(f) * J), part = Matrix6::Zero();
        part(0, 2) = f.d[0], part(1, 1) = -f.d[0], part(3, 5) = f.d[2], part(4, 4) = -f.d[2];
        part(2, 3) = part(0, 5) = f.d[1], part(1, 4) = -2 * f.d[1];
        part(0, 0) = f.d[3] * b[0] / (g[0] * g[0] * g[0]), part(0, 3) = -f.d[3] / (g[0] * g[0]);
        return out + part + part.transpose();
    }
};

// Displacements of a triangle by its unknowns: of each node by its own, and of all by the stretch.
struct Moves {
    Rows<3> nodes = Rows<3>::Zero(), stretch = Rows<3>::Zero();
    int count = 0, all = 0;  // of nodes; with the stretch

    // By each unknown of a point, or of a derivative, where the functions have these values.
    template <class Functions>
    Rows<3> by(const Functions& functions) const {
        Rows<3> out;
        for (int i = 0; i < 3; ++i) out.row(i) = nodes.row(i).cwiseProduct(functions);
        if (all > count) out.col(count) = stretch * functions.transpose();
        return out;
    }
};

// How the unknowns move a point: X_u, X_v, X_uu, X_uv, X_vv along X_u, X_v, the normal and both dual tangents; and how
// they change g11, g12, g22, b11, b12, b22.
struct Change {
    Rows<5> parts[5];
    Rows<6> forms;

    // `functions`: the derivatives of the functions, one row each.
    template <class Functions>
    Change(const Point& p, const Moves& moves, const Functions& functions) {
        Eigen::Matrix<double, 5, 3> frame;
        frame << p.tangent[0].transpose(), p.tangent[1].transpose(), p.normal.transpose(), p.dual[0].transpose(),
            p.dual[1].transpose();
        const Rows<5> at_nodes = frame.lazyProduct(moves.nodes);
        for (int i = 0; i < 5; ++i) {
            for (int k = 0; k < 5; ++k) parts[i].row(k) = at_nodes.row(k).cwiseProduct(functions.row(i));
            if (moves.all > moves.count)
                parts[i].col(moves.count) = frame * (moves.stretch * functions.row(i).transpose());
        }
        forms.row(0) = 2 * parts[0].row(0), forms.row(1) = parts[0].row(1) + parts[1].row(0);
        forms.row(2) = 2 * parts[1].row(1);
        for (int i = 0; i < 3; ++i)
            forms.row(3 + i) = parts[2 + i].row(2) - p.dual[0].dot(p.second[i]) * parts[0].row(2) -
                               p.dual[1].dot(p.second[i]) * parts[1].row(2);
    }
    Rows<1> area() const { return parts[0].row(3) + parts[1].row(4); }  // relative
};

// Sums over points of left^T right, multiplied once for all.
class Products {
public:
    explicit Products(int most_rows) : left_(most_rows, most_own), right_(most_rows, most_own) {}
    template <class Left, class Right>
    void add(const Left& left, const Right& right) {
        left_.middleRows<Left::RowsAtCompileTime>(rows_) = left;
        right_.middleRows<Left::RowsAtCompileTime>(rows_) = right;
        rows_ += Left::RowsAtCompileTime;
    }
    Own sum() const { return left_.topRows(rows_).transpose() * right_.topRows(rows_); }

private:
    RowStack left_, right_;
    int rows_ = 0;
};

// Second derivatives of sums of functions of both forms over points of one triangle. Where p_a = n.w_a of a
// displacement w, the normal changes by -p_a X^a.
class SecondDerivatives {
public:
    // `more`: rows of other products at each point, which are added with their transpose.
    SecondDerivatives(const Moves& moves, int points, int more)
        : products((8 + more) * points), moves_(moves), metric_(2 * points) {}

    // At a point, of a function with these derivatives in the forms.
    template <class Functions>
    void add(const Point& p, const Change& c, const Vector6& G, const Matrix6& GG, const Functions& functions) {
        products.add(c.forms, Rows<6>((0.5 * GG).lazyProduct(c.forms)));
        const Eigen::Vector3d S = G[3] * p.second[0] + G[4] * p.second[1] + G[5] * p.second[2];
        Rows<2> turned, normal;
        for (int b = 0; b < 2; ++b) {
            normal.row(b) = c.parts[b].row(2);
            turned.row(b) = p.dual[0].dot(S) * c.parts[0].row(3 + b) + p.dual[1].dot(S) * c.parts[1].row(3 + b);
            for (int i = 0; i < 3; ++i) turned.row(b) -= G[3 + i] * c.parts[2 + i].row(3 + b);
            for (int a = 0; a < 2; ++a)
                turned.row(b) -= 0.5 * p.normal.dot(S) * p.dual[a].dot(p.dual[b]) * c.parts[a].row(2);
        }
        products.add(normal, turned);
        Eigen::Matrix2d M;
        M << 2 * G[0], G[1], G[1], 2 * G[2];
        const Rows<2> slopes = functions.template topRows<2>();
        metric_.add(slopes, Rows<2>(M.lazyProduct(slopes)));
        if (moves_.all == moves_.count) return;
        const Eigen::Matrix<double, 3, 2> stretch = moves_.stretch * slopes.transpose(), w = stretch * M;
        for (int a = 0; a < 2; ++a) last_ += (w.col(a).transpose() * moves_.nodes).cwiseProduct(slopes.row(a));
        last_[moves_.count] += w.cwiseProduct(stretch).sum();
    }
    Own sum() const {
        const Own half = products.sum();
        Own out = half + half.transpose();
        out += metric_.sum().cwiseProduct(moves_.nodes.transpose() * moves_.nodes);
        if (moves_.all == moves_.count) return out;
        const int n = moves_.count;
        out.row(n) += last_, out.col(n).head(n) += last_.head(n).transpose();
        return out;
    }

    Products products;

private:
    const Moves& moves_;
    Products metric_;
    Rows<1> last_ = Rows<1>::Zero();  // with the stretch
};

// f_H and f_K with their derivatives up to the second; those of formulas leave out the second.
struct MomentDerivatives {
    Jet<double, 2, 2> by_H, by_K;
};
MomentDerivatives moment_derivatives(const Bending& bending, const Bending& powers, double H0, double H, double K) {
    using J = Jet<double, 2, 2>;
    const CurvatureJet<double> f = density_at(bending, H0, H, K);
    const CurvatureJet<J> nested = density_at<J, Added::powers>(powers, H0, J::variable(H, 0), J::variable(K, 1));
    MomentDerivatives out{nested.H, nested.K};
    out.by_H.v = f.H, out.by_H.d = {f.HH, f.HK};
    out.by_K.v = f.K, out.by_K.d = {f.HK, f.KK};
    return out;
}
// F(H, K) of two functions of the forms.
Invariant composed(const Jet<double, 2, 2>& F, const Invariant& H, const Invariant& K) {
    return chain(H, K, F.v, F.d[0], F.d[1], F.dd[0], F.dd[1], F.dd[2]);
}

// Bending without formulas, whose derivatives nest.
Bending powers_alone(Bending bending) {
    std::erase_if(bending.terms, [](const EnergyTerm& term) { return term.formula != nullptr; });
    return bending;
}

// The angle between two triangles that share the tangent t, as the curvature that it concentrates: negative where
// convex; u and v cross the edge on the left and on the right. A function of t.t, t.u, t.v, u.v and t.(u x v).
using CornerJet = Jet<double, 5, 2>;
template <class T>
T angle(const T& tt, const T& tu, const T& tv, const T& uv, const T& triple) {
    using std::atan2, std::sqrt;
    return -atan2(T(sqrt(tt) * triple), T(tt * uv - tu * tv));
}

struct Corner {
    Eigen::Vector3d t, u, v;
    double invariant[5];

    Corner(const Eigen::Vector3d& t, const Eigen::Vector3d& u, const Eigen::Vector3d& v)
        : t(t), u(u), v(v), invariant{t.dot(t), t.dot(u), t.dot(v), u.dot(v), t.dot(u.cross(v))} {}
    CornerJet variable(int i) const { return CornerJet::variable(invariant[i], i); }
    // How the invariants change with t, u and v; second derivatives of a function with these derivatives in them.
    Eigen::Matrix<double, 5, 9> slopes() const {
        Eigen::Matrix<double, 5, 9> J = Eigen::Matrix<double, 5, 9>::Zero();
        J.block<1, 3>(0, 0) = 2 * t.transpose(), J.block<1, 3>(1, 0) = u.transpose();
        J.block<1, 3>(1, 3) = t.transpose(), J.block<1, 3>(2, 0) = v.transpose(), J.block<1, 3>(2, 6) = t.transpose();
        J.block<1, 3>(3, 3) = v.transpose(), J.block<1, 3>(3, 6) = u.transpose();
        J.row(4) << u.cross(v).transpose(), v.cross(t).transpose(), t.cross(u).transpose();
        return J;
    }
    Matrix9 second(const Eigen::Matrix<double, 5, 9>& J, const Eigen::Matrix<double, 5, 1>& f,
                   const Eigen::Matrix<double, 5, 5>& ff) const {
        const auto skew = [](const Eigen::Vector3d& w) {
            return Eigen::Matrix3d{{0, w[2], -w[1]}, {-w[2], 0, w[0]}, {w[1], -w[0], 0}};
        };
        const Eigen::Matrix3d one = Eigen::Matrix3d::Identity();
        Matrix9 part = Matrix9::Zero();
        part.block<3, 3>(0, 0) = f[0] * one, part.block<3, 3>(0, 3) = f[1] * one + f[4] * skew(v);
        part.block<3, 3>(0, 6) = f[2] * one - f[4] * skew(u), part.block<3, 3>(3, 6) = f[3] * one + f[4] * skew(t);
        return J.transpose() * (ff * J) + part + part.transpose();
    }
};

// The points of side `side` of the reference triangle, with derivatives along it and across it, to the left; or
// backwards, and to its right.
Tabulation side_table(int order, int side, bool backwards) {
    static const Eigen::Vector2d begin[]{{0, 0}, {1, 0}, {0, 1}}, along[]{{1, 0}, {-1, 1}, {0, -1}},
        across[]{{0, 1}, {-1, 0}, {1, 0}};
    std::vector<QuadraturePoint> points;
    for (const auto& [x, weight] : gauss_points(order + 2)) {
        const Eigen::Vector2d p = begin[side] + (backwards ? 1 - x : x) * along[side];
        points.push_back({p[0], p[1], weight});
    }
    Tabulation table(order, points);
    const Eigen::Vector2d t = (backwards ? -1 : 1) * along[side], c = (backwards ? -1 : 1) * across[side];
    const auto first = table.d;
    const auto second = table.dd;
    const auto twice = [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b) -> Eigen::MatrixXd {
        return a[0] * b[0] * second[0] + (a[0] * b[1] + a[1] * b[0]) * second[1] + a[1] * b[1] * second[2];
    };
    table.d = {t[0] * first[0] + t[1] * first[1], c[0] * first[0] + c[1] * first[1]};
    table.dd = {twice(t, t), twice(t, c), twice(c, c)};
    return table;
}

// `directions` are empty where nothing moves.
Moves moves_of(const SurfaceSpace& space, const Directions& directions, int cell, const CellColumns<3>& X) {
    Moves out;
    if (directions.normal.cols() == 0) return out;
    out.count = space.width(), out.all = out.count + directions.stretch;
    out.nodes.leftCols(out.count) = space.gather<3>(directions.normal, cell);
    out.stretch.row(2).head(out.count) = X.row(2);
    return out;
}

double at_point(const SurfaceSpace& space, const Eigen::VectorXd& H0, const Bending& bending, int cell,
                const Tabulation& table, int q) {
    if (H0.size() == 0) return bending.H0;
    return space.gather(H0, cell).dot(table.value.col(q));
}

// Changes of X_u x X_v.
template <class Functions>
Rows<3> turned_by(const Point& p, const Moves& moves, const Functions& functions) {
    const Rows<3> u = moves.by(functions.row(0)), v = moves.by(functions.row(1));
    Rows<3> out;
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        out.row(i) = u.row(j) * p.tangent[1][k] - u.row(k) * p.tangent[1][j] + p.tangent[0][j] * v.row(k) -
                     p.tangent[0][k] * v.row(j);
    }
    return out;
}

}  // namespace

struct DiscreteEnergy::Block {
    EnergyValues values;
    Row energy, area, volume, M;
    Square second;  // empty: not asked for

    void reset(int n, bool derive_twice) {
        values = {};
        for (Row* row : {&energy, &area, &volume, &M}) row->setZero(n);
        second.setZero(derive_twice ? n : 0, derive_twice ? n : 0);
    }
};

DiscreteEnergy::Rule::Rule(Tabulation functions) : table(std::move(functions)) {
    stacked.setZero(6 * table.points(), most_own);
    for (int q = 0; q < table.points(); ++q) {
        auto rows = stacked.middleRows<6>(6 * q).leftCols(table.functions());
        rows.row(0) = table.value.col(q).transpose();
        for (int i = 0; i < 5; ++i) rows.row(1 + i) = (i < 2 ? table.d[i] : table.dd[i - 2]).col(q).transpose();
    }
}

Eigen::MatrixX3d DiscreteEnergy::Rule::at(const CellColumns<3>& X) const {
    Rows<3> nodes = Rows<3>::Zero();
    nodes.leftCols(X.cols()) = X;
    Eigen::MatrixX3d out(stacked.rows(), 3);
    for (int i = 0; i < 3; ++i) out.col(i).noalias() = stacked * nodes.row(i).transpose();
    return out;
}

DiscreteEnergy::DiscreteEnergy(const CurvedMesh& mesh, const Bending& bending)
    : space_(mesh), rule_(space_.tabulation()), edge_of_cell_(space_.cells()) {
    if (bending.kg != 0)
        throw std::invalid_argument(
            "equilibria and rates of tier surface3d have no gradient term: energy.kg must be 0");
    for (int side = 0; side < 3; ++side) {
        left_.emplace_back(side_table(mesh.order, side, false));
        right_.emplace_back(side_table(mesh.order, side, true));
    }
    find_edges();
    set_penalty(mesh, bending);
}

void DiscreteEnergy::find_edges() {
    const int inside = space_.order() - 1;  // nodes of an edge that no other one has
    std::map<int, Edge> edges;
    for (int cell = 0; cell < space_.cells(); ++cell)
        for (int side = 0; side < 3; ++side) {
            const int first = space_.node(cell, 3 + side * inside), last = space_.node(cell, 2 + (side + 1) * inside);
            const auto [at, is_new] = edges.try_emplace(std::min(first, last));
            at->second.cell[is_new ? 0 : 1] = cell, at->second.side[is_new ? 0 : 1] = side;
        }
    for (const auto& [node, edge] : edges) {
        for (int s = 0; s < 2; ++s) edge_of_cell_[edge.cell[s]] = {static_cast<int>(edges_.size()), s};
        edges_.push_back(edge);
    }
}

const GroupPattern& DiscreteEnergy::groups() const {
    if (pattern_) return *pattern_;
    std::vector<int> nodes;
    for (const Edge& e : edges_)
        for (int cell : e.cell)
            for (int a = 0; a < space_.width(); ++a) nodes.push_back(space_.node(cell, a));
    pattern_ = group_pattern(space_.size(), nodes, 2 * space_.width());
    return *pattern_;
}

void DiscreteEnergy::set_penalty(const CurvedMesh& mesh, const Bending& bending) {
    std::vector<CellColumns<3>> nodes;
    std::vector<double> sizes(space_.cells(), 0.0);
    for (int cell = 0; cell < space_.cells(); ++cell) {
        nodes.push_back(cell_nodes(mesh, cell));
        const Eigen::MatrixX3d at = rule_.at(nodes.back());
        for (int q = 0; q < rule_.table.points(); ++q)
            sizes[cell] += rule_.table.weight[q] * at.row(6 * q + 1).cross(at.row(6 * q + 2)).norm();
    }
    const int k = space_.order();
    for (Edge& e : edges_) {
        double symbol = 0, width = 0, whole = 0;
        for (int s = 0; s < 2; ++s) {
            const Rule& rule = (s == 0 ? left_ : right_)[e.side[s]];
            const Eigen::MatrixX3d at = rule.at(nodes[e.cell[s]]);
            double along = 0;
            for (int q = 0; q < rule.table.points(); ++q) {
                const Point p(at.middleRows<6>(6 * q));
                const Curvatures<double> c = p.curvatures();
                const double length = rule.table.weight[q] * std::sqrt(p.g[0]);
                symbol += length * principal_symbol(density(bending, c.H, c.K), p.invariant[3]), along += length;
            }
            whole += along, width += 0.5 * along / sizes[e.cell[s]];
        }
        e.penalty = penalty_factor * std::max(symbol / whole, 0.0) * k * (k - 1) / 2.0 * width;
    }
}

// Long: the integrands of all functionals, in the order in which their derivatives need each other.
void DiscreteEnergy::cell_block(const CurvedMesh& mesh, const Directions& d, const Bending& bending,
                                const std::optional<Formula>& potential, double sigma, double lambda,
                                const Eigen::VectorXd& H0, int cell, Block& out) const {
    const CellColumns<3> X = cell_nodes(mesh, cell);
    const Moves moves = moves_of(space_, d, cell, X);
    const Tabulation& table = rule_.table;
    const Eigen::MatrixX3d at = rule_.at(X);
    const int n = space_.width(), m = moves.all;
    std::optional<SecondDerivatives> second;
    if (out.second.size() > 0) second.emplace(moves, table.points(), 3);
    for (int q = 0; q < table.points(); ++q) {
        const Point p(at.middleRows<6>(6 * q));
        const double weight = table.weight[q], dS = weight * p.area,
                     H_0 = at_point(space_, H0, bending, cell, table, q);
        const Curvatures<double> c = p.curvatures();
        const CurvatureJet<double> F = density_at(bending, H_0, c.H, c.K);
        const PointPotential W(potential, p.x);
        out.values.potential += dS * W.value, out.values.potential_force -= dS * W.slope[2];
        out.values.energy += dS * (F.f + W.value), out.values.area += dS, out.values.M += dS * c.H;
        const double third = mesh.period > 0 ? 0.5 : 1.0 / 3;  // of a tube: without the ends of its period
        Eigen::Vector3d from = p.x;
        if (mesh.period > 0) from.z() = 0;
        out.values.volume += third * dS * from.dot(p.normal);
        if (m == 0) continue;
        const auto functions = rule_.stacked.middleRows<5>(6 * q + 1);
        const Change change(p, moves, functions);
        const Curvatures<Invariant> jets = p.curvature_jets();
        const Invariant energy = chain(jets.H, jets.K, F.f, F.H, F.K, F.HH, F.HK, F.KK) * jets.area;
        const Eigen::Matrix<double, 4, 6> J = p.slopes();
        const auto in_forms = [&](const Invariant& f) -> Vector6 { return weight * J.transpose() * gradient(f); };
        const Rows<1> widens = dS * change.area(), by_energy = in_forms(energy).transpose().lazyProduct(change.forms),
                      by_M = in_forms(jets.H * jets.area).transpose().lazyProduct(change.forms);
        const Rows<3> moved = moves.by(rule_.stacked.row(6 * q));
        const Rows<1> climbs = W.slope.transpose() * moved, sweeps = dS * p.normal.transpose() * moved;
        out.energy += by_energy.head(m), out.area += widens.head(m), out.M += by_M.head(m);
        out.volume.head(n) += sweeps.head(n);
        if (potential) out.energy += (W.value * widens + dS * climbs).head(m);
        if (!second && m == n) continue;
        Rows<3> turned = turned_by(p, moves, functions);
        if (m > n) out.volume[n] += weight * 0.5 * from.dot(turned.col(n));
        if (!second) continue;
        const Invariant all = energy + (sigma + W.value) * jets.area;
        second->add(p, change, in_forms(all), weight * p.second_in_forms(J, all), functions);
        if (potential) {
            const Own part = 0.5 * dS * moved.transpose() * W.second * moved + widens.transpose() * climbs;
            out.second += (part + part.transpose()).topLeftCorner(m, m);
        }
        turned *= weight * lambda;
        Rows<3> swept = moved;
        if (m > n) {  // a moving end is no part of the surface: the volume is linear in the stretch
            const Rows<1> part = turned.col(n).transpose() * moved;
            out.second.row(n).head(n) += part.head(n), out.second.col(n).head(n) += part.head(n).transpose();
            turned.col(n).setZero(), swept.col(n).setZero();
        }
        second->products.add(swept, Rows<3>(0.5 * turned));
    }
    if (second) out.second += second->sum().topLeftCorner(m, m);
}

// Two triangles beside an edge, the left one first.
struct DiscreteEnergy::EdgeSides {
    const Rule* rule[2];
    CellColumns<3> X[2];
    Moves moves[2];
    Eigen::RowVectorXd H0[2];

    double H0_at(int s, int q, const Bending& bending) const {
        return H0[s].size() > 0 ? H0[s].dot(rule[s]->table.value.col(q).transpose()) : bending.H0;
    }
};

// One point of an edge, as both see it.
struct DiscreteEnergy::EdgePoint {
    Point side[2];
    Corner corner;
    double H0[2], angle, length, mean = 0, kink;  // mean of the moments; energy of the penalty

    EdgePoint(const EdgeSides& at, const Point& left, const Point& right, const Bending& bending, double penalty, int q)
        : side{left, right},
          corner(left.tangent[0], left.tangent[1], right.tangent[1]),
          H0{at.H0_at(0, q, bending), at.H0_at(1, q, bending)},
          length(std::sqrt(corner.invariant[0])) {
        const double* c = corner.invariant;
        angle = surface3d::angle(c[0], c[1], c[2], c[3], c[4]);
        kink = 0.5 * penalty * angle * angle;
        for (int s = 0; s < 2; ++s) {  // f_H + f_K t.Bt: by how much the energy changes with curvature across the edge
            const Curvatures<double> at_side = side[s].curvatures();
            const CurvatureJet<double> F = density_at(bending, H0[s], at_side.H, at_side.K);
            mean += 0.5 * (F.H + F.K * side[s].invariant[3]);
        }
    }
};

// Second derivatives within each of both triangles, and between them.
struct DiscreteEnergy::EdgeSums {
    SecondDerivatives own[2];
    Products cross;

    explicit EdgeSums(const EdgeSides& at, int points)
        : own{{at.moves[0], points, 10}, {at.moves[1], points, 4}}, cross(5 * points) {}
    void add_to(Square& out) const {
        const Own left = own[0].sum(), right = own[1].sum(), between = cross.sum();
        const Eigen::Index n = out.cols() / 2;
        out.topLeftCorner(n, n) += left.topLeftCorner(n, n), out.block(n, n, n, n) += right.topLeftCorner(n, n);
        out.block(0, n, n, n) += between.topLeftCorner(n, n);
        out.block(n, 0, n, n) += between.topLeftCorner(n, n).transpose();
        if (out.cols() == 2 * n) return;
        Row last(2 * n + 1);
        last << left.row(n).head(n) + between.col(n).head(n).transpose(), right.row(n).head(n) + between.row(n).head(n),
            left(n, n) + right(n, n) + 2 * between(n, n);
        out.row(2 * n) += last, out.col(2 * n).head(2 * n) += last.head(2 * n).transpose();
    }
};

void DiscreteEnergy::edge_block(const CurvedMesh& mesh, const Directions& d, const Bending& bending,
                                const Eigen::VectorXd& H0, const Edge& e, Block& out) const {
    const bool derive = d.normal.cols() > 0;
    EdgeSides at;
    for (int s = 0; s < 2; ++s) {
        at.X[s] = cell_nodes(mesh, e.cell[s]), at.rule[s] = &(s == 0 ? left_ : right_)[e.side[s]];
        if (H0.size() > 0) at.H0[s] = space_.gather(H0, e.cell[s]).transpose();
        at.moves[s] = moves_of(space_, d, e.cell[s], at.X[s]);
    }
    const Bending powers = derive ? powers_alone(bending) : Bending();
    std::optional<EdgeSums> second;
    if (out.second.size() > 0) second.emplace(at, left_[0].table.points());
    const Eigen::MatrixX3d left = at.rule[0]->at(at.X[0]), right = at.rule[1]->at(at.X[1]);
    const Tabulation& table = at.rule[0]->table;
    for (int q = 0; q < table.points(); ++q) {
        const EdgePoint p(at, Point(left.middleRows<6>(6 * q)), Point(right.middleRows<6>(6 * q)), bending, e.penalty,
                          q);
        const double ds = table.weight[q] * p.length;
        out.values.energy += ds * (p.mean * p.angle + p.kink);
        out.values.M += ds * p.angle, out.values.kinks += ds * p.kink;
        if (derive) add_derivatives(at, p, bending, powers, e.penalty, q, second ? &*second : nullptr, out);
    }
    if (second) second->add_to(out.second);
}

// With weight (mean angle + penalty/2 angle^2) length as a function of the two moments, angle and length.
void DiscreteEnergy::add_derivatives(const EdgeSides& at, const EdgePoint& p, const Bending& bending,
                                     const Bending& powers, double penalty, int q, EdgeSums* second, Block& out) const {
    using Vector5 = Eigen::Matrix<double, 5, 1>;
    const int n = space_.width();
    const double weight = at.rule[0]->table.weight[q], ds = p.length, by_moment = weight * ds * 0.5 * p.angle,
                 by_both = weight * (p.mean + penalty * p.angle);  // angle and length
    const auto x = [&](int i) { return p.corner.variable(i); };
    const CornerJet angle = surface3d::angle(x(0), x(1), x(2), x(3), x(4)), length = sqrt(x(0));
    const Eigen::Matrix<double, 5, 9> J = p.corner.slopes();
    const Vector5 a = gradient(angle), l = gradient(length),
                  slope = ds * by_both * a + weight * (p.mean * p.angle + p.kink) * l;
    const Eigen::Matrix<double, 1, 9> energy = slope.transpose() * J,
                                      M = weight * (ds * a + p.angle * l).transpose() * J;
    Matrix9 corner;
    if (second)
        corner = p.corner.second(
            J, slope,
            ds * by_both * hessian(angle) + weight * (p.mean * p.angle + p.kink) * hessian(length) +
                weight * penalty * ds * a * a.transpose() + by_both * (a * l.transpose() + l * a.transpose()));
    const auto spread = [&](int s, const Rows<1>& row, Row& into) {
        into.segment(s * n, n) += row.head(n);
        if (into.size() > 2 * n) into[2 * n] += row[n];
    };
    Rows<1> moments[2], halves[2];  // halves: of M
    Rows<3> tangents[3];            // along the edge, which both share; across it on the left, on the right
    for (int s = 0; s < 2; ++s) {
        const auto functions = at.rule[s]->stacked.middleRows<5>(6 * q + 1);
        const Point& point = p.side[s];
        const Change change(point, at.moves[s], functions);
        const Curvatures<Invariant> jets = point.curvature_jets();
        const MomentDerivatives F = moment_derivatives(bending, powers, p.H0[s], jets.H.v, jets.K.v);
        const Invariant moment =
            composed(F.by_H, jets.H, jets.K) + composed(F.by_K, jets.H, jets.K) * point.variable(3);
        const Eigen::Matrix<double, 4, 6> in_forms = point.slopes();
        const Vector6 by_forms = in_forms.transpose() * gradient(moment);
        moments[s] = by_forms.transpose().lazyProduct(change.forms);
        const int first = s == 0 ? 0 : 2, last = s == 0 ? 1 : 2;
        Rows<1> own = by_moment * moments[s];
        halves[s].setZero();
        for (int i = first; i <= last; ++i) {
            tangents[i] = at.moves[s].by(functions.row(i == 0 ? 0 : 1));
            own += energy.segment<3>(3 * i).lazyProduct(tangents[i]);
            halves[s] += 0.5 * M.segment<3>(3 * i).lazyProduct(tangents[i]);
        }
        spread(s, own, out.energy), spread(s, 2 * halves[s], out.M);
        if (!second) continue;
        SecondDerivatives& sums = second->own[s];
        sums.add(point, change, by_moment * by_forms, by_moment * point.second_in_forms(in_forms, moment), functions);
        for (int i = first; i <= last; ++i)
            sums.products.add(tangents[i], Rows<3>(0.5 * corner.block<3, 3>(3 * i, 3 * i) * tangents[i]));
        sums.products.add(moments[s], halves[s]);
    }
    if (!second) return;
    second->own[0].products.add(tangents[0], Rows<3>(corner.block<3, 3>(0, 3) * tangents[1]));
    second->cross.add(Rows<3>(corner.block<3, 3>(6, 0) * tangents[0] + corner.block<3, 3>(6, 3) * tangents[1]),
                      tangents[2]);
    second->cross.add(moments[0], halves[1]), second->cross.add(halves[0], moments[1]);
}

EnergyValues DiscreteEnergy::values(const CurvedMesh& mesh, const Bending& bending, const Eigen::VectorXd& H0) const {
    const std::optional<Formula> W = potential_density_in_space(bending.potentials);
    std::vector<EnergyValues> parts(space_.cells() + edges_.size());
    parallel_for(parts.size(), [&](std::size_t i) {
        Block block;
        const int cells = space_.cells(), cell = static_cast<int>(i);
        if (cell < cells)
            cell_block(mesh, {}, bending, W, 0, 0, H0, cell, block);
        else
            edge_block(mesh, {}, bending, H0, edges_[i - cells], block);
        parts[i] = block.values;
    });
    EnergyValues out;
    for (const EnergyValues& v : parts) out += v;
    return out;
}

void DiscreteEnergy::add(const Block& block, const std::vector<int>& nodes, const int* slots,
                         EnergyDerivatives& out) const {
    out.values += block.values;
    const int n = static_cast<int>(nodes.size()), N = space_.size();
    for (int i = 0; i < n; ++i) {
        out.energy[nodes[i]] += block.energy[i], out.area[nodes[i]] += block.area[i];
        out.volume[nodes[i]] += block.volume[i], out.M[nodes[i]] += block.M[i];
        for (int j = 0; j < block.second.cols() && j < n; ++j)
            out.hessian.valuePtr()[slots[i * 2 * space_.width() + j]] += block.second(j, i);
    }
    if (out.with_stretch.size() == 0) return;
    out.energy[N] += block.energy[n], out.area[N] += block.area[n], out.volume[N] += block.volume[n];
    out.M[N] += block.M[n];
    if (block.second.size() == 0) return;
    out.stretch_twice += block.second(n, n);
    for (int i = 0; i < n; ++i) out.with_stretch[nodes[i]] += block.second(i, n);
}

EnergyDerivatives DiscreteEnergy::derivatives(const CurvedMesh& mesh, const Directions& directions,
                                              const Bending& bending, double sigma, double lambda,
                                              const Eigen::VectorXd& H0, bool second) const {
    EnergyDerivatives out;
    const std::optional<Formula> W = potential_density_in_space(bending.potentials);
    const int N = space_.size() + directions.stretch, n = space_.width(), cells = space_.cells();
    for (Eigen::VectorXd* v : {&out.energy, &out.area, &out.volume, &out.M}) v->setZero(N);
    if (second) out.hessian = pattern();
    if (directions.stretch) out.with_stretch.setZero(space_.size());
    constexpr int batch = 256;  // blocks that are in memory at once
    std::vector<Block> blocks(batch);
    std::vector<int> nodes;
    const int all = cells + static_cast<int>(edges_.size());
    for (int begin = 0; begin < all; begin += batch) {
        check_pause();
        const int end = std::min(begin + batch, all);
        parallel_for(end - begin, [&](std::size_t j) {
            Block& block = blocks[j];
            const int i = begin + static_cast<int>(j);
            block.reset((i < cells ? n : 2 * n) + directions.stretch, second);
            if (i < cells)
                cell_block(mesh, directions, bending, W, sigma, lambda, H0, i, block);
            else
                edge_block(mesh, directions, bending, H0, edges_[i - cells], block);
        });
        for (int i = begin; i < end; ++i) {
            nodes.clear();
            const bool is_cell = i < cells;
            for (int s = 0; s < (is_cell ? 1 : 2); ++s)
                for (int a = 0; a < n; ++a) nodes.push_back(space_.node(is_cell ? i : edges_[i - cells].cell[s], a));
            const int* slots = second ? (is_cell ? slots_of_cell(i) : slots_of_edge(i - cells)) : nullptr;
            add(blocks[i - begin], nodes, slots, out);
        }
    }
    return out;
}

Eigen::VectorXd DiscreteEnergy::place_slope(const CurvedMesh& mesh, const Directions& directions, const Formula& W,
                                            double P) const {
    using J = Jet<double, 3, 1>;
    const Tabulation& table = space_.tabulation();
    Eigen::VectorXd out = Eigen::VectorXd::Zero(space_.size());
    for (int cell = 0; cell < space_.cells(); ++cell) {
        const CellColumns<3> X = cell_nodes(mesh, cell), D = space_.gather<3>(directions.normal, cell);
        for (int q = 0; q < table.points(); ++q) {
            const SurfacePoint<double> p = tangent_point(X, table, q);
            const J place[]{J::variable(p.x[0], 0), J::variable(p.x[1], 1), J::variable(p.x[2], 2), J(P)},
                w = evaluate(W, place);
            const Eigen::Vector3d climbs = p.area * Eigen::Vector3d(w.d[0], w.d[1], w.d[2]),
                                  along_t = w.v * p.area * p.dual[0], along_c = w.v * p.area * p.dual[1];
            for (int a = 0; a < space_.width(); ++a)
                out[space_.node(cell, a)] +=
                    table.weight[q] *
                    D.col(a).dot(table.value(a, q) * climbs + table.d[0](a, q) * along_t + table.d[1](a, q) * along_c);
        }
    }
    return out;
}

Eigen::SparseMatrix<double> DiscreteEnergy::mass(const CurvedMesh& mesh, const Directions& directions) const {
    Eigen::SparseMatrix<double> out = pattern();
    const Tabulation& table = space_.tabulation();
    const int n = space_.width();
    for (int cell = 0; cell < space_.cells(); ++cell) {
        const CellColumns<3> X = cell_nodes(mesh, cell), D = space_.gather<3>(directions.normal, cell);
        CellMatrix block = CellMatrix::Zero(n, n);
        for (int q = 0; q < table.points(); ++q) {
            const SurfacePoint<double> p = tangent_point(X, table, q);
            const Row w = (p.normal.transpose() * D).cwiseProduct(table.value.col(q).transpose());
            block.noalias() += table.weight[q] * p.area * w.transpose() * w;
        }
        const int* slots = slots_of_cell(cell);
        for (int b = 0; b < n; ++b)
            for (int a = 0; a < n; ++a) out.valuePtr()[slots[b * 2 * n + a]] += block(a, b);
    }
    return out;
}

}  // namespace tubule::surface3d
