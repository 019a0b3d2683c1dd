#include "surface3d/motion/schemes/paper.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "common/case/surface_choices.hpp"
#include "surface3d/curvature/curvature.hpp"

namespace tubule::surface3d {
namespace {

PaperModuli paper_moduli(const Bending& bending) {
    if (const auto key = bending.alpha ? "energy.alpha" : term_beyond_paper(bending); !key.empty())
        throw std::invalid_argument(fmt::format("the paper's scheme has k20, k40 and k42, no {}", key));
    return {.k20 = bending.k[term_number("k20")],
            .k40 = bending.k[term_number("k40")],
            .k42 = bending.k[term_number("k42")],
            .H0 = bending.H0};
}

SurfaceLaw with_all_components(SurfaceLaw law) {
    law.flows = true;
    return law;
}

using Frame = Eigen::Matrix<double, 3, 2>;
template <int rows>
using OfVelocity = Eigen::Matrix<double, rows, Eigen::Dynamic, rows == 1 ? Eigen::RowMajor : Eigen::ColMajor, rows,
                                 3 * max_cell_nodes>;

// What is known on a cell, one column a node.
struct CellFields {
    CellColumns<3> X, u, transport, normal, grad_K;
    Eigen::Matrix<double, Eigen::Dynamic, 1, 0, max_cell_nodes, 1> H, K;
};

// A quadrature point on the surface of the last step. Tangential vectors and tensors are those of a frame e, e.g. B is
// e^T B e; functions of P_k are the columns of phi and grad, those of v come component by component.
struct Point {
    double dS, H, K;
    Eigen::Vector3d u;
    Frame e;
    Eigen::Matrix2d B;
    Eigen::Vector2d transport, grad_K;
    CellColumns<1> phi, psi;
    CellColumns<2> grad;
    OfVelocity<1> along;        // v.nu
    OfVelocity<2> tilt, slope;  // nu . grad_C v; grad(v.nu)
    OfVelocity<3> strain;       // D(v) as (11, 22, sqrt(2) 12)
};

Point point(const CellFields& here, const Tabulation& table, const Tabulation& pressure, int q) {
    const SurfacePoint<double> p = tangent_point(here.X, table, q);
    const CellColumns<3> gradient = gradients(p, table, q);
    const auto phi = table.value.col(q);
    const int n = static_cast<int>(phi.size());
    const Eigen::Vector3d normal = (here.normal * phi).normalized();
    Point at;
    at.dS = table.weight[q] * p.area;
    at.H = here.H.dot(phi), at.K = here.K.dot(phi);
    at.u = here.u * phi;
    at.e.col(0) = p.tangent[0].normalized();
    at.e.col(1) = p.normal.cross(at.e.col(0));
    const Eigen::Matrix<double, 2, 3> B = at.e.transpose() * shape_operator(p, gradient, here.normal);
    at.B = B * at.e;
    at.transport = at.e.transpose() * (here.transport * phi);
    at.grad_K = at.e.transpose() * (here.grad_K * phi);
    at.phi = phi.transpose();
    at.psi = pressure.value.col(q).transpose();
    at.grad = at.e.transpose() * gradient;
    at.along.resize(1, 3 * n), at.tilt.resize(2, 3 * n), at.slope.resize(2, 3 * n), at.strain.resize(3, 3 * n);
    for (int d = 0; d < 3; ++d) {
        const auto columns = Eigen::seqN(d * n, n);
        const double e1 = at.e(d, 0), e2 = at.e(d, 1);
        at.along(0, columns) = normal[d] * at.phi;
        at.tilt(Eigen::all, columns) = normal[d] * at.grad;
        at.slope(Eigen::all, columns) = normal[d] * at.grad - B.col(d) * at.phi;
        at.strain(0, columns) = e1 * at.grad.row(0);
        at.strain(1, columns) = e2 * at.grad.row(1);
        at.strain(2, columns) = (e1 * at.grad.row(1) + e2 * at.grad.row(0)) / std::sqrt(2.0);
    }
    return at;
}

// T : grad_C v for a tangential tensor T.
OfVelocity<1> contracted(const Point& at, const Eigen::Matrix2d& T) {
    const int n = static_cast<int>(at.phi.size());
    OfVelocity<1> out(1, 3 * n);
    for (int d = 0; d < 3; ++d) out.segment(d * n, n) = at.e.row(d) * T * at.grad;
    return out;
}

// The blocks of a cell: rows and columns of u, Y, H, p.
struct CellSystem {
    int n, u, Y, H, p;  // nodes, first rows
    Eigen::MatrixXd A;
    Eigen::VectorXd b, flux;

