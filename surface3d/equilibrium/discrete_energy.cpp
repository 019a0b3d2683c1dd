#include "surface3d/equilibrium/discrete_energy.hpp"

#include <algorithm>
#include <map>

#include "common/energy/principal_symbol.hpp"
#include "surface3d/fem/places.hpp"

namespace tubule::surface3d {
namespace {

constexpr int most_columns = 2 * max_cell_nodes + 1;
using Columns3 = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, most_columns>;
using Columns6 = Eigen::Matrix<double, 6, Eigen::Dynamic, 0, 6, most_columns>;
using Columns9 = Eigen::Matrix<double, 9, Eigen::Dynamic, 0, 9, most_columns>;
using Row = Eigen::Matrix<double, 1, Eigen::Dynamic, Eigen::RowMajor, 1, most_columns>;
using Square = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, most_columns, most_columns>;
using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector9 = Eigen::Matrix<double, 9, 1>;

// Functions of the metric g11, g12, g22 and the second fundamental form b11, b12, b22.
using Form = Jet<double, 6, 2>;

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

struct Curvatures {
    Form area, H, K, g11, b11;
};

// The tangents t, c = X_u, X_v and the second derivatives of a surface at a point, and how its normal and its two
// fundamental forms change with them.
struct Frame {
    Eigen::Vector3d x, t, c, second[3], normal;
    double area;
    Eigen::Matrix<double, 3, 6> normal_slope;  // in (t, c)
    Eigen::Matrix<double, 3, 6> cross;         // of t x c
    Vector6 area_slope;
    Matrix6 area_second;

    Frame(const CellColumns<3>& X, const Tabulation& table, int q)
        : x(X * table.value.col(q)), t(X * table.d[0].col(q)), c(X * table.d[1].col(q)) {
        for (int i = 0; i < 3; ++i) second[i] = X * table.dd[i].col(q);
        const Eigen::Vector3d N = t.cross(c);
        area = N.norm(), normal = N / area;
        for (int i = 0; i < 3; ++i) {
            const Eigen::Vector3d e = Eigen::Vector3d::Unit(i);
            cross.col(i) = e.cross(c), cross.col(3 + i) = t.cross(e);
        }
        area_slope = cross.transpose() * normal;
        normal_slope = (cross - normal * area_slope.transpose()) / area;
        area_second =
            (cross.transpose() * cross - area_slope * area_slope.transpose()) / area + along(normal / area) * area;
    }
    // Second derivatives of v . (t x c) in (t, c).
    static Matrix6 along(const Eigen::Vector3d& v) {
        Matrix6 out = Matrix6::Zero();
        out(0, 4) = v[2], out(0, 5) = -v[1], out(1, 3) = -v[2], out(1, 5) = v[0], out(2, 3) = v[1], out(2, 4) = -v[0];
        out.bottomLeftCorner<3, 3>() = out.topRightCorner<3, 3>().transpose();
        return out;
    }
    // Second derivatives of v . normal.
    Matrix6 normal_second(const Eigen::Vector3d& v) const {
        const double part = v.dot(normal);
        const Vector6 slope = cross.transpose() * v;
        Matrix6 out = along(v) - part * area_second;
        out.noalias() -= (slope * area_slope.transpose() + area_slope * slope.transpose()) / area;
        out.noalias() += 2 * part / area * area_slope * area_slope.transpose();
        return out / area;
    }
    Curvatures curvatures() const {
        const Form g11 = Form::variable(t.dot(t), 0), g12 = Form::variable(t.dot(c), 1),
                   g22 = Form::variable(c.dot(c), 2);
        const Form b11 = Form::variable(second[0].dot(normal), 3), b12 = Form::variable(second[1].dot(normal), 4),
                   b22 = Form::variable(second[2].dot(normal), 5);
        const Form det = g11 * g22 - g12 * g12, inverse_det = inverse(det);
        return {sqrt(det), (b11 * g22 - 2.0 * (b12 * g12) + b22 * g11) * inverse_det,
                (b11 * b22 - b12 * b12) * inverse_det, g11, b11};
    }
};

// Columns of the unknowns of a triangle at a point: changes of (t, c), of the second derivatives, of the two forms.
struct Change {
    Columns6 tangents;
    Columns3 second[3], normal;
    Columns6 forms;

