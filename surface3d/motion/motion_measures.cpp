#include "surface3d/motion/motion_measures.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/energy/principal_symbol.hpp"
#include "surface3d/motion/axial_force.hpp"

namespace tubule::surface3d {
namespace {

constexpr int n_sums = 17;
using Sums = Eigen::Matrix<double, n_sums, 1>;

Eigen::Vector3d push(const MovingSurface& surface, const MotionFields& fields, const CellColumns<3>& gradient, int cell,
                     int q) {
    const SurfaceSpace& space = surface.space();
    const auto phi = space.tabulation().value.col(q);
    return PointH0(surface.bending(), gather_H0(space, fields.H0, cell), gradient, phi,
                   space.gather(fields.H, cell).dot(phi), space.gather(fields.K, cell).dot(phi))
        .push();
}

// Integrals over the surface: |u|^2, 2|sigma|^2, |grad_P u|^2, (div_P u)^2, |d_t u|^2, u, x cross u, x, |grad p - f_H0
// grad H0 - force|^2, p, power of sources.
Sums integrals(const MovingSurface& surface, const MotionState& s, const CurvedMesh& mesh, const VectorField& u,
               const VectorField& rate, const MotionMeasures& m) {
    const SurfaceSpace& space = surface.space();
    const SurfaceLaw& law = surface.law();
    const Tabulation& table = space.tabulation();
    Eigen::Matrix<double, n_sums, Eigen::Dynamic> of_cell(n_sums, space.cells());
    const bool presses = s.p.size() > 0, slips = presses && !surface.law().flows;
    const bool pushed = slips && m.fields.H0.size() > 0;
    const Eigen::VectorXd pressure = presses ? surface.pressure_at_nodes(s) : Eigen::VectorXd::Zero(mesh.size());
    space.for_each_cell([&](int cell) {
        const CellColumns<3> X = cell_nodes(mesh, cell), U = space.gather(u, cell), A = space.gather(rate, cell);
        const auto nodal_p = space.gather(pressure, cell);
        Sums sum = Sums::Zero();
        for (int q = 0; q < table.points(); ++q) {
            const SurfacePoint<double> p = tangent_point(X, table, q);
            const CellColumns<3> grad = gradients(p, table, q);
            const Eigen::Vector3d v = U * table.value.col(q), a = A * table.value.col(q);
            const Eigen::Matrix3d P = Eigen::Matrix3d::Identity() - p.normal * p.normal.transpose();
            const Eigen::Vector3d along = P.col(2);
            Eigen::Vector3d slip = Eigen::Vector3d::Zero();
            if (slips) slip = grad * nodal_p;
            if (pushed) slip -= push(surface, m.fields, grad, cell, q);
            double power = 0;
            if (law.source.act()) {
                const Eigen::Vector3d force = law.body_force(p.x, s.time);
                slip -= P * force;
                power = force.dot(v) + law.mass_source(p.x, s.time) *
                                           (nodal_p.dot(table.value.col(q)) + law.inertia / 2 * v.squaredNorm());
            }
            const Eigen::Matrix3d G = P * (U * grad.transpose()) + s.stretch * along * along.transpose(),
                                  sigma = (G + G.transpose()) / 2;
            Sums here;
            here << v.squaredNorm(), 2 * sigma.squaredNorm(), G.squaredNorm(), G.trace() * G.trace(), a.squaredNorm(),
                v, p.x.cross(v), p.x, slip.squaredNorm(), nodal_p.dot(table.value.col(q)), power;
            sum += table.weight[q] * p.area * here;
        }
        of_cell.col(cell) = sum;
    });
    return of_cell.rowwise().sum();
}

// Radius and place of the narrowest neck. All nodes of a cell must have the curvature of a neck, as single nodes may be
// inaccurate.
void measure_neck(const CurvedMesh& mesh, MotionMeasures& m) {
    m.neck_radius = std::numeric_limits<double>::infinity();
    for (int cell = 0; cell < mesh.triangles(); ++cell) {
        double hoop = std::numeric_limits<double>::infinity();
        for (int a = 0; a < mesh.nodes_per_cell(); ++a) {
            const double H = m.fields.H[mesh.node(cell, a)], K = m.fields.K[mesh.node(cell, a)];
            hoop = std::min(hoop, K < 0 ? std::sqrt(H * H / 4 - K) - H / 2 : 0);
        }
        if (hoop * m.neck_radius > 1) m.neck_radius = 1 / hoop, m.narrowest = mesh.position(cell, 0);
    }
}

// The smallest principal symbol at a node. The quadratic in x is smallest at one of the principal curvatures or in
// between.
double symbol_at(const MotionFields& fields, const Bending& bending, Eigen::Index i) {
    const double H = fields.H[i], K = fields.K[i], half = std::sqrt(std::max(H * H / 4 - K, 0.0));
    const CurvatureJet<double> f = density_at(bending, fields.H0_at(bending, i), H, K);
    return least_principal_symbol(f, H / 2 - half, H / 2 + half);
}

void measure_symbol(const CurvedMesh& mesh, const Bending& bending, MotionMeasures& m) {
    m.symbol = std::numeric_limits<double>::infinity();
    m.coarse_wave = wave_coarseness(mesh, m.fields, bending);
    for (int i = 0; i < mesh.size() && bending.kg == 0; ++i)
        if (const double least = symbol_at(m.fields, bending, i); !(least >= m.symbol))
            m.symbol = least, m.least_symbol = mesh.nodes[i];
}

void measure_domain(const CurvedMesh& mesh, const Bending& bending, const Sources& source, double time,
                    MotionMeasures& m) {
    SourceDomain of_sources(source);
    for (int i = 0; i < mesh.size() && of_sources.restricted(); ++i) {
        const Eigen::Vector4d at(mesh.nodes[i][0], mesh.nodes[i][1], mesh.nodes[i][2], time);
        of_sources.look({at.data(), 4}, i);
    }
    m.domain = of_sources.margin();
    for (const Potential& p : bending.potentials) {
        if (p.is_wall()) continue;
        FormulaDomain domain(*p.formula);
        for (int i = 0; i < mesh.size() && domain.restricted(); ++i) domain.look({mesh.nodes[i].data(), 3}, i);
        if (const auto margin = domain.margin(); !(margin.value >= m.domain.value)) m.domain = margin;
    }
    if (m.domain.step) m.least_defined = mesh.nodes[static_cast<std::size_t>(m.domain.place)];
    DensityDomain domain(bending);
    if (!domain.restricted()) return;
    for (int i = 0; i < mesh.size(); ++i) domain.look(m.fields.H0_at(bending, i), m.fields.H[i], m.fields.K[i], i);
    if (!(domain.margin().value < m.domain.value)) return;
    m.domain = domain.margin();
    m.least_defined = mesh.nodes[static_cast<std::size_t>(m.domain.place)];
}

}  // namespace

Coarseness wave_coarseness(const CurvedMesh& mesh, const MotionFields& fields, const Bending& bending) {
    if (bending.kg == 0) return {};
    Eigen::VectorXd scale = Eigen::VectorXd::Constant(mesh.size(), HUGE_VAL);
    for (int i = 0; i < mesh.size(); ++i)
        if (const double symbol = symbol_at(fields, bending, i); symbol < 0)
            scale[i] = std::sqrt(-2 * bending.kg / symbol);
    return coarseness(mesh, scale);
}

Smoothness smoothness_of(const CurvedMesh& mesh, const Eigen::VectorXd& values) {
    if (mesh.order != 4) return {};
    // Nodes halfway between two others, in VTK's order: of the triangle, and of its quarters.
    constexpr std::array<std::array<int, 3>, 3> whole{{{4, 0, 1}, {7, 1, 2}, {10, 2, 0}}};
    constexpr std::array<std::array<int, 3>, 9> quarters{
        {{3, 0, 4}, {5, 4, 1}, {6, 1, 7}, {8, 7, 2}, {9, 2, 10}, {11, 10, 0}, {12, 4, 10}, {13, 4, 7}, {14, 7, 10}}};
    double coarse = 0, fine = 0;
    for (int cell = 0; cell < mesh.triangles(); ++cell) {
        const auto misses = [&](const std::array<int, 3>& at) {
            const auto value = [&](int a) { return values[mesh.node(cell, at[a])]; };
            const double miss = value(0) - (value(1) + value(2)) / 2;
            return miss * miss;
        };
        for (const auto& at : whole) coarse += misses(at) / whole.size();
        for (const auto& at : quarters) fine += misses(at) / quarters.size();
    }
    if (fine == 0) return {.order = 2};
    return {std::max(std::log2(coarse / fine) / 2, 0.0),
            std::sqrt(fine / mesh.triangles() * values.size()) / values.norm()};
}

MotionMeasures measure(MovingSurface& surface, const MotionState& s, const MotionState* before) {
    const Bending& bending = surface.bending();
    const SurfaceLaw& law = surface.law();
    const SurfaceSpace& space = surface.space();
    const CurvedMesh mesh = surface.mesh(s);
    MotionMeasures m;
    m.fields = surface.fields(mesh);
    m.bending = observe(space, mesh, {m.fields.normal, {}, m.fields.H, m.fields.K}, bending, m.fields.H0);
    m.velocity = surface.velocity(s, m.fields);
    VectorField rate = VectorField::Zero(3, mesh.size());
    if (law.inertia != 0 && before)
        for (int d = 0; d < 3; ++d)
            rate.row(d) = (s.u - before->u).segment(d * mesh.size(), mesh.size()).transpose() / s.step;
    const Sums sum = integrals(surface, s, mesh, m.velocity, rate, m);
    m.kinetic = law.inertia * sum[0] / 2;
    m.dissipation = law.viscosity * sum[1] + law.friction * sum[0];
    if (!law.flows) {  // without an error of the projection of -grad p
        const Eigen::RowVectorXd load = surface.flux(s.u, mesh, m.fields).transpose();
        m.dissipation = law.friction * load.dot(s.u) + sum[14] / law.friction;
    }
    m.source_power = sum[16];
    m.length = s.period;
    if (law.beads) {
        const BeadNumbers beads = surface.bead_numbers(mesh);
        m.length = BeadEquations::distance(beads);
        m.coarse_bead = bead_coarseness(mesh, beads, law.beads->width);
    }
    m.wall = wall_distance(mesh, bending.potentials), m.coarse_wall = wall_coarseness(mesh, bending.potentials);
    m.free_energy = m.bending.energy + law.potential(s.time, {m.bending.area, m.bending.volume, m.length});
    m.tension = law.area_is_free() ? law.tension.at(s.time) : law.keeps_area ? s.tension : -sum[15] / m.bending.area;
    m.pressure = law.keeps_volume ? -s.lambda : loads_at(law, s.time).pressure_at(m.bending.volume);
    m.pressure_domain = pressure_domain(law, m.bending.volume);
    m.force = law.holds_distance() ? s.force
              : law.free_period || law.beads
                  ? law.force.at(s.time)
                  : axial_force(surface, s, m.fields, m.velocity, m.bending.M, m.tension, m.pressure);
    m.acceleration = law.inertia * sum[4] / 2;
    m.speed = m.velocity.colwise().norm().maxCoeff();
    m.stretching = sum[2] > 0 ? std::sqrt(sum[3] / sum[2]) : 0;
    m.momentum = sum.segment<3>(5), m.angular_momentum = sum.segment<3>(8);
    m.centre = sum.segment<3>(11) / m.bending.area;
    m.r_min = std::numeric_limits<double>::infinity();
    for (const Eigen::Vector3d& x : mesh.nodes) {
        const double r = mesh.period > 0 ? x.head<2>().norm() : (x - m.centre).norm();
        m.r_min = std::min(m.r_min, r), m.r_max = std::max(m.r_max, r);
    }
    const Eigen::RowVectorXd z = s.X.row(2);
    m.height = mesh.period > 0 ? mesh.period : z.maxCoeff() - z.minCoeff();
    m.quality = mesh_quality(mesh);
    m.turn = mesh_turn(mesh, m.quality, m.fields.H, m.fields.K);
    measure_neck(mesh, m);
    measure_symbol(mesh, bending, m);
    measure_domain(mesh, bending, law.source, s.time, m);
    m.smoothness = smoothness_of(mesh, m.fields.H);
    return m;
}

double noise_of_H(const SurfaceSpace& space, const CurvedMesh& mesh, const MotionFields& fields) {
    const Tabulation& table = space.tabulation();
    Eigen::Matrix2Xd of_cell(2, space.cells());
    space.for_each_cell([&](int cell) {
        const CellColumns<3> X = cell_nodes(mesh, cell), normals = space.gather(fields.normal, cell);
        const auto nodal = space.gather(fields.H, cell);
        Eigen::Vector2d sum = Eigen::Vector2d::Zero();
        for (int q = 0; q < table.points(); ++q) {
            const SurfacePoint<double> p = tangent_point(X, table, q);
            const double H = nodal.dot(table.value.col(q));
            const double other = shape_operator(p, gradients(p, table, q), normals).trace();
            sum += table.weight[q] * p.area * Eigen::Vector2d((H - other) * (H - other), H * H);
        }
        of_cell.col(cell) = sum;
    });
    return of_cell.row(0).sum() / of_cell.row(1).sum();
}

}  // namespace tubule::surface3d
