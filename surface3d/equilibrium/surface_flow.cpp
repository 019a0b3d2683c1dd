#include "surface3d/equilibrium/surface_flow.hpp"

#include <algorithm>
#include <vector>

#include "common/solve/dense.hpp"
#include "surface3d/motion/motion_forms.hpp"

namespace tubule::surface3d {
namespace {

using Sparse = Eigen::SparseMatrix<double>;
using Triplets = std::vector<Eigen::Triplet<double>>;

// Velocities along x, y, z of those along the normal and two tangents of the nodes; the pressure as it is.
Sparse turned_at_nodes(const VectorField& normal, int unknowns) {
    const int n = static_cast<int>(normal.cols());
    Triplets entries;
    for (int i = 0; i < n; ++i) {
        Eigen::Matrix3d axes;
        axes.col(0) = normal.col(i);
        axes.col(1) = normal.col(i).unitOrthogonal();
        axes.col(2) = axes.col(0).cross(axes.col(1));
        for (int d = 0; d < 3; ++d)
            for (int k = 0; k < 3; ++k) entries.emplace_back(d * n + i, k * n + i, axes(d, k));
    }
    for (int i = 3 * n; i < unknowns; ++i) entries.emplace_back(i, i, 1);
    Sparse out(unknowns, unknowns);
    out.setFromTriplets(entries.begin(), entries.end());
    return out;
}

// For velocities along x, y, z, zeros for the other unknowns: a stretch has neither mass nor friction, theory.md
// (3.19).
Sparse mass_of_velocities(const SurfaceSpace& space, const CurvedMesh& mesh, int unknowns) {
    const Sparse mass = mass_matrix(space, mesh);
    const int n = mesh.size();
    Triplets entries;
    for (int d = 0; d < 3; ++d)
        for (int j = 0; j < n; ++j)
            for (Sparse::InnerIterator it(mass, j); it; ++it)
                entries.emplace_back(d * n + it.row(), d * n + j, it.value());
    Sparse out(unknowns, unknowns);
    out.setFromTriplets(entries.begin(), entries.end());
    return out;
}

// A basis of what the columns span, but for parts smaller than `least`.
Eigen::MatrixXd orthonormal_basis(const Eigen::MatrixXd& columns, double least) {
    if (columns.cols() == 0) return columns;
    const Eigenpairs gram = eigenpairs(columns.transpose() * columns, true);
    const Eigen::Index some = (gram.values.array() > least * least * gram.values.maxCoeff()).count();
    return columns * gram.vectors.rightCols(some) * gram.values.tail(some).cwiseSqrt().cwiseInverse().asDiagonal();
}

// Those of the columns that cost little, as rigid motions do: up to 100 times the stiffness on 320 triangles. A turn
// about an axis of symmetry has a normal part by the error of the mesh alone, which costs what its shortest waves do:
// 7e6 times the stiffness.
Eigen::MatrixXd cheap_ones(const Eigen::MatrixXd& columns, const ConstrainedForm& A, double stiffness) {
    Eigen::MatrixXd out(columns.rows(), 0);
    for (const auto& q : columns.colwise()) {
        const double cost = q.dot(A.form * q) + (A.low_rank.transpose() * q).cwiseAbs2().dot(A.weights);
        if (!(std::abs(cost) < 1e4 * stiffness * q.dot(A.mass * q))) continue;
        out.conservativeResize(Eigen::NoChange, out.cols() + 1);
        out.rightCols(1) = q;
    }
    return out;
}

// A without what it says of the orthonormal columns Q, which cost nothing up to the error of the mesh: exactly now.
ConstrainedForm without(ConstrainedForm A, const Eigen::MatrixXd& Q) {
    A.constraints -= Q * (Q.transpose() * A.constraints);
    A.low_rank -= Q * (Q.transpose() * A.low_rank);
    const Eigen::Index r = Q.cols(), l = A.low_rank.cols();
    if (r == 0) return A;
    Eigen::MatrixXd image = A.form * Q;
    image -= Q * (Q.transpose() * image) / 2;
    const Eigen::VectorXd scale = image.colwise().norm().cwiseMax(1e-300).cwiseSqrt();
    const Eigen::MatrixXd q = Q * scale.asDiagonal(), g = image * scale.cwiseInverse().asDiagonal();
    A.low_rank.conservativeResize(Q.rows(), l + 2 * r), A.weights.conservativeResize(l + 2 * r);
    A.low_rank.rightCols(2 * r) << q + g, q - g;
    A.weights.tail(2 * r) << Eigen::VectorXd::Constant(r, -0.5), Eigen::VectorXd::Constant(r, 0.5);
    return A;
}

// [D, B^T; B, 0] with a column of a stretch, and INT q of the pressures q.
struct Drag {
    Sparse matrix;
    Eigen::VectorXd column, mean;
    double own = 0;
    int velocities;
    std::vector<int> node_of_unknown;
};

// Taylor-Hood elements, theory.md (10.5): velocities along the normal and two tangents of the nodes.
Drag viscous_drag(const SurfaceSpace& space, const CurvedMesh& mesh, const VectorField& normal, const MotionLaw& law,
                  bool stretch) {
    const int n = mesh.size();
    const SurfaceLaw flow(MotionLaw{.viscosity = law.viscosity, .friction = law.friction, .free_period = stretch});
    const MotionUnknowns unknowns(mesh, flow, Bending{});
    const StepBase base{.mesh = &mesh,
                        .fields = {normal, Eigen::VectorXd::Zero(n), Eigen::VectorXd::Zero(n)},
                        .displacement = VectorField::Zero(3, n),
                        .mesh_velocity = VectorField::Zero(3, n),
                        .velocity = Eigen::VectorXd::Zero(3 * n),
                        .past = Eigen::VectorXd::Zero(3 * n),
                        .te = 1};
    StepSystem system;
    assemble(space, unknowns, flow, Bending{}, base, system);
    const Sparse turn = turned_at_nodes(normal, unknowns.size());
    Drag out{turn.transpose() * system.A * turn, {}, system.pressure_load, system.stretch.own, 3 * n,
             unknowns.node_of_unknown()};
    if (stretch) out.column = turn.transpose() * system.stretch.column;
    return out;
}

// Where friction alone resists, u = w n - grad p/friction: theory.md (10.5) with p of the order of the surface.
Drag frictional_drag(const SurfaceSpace& space, const CurvedMesh& mesh, const VectorField& normal, double friction,
                     bool stretch) {
    const int n = mesh.size();
    const Sparse mass = friction * mass_matrix(space, mesh), slopes = stiffness_matrix(space, mesh) / -friction;
    Sparse divergence = space.pattern();  // of the velocity n_a phi_a, a column each, times -q
    std::fill_n(divergence.valuePtr(), divergence.nonZeros(), 0.0);
    Drag out{Sparse(2 * n, 2 * n), Eigen::VectorXd::Zero(2 * n), Eigen::VectorXd::Zero(2 * n), 0, n, {}};
    const Tabulation& table = space.tabulation();
    space.for_each_cell([&](int cell) {
        const CellColumns<3> X = cell_nodes(mesh, cell), normals = space.gather(normal, cell);
        CellMatrix block = CellMatrix::Zero(space.width(), space.width());
        for (int q = 0; q < table.points(); ++q) {
            const SurfacePoint<double> p = tangent_point(X, table, q);
            const auto phi = table.value.col(q);
            const double dS = table.weight[q] * p.area;
            block -= dS * phi * gradients(p, table, q).cwiseProduct(normals).colwise().sum();
            for (int a = 0; a < space.width(); ++a) {
                out.mean[n + space.node(cell, a)] += dS * phi[a];
                out.column[n + space.node(cell, a)] -= dS * phi[a] * (1 - p.normal.z() * p.normal.z());
            }
        }
        space.add(divergence, cell, block);
    });
    Triplets entries;
    const auto add = [&](const Sparse& M, int row, int column, bool transposed) {
        for (int j = 0; j < M.outerSize(); ++j)
            for (Sparse::InnerIterator it(M, j); it; ++it)
                transposed ? entries.emplace_back(row + j, column + it.row(), it.value())
                           : entries.emplace_back(row + it.row(), column + j, it.value());
    };
    add(mass, 0, 0, false), add(divergence, n, 0, false), add(divergence, 0, n, true), add(slopes, n, n, false);
    out.matrix.setFromTriplets(entries.begin(), entries.end());
    for (int i = 0; i < 2 * n; ++i) out.node_of_unknown.push_back(i % n);
    if (!stretch) out.column.resize(0);
    return out;
}

// `second_variation` of w and a stretch in the place that they have among all unknowns.
Sparse placed(const Sparse& M, int nodes, int all) {
    const auto place = [&](Eigen::Index i) { return static_cast<int>(i < nodes ? i : all - 1); };
    Triplets entries;
    for (int j = 0; j < M.outerSize(); ++j)
        for (Sparse::InnerIterator it(M, j); it; ++it) entries.emplace_back(place(it.row()), place(j), it.value());
    Sparse out(all, all);
    out.setFromTriplets(entries.begin(), entries.end());
    return out;
}
Eigen::MatrixXd placed(const Eigen::MatrixXd& columns, int nodes, int all) {
    Eigen::MatrixXd out = Eigen::MatrixXd::Zero(all, columns.cols());
    out.topRows(nodes) = columns.topRows(nodes);
    if (columns.rows() > nodes) out.bottomRows(1) = columns.bottomRows(1);
    return out;
}

// With the row and the column of a stretch, if there is one.
Sparse bordered(const Drag& drag) {
    if (drag.column.size() == 0) return drag.matrix;
    const int n = static_cast<int>(drag.matrix.rows());
    Triplets entries;
    for (int j = 0; j < n; ++j) {
        for (Sparse::InnerIterator it(drag.matrix, j); it; ++it) entries.emplace_back(it.row(), j, it.value());
        entries.emplace_back(n, j, drag.column[j]), entries.emplace_back(j, n, drag.column[j]);
    }
    entries.emplace_back(n, n, drag.own);
    Sparse out(n + 1, n + 1);
    out.setFromTriplets(entries.begin(), entries.end());
    return out;
}

}  // namespace

FlowForm flow_form(const ConstrainedForm& second_variation, const SurfaceSpace& space, const CurvedMesh& mesh,
                   const VectorField& normal, const MotionLaw& law, const Eigen::MatrixXd& rigid, double stiffness) {
    const int n = mesh.size(), stretch = static_cast<int>(second_variation.form.rows()) - n;
    const bool viscous = law.viscosity != 0;
    const Drag drag = viscous ? viscous_drag(space, mesh, normal, law, stretch > 0)
                              : frictional_drag(space, mesh, normal, law.friction, stretch > 0);
    const int fields = static_cast<int>(drag.matrix.rows()), all = fields + stretch;
    const Sparse turn = turned_at_nodes(normal, 3 * n);
    FlowForm out;
    out.nodes = n, out.size = n + stretch;
    out.none = Eigen::MatrixXd::Zero(n + stretch, rigid.cols());
    out.none.topRows(n) = (turn.transpose() * rigid).topRows(n);
    out.none = cheap_ones(orthonormal_basis(out.none, 2e-3), second_variation, stiffness);
    const ConstrainedForm A = without(second_variation, out.none);
    out.form.form = placed(A.form, n, all), out.form.mass = bordered(drag);
    out.form.low_rank = placed(A.low_rank, n, all), out.form.weights = A.weights;

    out.held = A.constraints.cols(), out.multipliers = fields - drag.velocities - 1;
    const Eigen::Index still = viscous ? rigid.cols() : 0;  // without friction nothing else stops these
    out.form.constraints = Eigen::MatrixXd::Zero(all, out.held + still + 1);
    out.form.constraints.leftCols(out.held) = placed(A.constraints, n, all);
    if (viscous) {
        const Sparse mass = mass_of_velocities(space, mesh, all);
        const Sparse turned = turned_at_nodes(normal, all);
        if (law.inertia != 0) out.inertia = law.inertia * (turned.transpose() * mass * turned);
        out.form.constraints.middleCols(out.held, still) = turned.transpose() * (mass.leftCols(3 * n) * rigid);
    }
    // A mean of p would repeat the constraint of the area, if there is one.
    out.form.constraints.rightCols(1).topRows(fields) = drag.mean;

    const Sparse both = out.form.form + out.form.mass;
    out.ordering = nested_dissection(Sparse(both.topLeftCorner(fields, fields)), drag.node_of_unknown);
    if (stretch > 0) out.ordering.push_back(all - 1);
    return out;
}

}  // namespace tubule::surface3d