    // `D`: displacement of each node of the cell by each of its unknowns, the stretch last.
    Change(const Frame& f, const CellColumns<3>& D, const CellColumns<3>* stretch, const Tabulation& table, int q) {
        const int n = static_cast<int>(D.cols()), m = n + (stretch != nullptr);
        tangents.resize(6, m), forms.resize(6, m);
        const auto along = [&](const Eigen::MatrixXd& functions, auto&& out) {
            out.leftCols(n) = D * functions.col(q).asDiagonal();
            if (stretch) out.col(n) = *stretch * functions.col(q);
        };
        along(table.d[0], tangents.topRows<3>()), along(table.d[1], tangents.bottomRows<3>());
        for (int i = 0; i < 3; ++i) second[i].resize(3, m), along(table.dd[i], second[i]);
        normal = f.normal_slope * tangents;
        const auto t = tangents.topRows<3>(), c = tangents.bottomRows<3>();
        forms.row(0) = 2 * f.t.transpose() * t;
        forms.row(1) = f.t.transpose() * c + f.c.transpose() * t;
        forms.row(2) = 2 * f.c.transpose() * c;
        for (int i = 0; i < 3; ++i)
            forms.row(3 + i) = f.normal.transpose() * second[i] + f.second[i].transpose() * normal;
    }
    // Adds the second derivatives of a function of the forms with this gradient and Hessian.
    template <class Out>
    void add_second(const Frame& f, const Vector6& G, const Matrix6& GG, Out&& out) const {
        Matrix6 T = f.normal_second(G[3] * f.second[0] + G[4] * f.second[1] + G[5] * f.second[2]);
        T.diagonal().head<3>().array() += 2 * G[0];
        T.diagonal().tail<3>().array() += 2 * G[2];
        T.topRightCorner<3, 3>().diagonal().array() += G[1];
        T.bottomLeftCorner<3, 3>().diagonal().array() += G[1];
        const Columns6 forms_part = GG * forms, tangent_part = T * tangents;
        const Columns3 S = G[3] * second[0] + G[4] * second[1] + G[5] * second[2];
        out.noalias() += forms.transpose() * forms_part;
        out.noalias() += tangents.transpose() * tangent_part;
        out.noalias() += S.transpose() * normal;
        out.noalias() += normal.transpose() * S;
    }
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
Form composed(const Jet<double, 2, 2>& F, const Form& H, const Form& K) {
    return chain(H, K, F.v, F.d[0], F.d[1], F.dd[0], F.dd[1], F.dd[2]);
}

// Bending without formulas, whose derivatives nest.
Bending powers_alone(Bending bending) {
    std::erase_if(bending.terms, [](const EnergyTerm& term) { return term.formula != nullptr; });
    return bending;
}

// The angle between two triangles that share the tangent t, as the curvature that it concentrates: negative where
// convex. Variables t, c of the left, c of the right.
using Corner = Jet<double, 9, 2>;
Corner angle(const Eigen::Vector3d& t, const Eigen::Vector3d& left, const Eigen::Vector3d& right) {
    const auto variables = [](const Eigen::Vector3d& v, int first) {
        return Vector3<Corner>(Corner::variable(v[0], first), Corner::variable(v[1], first + 1),
                               Corner::variable(v[2], first + 2));
    };
    const Vector3<Corner> T = variables(t, 0), a = T.cross(variables(left, 3)), b = T.cross(variables(right, 6));
    const Vector3<Corner> axb = a.cross(b);
    return -atan2(T.dot(axb) * inverse_sqrt(T.dot(T)), a.dot(b));
}
Corner length(const Eigen::Vector3d& t) {
    Corner out = Corner::variable(t[0], 0) * Corner::variable(t[0], 0);
    for (int i = 1; i < 3; ++i) out += Corner::variable(t[i], i) * Corner::variable(t[i], i);
    return sqrt(out);
}

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

CellColumns<3> stretch_of(const CellColumns<3>& X) {
    CellColumns<3> out = CellColumns<3>::Zero(3, X.cols());
    out.row(2) = X.row(2);
    return out;
}

double at_point(const SurfaceSpace& space, const Eigen::VectorXd& H0, const Bending& bending, int cell,
                const Tabulation& table, int q) {
    if (H0.size() == 0) return bending.H0;
    return space.gather(H0, cell).dot(table.value.col(q));
}

}  // namespace

// What is known of the triangles beside an edge, the left one first.
struct DiscreteEnergy::EdgeSides {
    CellColumns<3> X[2], D[2], stretch[2];  // nodes, their directions and stretch, empty where not asked for
    Eigen::RowVectorXd H0[2];
    const Tabulation* table[2];
};

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

DiscreteEnergy::DiscreteEnergy(const CurvedMesh& mesh, const Bending& bending) : space_(mesh) {
    if (bending.kg != 0)
        throw std::invalid_argument(
            "equilibria and rates of tier surface3d have no gradient term: energy.kg must be 0");
    for (int side = 0; side < 3; ++side) {
        left_.push_back(side_table(mesh.order, side, false));
        right_.push_back(side_table(mesh.order, side, true));
    }
    find_edges();
    set_pattern();
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
    for (const auto& [node, edge] : edges) edges_.push_back(edge);
}

void DiscreteEnergy::set_pattern() {
    std::vector<std::vector<int>> rows(space_.size());
    const int n = space_.width();
    const auto nodes_of = [&](const Edge& e) {
        std::vector<int> nodes;
        for (int cell : e.cell)
            for (int a = 0; a < n; ++a) nodes.push_back(space_.node(cell, a));
        return nodes;
    };
    for (const Edge& e : edges_) {
        const std::vector<int> nodes = nodes_of(e);
        for (int b : nodes) rows[b].insert(rows[b].end(), nodes.begin(), nodes.end());
    }
    std::vector<Eigen::Triplet<double>> entries;
    for (int column = 0; column < space_.size(); ++column) {
        auto& r = rows[column];
        std::sort(r.begin(), r.end());
        r.erase(std::unique(r.begin(), r.end()), r.end());
        for (int row : r) entries.emplace_back(row, column, 0.0);
    }
    pattern_.resize(space_.size(), space_.size());
    pattern_.setFromTriplets(entries.begin(), entries.end());
    const auto slot = [&](int row, int column) {
        const int *begin = pattern_.innerIndexPtr(), *low = begin + pattern_.outerIndexPtr()[column],
                  *high = begin + pattern_.outerIndexPtr()[column + 1];
        return static_cast<int>(std::lower_bound(low, high, row) - begin);
    };
    for (int cell = 0; cell < space_.cells(); ++cell)
        for (int b = 0; b < n; ++b)
            for (int a = 0; a < n; ++a) cell_slots_.push_back(slot(space_.node(cell, a), space_.node(cell, b)));
    for (const Edge& e : edges_) {
        const std::vector<int> nodes = nodes_of(e);
        for (int b : nodes)
            for (int a : nodes) edge_slots_.push_back(slot(a, b));
    }
}

void DiscreteEnergy::set_penalty(const CurvedMesh& mesh, const Bending& bending) {
    const auto size_of = [&](int cell) {
        const CellColumns<3> X = cell_nodes(mesh, cell);
        double area = 0;
        for (int q = 0; q < space_.tabulation().points(); ++q)
            area += space_.tabulation().weight[q] * tangent_point(X, space_.tabulation(), q).area;
        return area;
    };
    const int k = space_.order();
    for (Edge& e : edges_) {
        double symbol = 0, width = 0, whole = 0;
        for (int s = 0; s < 2; ++s) {
            const CellColumns<3> X = cell_nodes(mesh, e.cell[s]);
            const Tabulation& table = (s == 0 ? left_ : right_)[e.side[s]];
            double along = 0;
            for (int q = 0; q < table.points(); ++q) {
                const SurfacePoint<double> p = curved_point(X, table, q);
                const double x = p.tangent[0].dot(p.B * p.tangent[0]) / p.metric[0];
                const CurvatureJet<double> f = density(bending, p.H, p.K);
                const double length = table.weight[q] * std::sqrt(p.metric[0]);
                symbol += length * (f.HH + 2 * f.HK * x + f.KK * x * x), along += length;
            }
            whole += along, width += 0.5 * along / size_of(e.cell[s]);
        }
        e.penalty = penalty_factor * std::max(symbol / whole, 0.0) * k * (k - 1) / 2.0 * width;
    }
}

// Long: the integrands of all functionals, in the order in which their derivatives need each other.
void DiscreteEnergy::cell_block(const CurvedMesh& mesh, const Directions& d, const Bending& bending,
                                const std::optional<Formula>& potential, double sigma, double lambda,
                                const Eigen::VectorXd& H0, int cell, Block& out) const {
    const bool derive = d.normal.cols() > 0;
    const CellColumns<3> X = cell_nodes(mesh, cell), stretch = stretch_of(X);
    const CellColumns<3> D = derive ? space_.gather<3>(d.normal, cell) : CellColumns<3>();
    const Tabulation& table = space_.tabulation();
    const int n = space_.width() + (derive && d.stretch);
    for (int q = 0; q < table.points(); ++q) {
        const Frame f(X, table, q);
        const Curvatures at = f.curvatures();
        const double weight = table.weight[q], H_0 = at_point(space_, H0, bending, cell, table, q);
        const CurvatureJet<double> F = density_at(bending, H_0, at.H.v, at.K.v);
        const Form energy = chain(at.H, at.K, F.f, F.H, F.K, F.HH, F.HK, F.KK) * at.area, M = at.H * at.area;
        const PointPotential W(potential, f.x);
        out.values.potential += weight * W.value * f.area, out.values.potential_force -= weight * W.slope[2] * f.area;
        out.values.energy += weight * (energy.v + W.value * f.area), out.values.area += weight * f.area,
            out.values.M += weight * M.v;
        const double third = mesh.period > 0 ? 0.5 : 1.0 / 3;  // of a tube: without the ends of its period
        Eigen::Vector3d from = f.x;
        if (mesh.period > 0) from.z() = 0;
        out.values.volume += weight * third * f.area * from.dot(f.normal);
        if (!derive) continue;
        const Change change(f, D, d.stretch ? &stretch : nullptr, table, q);
        const Vector6 slope = gradient(energy);
        out.energy.noalias() += weight * slope.transpose() * change.forms;
        out.area.noalias() += weight * f.area_slope.transpose() * change.tangents;
        out.M.noalias() += weight * gradient(M).transpose() * change.forms;
        Columns3 moved(3, n);  // of the points
        moved.leftCols(space_.width()) = D * table.value.col(q).asDiagonal();
        if (d.stretch) moved.col(n - 1) = stretch * table.value.col(q);
        out.volume.leftCols(space_.width()).noalias() +=
            weight * f.area * f.normal.transpose() * moved.leftCols(space_.width());
        const Row widens = weight * f.area_slope.transpose() * change.tangents, climbs = W.slope.transpose() * moved;
        if (potential) out.energy += W.value * widens + weight * f.area * climbs;
        if (d.stretch) out.volume[n - 1] += weight * 0.5 * (from.dot(f.cross * change.tangents.col(n - 1)));
        if (out.second.size() == 0) continue;
        change.add_second(f, weight * (slope + (sigma + W.value) * gradient(at.area)),
                          weight * (hessian(energy) + (sigma + W.value) * hessian(at.area)), out.second);
        if (potential)
            out.second += weight * f.area * moved.transpose() * W.second * moved + widens.transpose() * climbs +
                          climbs.transpose() * widens;
        const Columns3 turned = f.cross * change.tangents;  // change of t x c
        Square part = weight * lambda * 0.5 * moved.transpose() * turned;
        if (d.stretch) {  // a moving end is no part of the surface: the volume is linear in the stretch
            part.col(n - 1).setZero(), part.row(n - 1).setZero();
            part.row(n - 1).head(n - 1) =
                weight * lambda * (moved.leftCols(n - 1).transpose() * turned.col(n - 1)).transpose();
        }
        out.second += part + part.transpose();
    }
}

// One point of an edge, as the triangles on its left and on its right see it.
struct DiscreteEnergy::EdgePoint {
    Frame frame[2];
    Form moment[2];  // f_H + f_K t.Bt: by how much the energy changes with curvature across the edge
    Corner angle, length;
    double mean, kink;  // of the moments; energy of the penalty