    explicit CellSystem(int nodes, int width)
        : n(nodes),
          u(0),
          Y(3 * n),
          H(6 * n),
          p(7 * n),
          A(Eigen::MatrixXd::Zero(width, width)),
          b(Eigen::VectorXd::Zero(width)),
          flux(Eigen::VectorXd::Zero(width)) {}
    auto rows_of_v() { return b.head(3 * n); }
    auto block(int row, int column, int height, int width) { return A.block(row, column, height, width); }
};

// (u - u_old, v)/tau + (grad_w u, v) + gamma (u, v), each component alike
void add_inertia(const Point& at, const SurfaceLaw& law, double tau, CellSystem& s) {
    const double rate = law.inertia / tau;
    const CellColumns<1> acting = (rate + law.friction) * at.phi + law.inertia * at.transport.transpose() * at.grad;
    const CellMatrix block = at.dS * at.phi.transpose() * acting;
    for (int d = 0; d < 3; ++d) {
        s.block(d * s.n, d * s.n, s.n, s.n) += block;
        s.b.segment(d * s.n, s.n) += (rate * at.dS * at.u[d]) * at.phi.transpose();
    }
}

// (2/Re) (D(u), grad_P v)
void add_viscosity(const Point& at, const SurfaceLaw& law, CellSystem& s) {
    if (law.viscosity == 0) return;
    s.block(s.u, s.u, 3 * s.n, 3 * s.n).noalias() += (2 * law.viscosity * at.dS) * at.strain.transpose() * at.strain;
}

// -(p, div_P v) and -(div_P u, q)
void add_pressure(const Point& at, CellSystem& s) {
    const int n_p = static_cast<int>(at.psi.size());
    const Eigen::MatrixXd block = -at.dS * contracted(at, Eigen::Matrix2d::Identity()).transpose() * at.psi;
    s.block(s.u, s.p, 3 * s.n, n_p) += block;
    s.block(s.p, s.u, n_p, 3 * s.n) += block.transpose();
}

// -(2 k20 grad H, grad(v.nu)) + (2 k20 (H - H0) (|B|^2 - tr B (tr B - H0)/2) nu, v)
void add_k20(const Point& at, const PaperModuli& m, CellSystem& s) {
    const double tr = at.B.trace(), factor = 2 * m.k20 * (at.B.squaredNorm() - tr * (tr - m.H0) / 2) * at.dS;
    auto block = s.block(s.u, s.H, 3 * s.n, s.n);
    block.noalias() -= (2 * m.k20 * at.dS) * at.slope.transpose() * at.grad;
    block.noalias() += factor * at.along.transpose() * at.phi;
    s.rows_of_v() += factor * m.H0 * at.along.transpose();
}

// -(k40 (H - H0) (H_old - H0)^2 (4 B - (H_old - H0) P), grad_C v) - (12 k40 (H_old - H0)^2 nu x grad H, grad_C v)
void add_k40(const Point& at, const PaperModuli& m, CellSystem& s) {
    if (m.k40 == 0) return;
    const double h = at.H - m.H0, factor = m.k40 * h * h * at.dS;
    const OfVelocity<1> stress = contracted(at, 4 * at.B - h * Eigen::Matrix2d::Identity());
    auto block = s.block(s.u, s.H, 3 * s.n, s.n);
    block.noalias() -= factor * stress.transpose() * at.phi;
    block.noalias() -= (12 * factor) * at.tilt.transpose() * at.grad;
    s.rows_of_v() -= factor * m.H0 * stress.transpose();
}

// -(2 k42 H nu x grad K_old, grad_C v) + (2 k42 nu x B grad K_old, grad_C v) - (k42 K_old^2 P, grad_C v)
void add_k42(const Point& at, const PaperModuli& m, CellSystem& s) {
    if (m.k42 == 0) return;
    const double factor = 2 * m.k42 * at.dS;
    s.block(s.u, s.H, 3 * s.n, s.n).noalias() -= factor * (at.tilt.transpose() * at.grad_K) * at.phi;
    s.rows_of_v() -= factor * at.tilt.transpose() * (at.B * at.grad_K);
    s.rows_of_v() += (m.k42 * at.K * at.K * at.dS) * contracted(at, Eigen::Matrix2d::Identity()).transpose();
}

// (Y.nu, phi) - tau (u.nu, phi) = 0 and (H nu, Z) + (grad Y, grad Z) = -(grad X, grad Z)
void add_mesh_motion(const Point& at, double tau, const CellColumns<3>& X, CellSystem& s) {
    const Eigen::MatrixXd normal = at.dS * at.along.transpose() * at.phi;
    const CellMatrix stiffness = at.dS * at.grad.transpose() * at.grad;
    const CellColumns<3> pull = X * stiffness;
    s.block(s.Y, s.H, 3 * s.n, s.n) += normal;
    s.block(s.H, s.Y, s.n, 3 * s.n) += normal.transpose();
    s.block(s.H, s.u, s.n, 3 * s.n) -= tau * normal.transpose();
    for (int d = 0; d < 3; ++d) {
        s.block(s.Y + d * s.n, s.Y + d * s.n, s.n, s.n) += stiffness;
        s.b.segment(s.Y + d * s.n, s.n) -= pull.row(d).transpose();
    }
}

}  // namespace

Paper::Paper(const CurvedMesh& mesh, const SurfaceLaw& law, const Bending& bending, const MotionControl& control)
    : TimeScheme(mesh, with_all_components(law), bending, control),
      moduli_(paper_moduli(bending)),
      unknowns_(mesh),
      pressure_(surface().space().tabulation(mesh.order - 1)),
      A_(unknowns_.pattern()),
      solver_(nested_dissection(unknowns_.pattern(), unknowns_.node_of_unknown())) {
    if (!law.inextensible)
        throw std::invalid_argument("the paper's scheme has fluid, stokes and overdamped, no gradient flow");
    if (law.inertia == 0 && law.friction == 0)
        throw std::invalid_argument("the paper's scheme needs gamma > 0 for stokes: rigid motions are undetermined");
    if (law.reservoir || law.free_period || !law.without_loads())
        throw std::invalid_argument("the paper's scheme has no reservoir, free period, tension, pressure or force");
    if (!(control.smoothing >= 0))
        throw std::invalid_argument(
            fmt::format("the smoothing parameter eps of curvatures must be >= 0, not {:g}", control.smoothing));
}

PaperFields Paper::fields(const CurvedMesh& mesh) {
    MotionFields raw = surface().fields(mesh);
    CurvatureField field{std::move(raw.normal), {}, std::move(raw.H), std::move(raw.K)};
    VectorField grad_K = smooth(surface().space(), mesh, surface().control().smoothing, field).K;
    return {std::move(field.normal), std::move(grad_K), std::move(field.H), std::move(field.K)};
}

void Paper::assemble(const MotionState& from, double tau) {
    std::fill_n(A_.valuePtr(), A_.nonZeros(), 0.0);
    b_.setZero(unknowns_.size());
    flux_.setZero(unknowns_.size());
    const SurfaceSpace& space = surface().space();
    const CurvedMesh at = surface().mesh(from);
    const PaperFields nodal = fields(at);
    const int n = space.width();
    VectorField u_old(3, space.size());
    for (int d = 0; d < 3; ++d) u_old.row(d) = from.u.segment(d * space.size(), space.size());
    const VectorField transport = u_old - from.w;
    space.for_each_cell([&](int cell) {
        const CellFields here{cell_nodes(at, cell),
                              space.gather(u_old, cell),
                              space.gather(transport, cell),
                              space.gather(nodal.normal, cell),
                              space.gather(nodal.grad_K, cell),
                              space.gather(nodal.H, cell),
                              space.gather(nodal.K, cell)};
        CellSystem s(n, unknowns_.width());
        for (int q = 0; q < space.tabulation().points(); ++q) {
            const Point p = point(here, space.tabulation(), pressure_, q);
            add_inertia(p, surface().law(), tau, s);
            add_viscosity(p, surface().law(), s);
            add_pressure(p, s);
            add_k20(p, moduli_, s);
            add_k40(p, moduli_, s);
            add_k42(p, moduli_, s);
            add_mesh_motion(p, tau, here.X, s);
            s.flux.head(3 * n) += p.dS * p.along.transpose();
        }
        unknowns_.add(A_, cell, s.A);
        const int* numbers = unknowns_.of_cell(cell);
        for (int i = 0; i < unknowns_.width(); ++i) b_[numbers[i]] += s.b[i], flux_[numbers[i]] += s.flux[i];
    });
}

MotionStep Paper::step(const MotionState& from, double tau) {
    assemble(from, tau);
    solver_.factor(A_);
    Eigen::MatrixXd rhs(b_.size(), 2);
    rhs << b_, flux_;
    const Eigen::MatrixXd both = solver_.solve(rhs, 1);
    const int n = surface().nodes();
    MotionStep out;
    MotionState& to = out.state;
    // INT u.nu is linear in lambda, so that the paper's Newton iteration ends after one step.
    if (surface().law().keeps_volume) to.lambda = flux_.dot(both.col(0)) / flux_.dot(both.col(1));
    const Eigen::VectorXd x = both.col(0) - to.lambda * both.col(1);
    to.time = from.time + tau, to.step = tau;
    to.period = from.period;
    to.u = x.head(unknowns_.Y);
    to.p = x.tail(unknowns_.size() - unknowns_.p);
    to.w.resize(3, n);
    for (int d = 0; d < 3; ++d) to.w.row(d) = x.segment(unknowns_.Y + d * n, n) / tau;
    to.X = from.X + tau * to.w;
    return out;
}

template <>
SchemeType scheme_type<scheme_named("paper")>() {
    return scheme_type_of<Paper>();
}

}  // namespace tubule::surface3d