    EdgePoint(const EdgeSides& at, const Bending& bending, const Bending& powers, double penalty, int q)
        : frame{{at.X[0], *at.table[0], q}, {at.X[1], *at.table[1], q}},
          angle(surface3d::angle(frame[0].t, frame[0].c, frame[1].c)),
          length(surface3d::length(frame[0].t)) {
        for (int s = 0; s < 2; ++s) {
            const Curvatures c = frame[s].curvatures();
            const double H0 = at.H0[s].size() > 0 ? at.H0[s].dot(at.table[s]->value.col(q).transpose()) : bending.H0;
            const MomentDerivatives F = moment_derivatives(bending, powers, H0, c.H.v, c.K.v);
            moment[s] = composed(F.by_H, c.H, c.K) + composed(F.by_K, c.H, c.K) * (c.b11 / c.g11);
        }
        mean = 0.5 * (moment[0].v + moment[1].v);
        kink = 0.5 * penalty * angle.v * angle.v;
    }
};

void DiscreteEnergy::edge_block(const CurvedMesh& mesh, const Directions& d, const Bending& bending,
                                const Eigen::VectorXd& H0, const Edge& e, Block& out) const {
    const Bending powers = powers_alone(bending);
    EdgeSides at;
    for (int s = 0; s < 2; ++s) {
        at.X[s] = cell_nodes(mesh, e.cell[s]), at.table[s] = &(s == 0 ? left_ : right_)[e.side[s]];
        if (H0.size() > 0) at.H0[s] = space_.gather(H0, e.cell[s]).transpose();
        if (d.normal.cols() > 0) at.D[s] = space_.gather<3>(d.normal, e.cell[s]);
        if (d.stretch) at.stretch[s] = stretch_of(at.X[s]);
    }
    for (int q = 0; q < left_[0].points(); ++q) {
        const EdgePoint p(at, bending, powers, e.penalty, q);
        const double ds = left_[0].weight[q] * p.length.v;
        out.values.energy += ds * (p.mean * p.angle.v + p.kink);
        out.values.M += ds * p.angle.v, out.values.kinks += ds * p.kink;
        if (d.normal.cols() > 0) add_derivatives(at, p, e.penalty, q, out);
    }
}

// With weight (mean angle + penalty/2 angle^2) length as a function of the two moments, angle and length.
void DiscreteEnergy::add_derivatives(const EdgeSides& at, const EdgePoint& p, double penalty, int q, Block& out) const {
    const int n = space_.width(), stretch = at.stretch[0].cols() > 0, all = 2 * n + stretch;
    const double weight = left_[0].weight[q], ds = p.length.v, angle = p.angle.v;
    const Eigen::RowVector4d slope(weight * ds * 0.5 * angle, weight * ds * 0.5 * angle,
                                   weight * ds * (p.mean + penalty * angle), weight * (p.mean * angle + p.kink));
    Eigen::Matrix<double, 4, Eigen::Dynamic, 0, 4, most_columns> first(4, all);
    Columns9 corner = Columns9::Zero(9, all);  // changes of the tangent along the edge and of those across it
    first.setZero();
    for (int s = 0; s < 2; ++s) {
        const Change change(p.frame[s], at.D[s], stretch ? &at.stretch[s] : nullptr, *at.table[s], q);
        const auto spread = [&](const auto& columns, auto&& into) {
            into.middleCols(s * n, n) = columns.leftCols(n);
            if (stretch) into.col(2 * n) = columns.col(n);
        };
        const Vector6 by_forms = gradient(p.moment[s]);
        spread(by_forms.transpose() * change.forms, first.row(s));
        spread(change.tangents.bottomRows<3>(), corner.middleRows<3>(3 + 3 * s));
        if (s == 0) spread(change.tangents.topRows<3>(), corner.topRows<3>());  // both sides share it
        if (out.second.size() == 0) continue;
        Square own = Square::Zero(n + stretch, n + stretch);
        change.add_second(p.frame[s], slope[s] * by_forms, slope[s] * hessian(p.moment[s]), own);
        out.second.block(s * n, s * n, n, n) += own.topLeftCorner(n, n);
        if (!stretch) continue;
        out.second.col(2 * n).segment(s * n, n) += own.col(n).head(n);
        out.second.row(2 * n).segment(s * n, n) += own.row(n).head(n);
        out.second(2 * n, 2 * n) += own(n, n);
    }
    first.row(2) = gradient(p.angle).transpose() * corner, first.row(3) = gradient(p.length).transpose() * corner;
    Eigen::Matrix4d twice = Eigen::Matrix4d::Zero();
    twice(0, 2) = twice(1, 2) = weight * ds * 0.5, twice(0, 3) = twice(1, 3) = weight * 0.5 * angle;
    twice(2, 3) = weight * (p.mean + penalty * angle);
    twice += twice.transpose().eval();
    twice(2, 2) = weight * penalty * ds;
    out.energy.noalias() += slope * first;
    out.M.noalias() += weight * (ds * first.row(2) + angle * first.row(3));
    if (out.second.size() == 0) return;
    const Eigen::Matrix<double, 4, Eigen::Dynamic, 0, 4, most_columns> twice_first = twice * first;
    const Columns9 corner_part = (slope[2] * hessian(p.angle) + slope[3] * hessian(p.length)) * corner;
    out.second.noalias() += first.transpose() * twice_first;
    out.second.noalias() += corner.transpose() * corner_part;
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
            out.hessian.valuePtr()[slots[i * n + j]] += block.second(j, i);
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
    if (second) out.hessian = pattern_;
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
            const int* slots = is_cell ? &cell_slots_[static_cast<std::size_t>(i) * n * n]
                                       : &edge_slots_[static_cast<std::size_t>(i - cells) * 4 * n * n];
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
            const Frame f(X, table, q);
            const J place[]{J::variable(f.x[0], 0), J::variable(f.x[1], 1), J::variable(f.x[2], 2), J(P)},
                w = evaluate(W, place);
            const Eigen::Vector3d climbs = f.area * Eigen::Vector3d(w.d[0], w.d[1], w.d[2]),
                                  along_t = w.v * f.area_slope.head<3>(), along_c = w.v * f.area_slope.tail<3>();
            for (int a = 0; a < space_.width(); ++a)
                out[space_.node(cell, a)] +=
                    table.weight[q] *
                    D.col(a).dot(table.value(a, q) * climbs + table.d[0](a, q) * along_t + table.d[1](a, q) * along_c);
        }
    }
    return out;
}

Eigen::SparseMatrix<double> DiscreteEnergy::mass(const CurvedMesh& mesh, const Directions& directions) const {
    Eigen::SparseMatrix<double> out = pattern_;
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
        const int* slots = &cell_slots_[static_cast<std::size_t>(cell) * n * n];
        for (int i = 0; i < n * n; ++i) out.valuePtr()[slots[i]] += block.data()[i];
    }
    return out;
}

}  // namespace tubule::surface3d
