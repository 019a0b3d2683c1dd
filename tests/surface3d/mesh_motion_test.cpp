// How nodes move: with the surface, and along it with the least deformation of the mesh.
#include "surface3d/motion/mesh_motion.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "common/solve/dense.hpp"
#include "motion.hpp"
#include "surface3d/meshing/graded_mesh.hpp"
#include "surface3d/meshing/remesh.hpp"

namespace tubule::surface3d::mesh_motion_test {

const Sphere waved{.radius = 1.0, .modes = {{.amplitude = 0.2, .l = 2, .m = 1}, {.amplitude = 0.1, .l = 3, .m = 2}}};

// What a motion is found from, on a surface at hand.
struct Scene {
    explicit Scene(const CurvedMesh& mesh)
        : mesh(mesh), space(mesh), project(space, mesh), fields(motion_fields(space, mesh, project)) {}

    // (v.nu, phi).
    Eigen::VectorXd flux(const VectorField& v) const {
        return load<1>(space, mesh,
                       [&](int cell, const CellColumns<3>& X, int q, CellColumns<1>& sum) {
                           const auto phi = space.tabulation().value.col(q);
                           const double dS =
                               space.tabulation().weight[q] * tangent_point(X, space.tabulation(), q).area;
                           const double speed =
                               (space.gather(fields.normal, cell) * phi).normalized().dot(space.gather(v, cell) * phi);
                           sum += dS * speed * phi.transpose();
                       })
            .transpose();
    }
    VectorField motion(const Eigen::VectorXd& of_flux, bool graded, double relaxation) const {
        return MeshMotion(graded).velocity(space, mesh, fields, project, of_flux, relaxation);
    }

    CurvedMesh mesh;
    SurfaceSpace space;
    Projection project;
    MotionFields fields;
};

TEST(MeshMotion, FollowsATranslation) {
    // Nothing deforms the mesh less than a translation, which has the flux of itself.
    const Scene scene(mesh_of(waved, icosphere(3), 4));
    VectorField e(3, scene.space.size());
    e.colwise() = Eigen::Vector3d(0.6, -0.3, 0.7);
    const VectorField w = scene.motion(scene.flux(e), false, 1e9);
    EXPECT_LT((w - e).cwiseAbs().maxCoeff(), 1e-8);
}

TEST(MeshMotion, IsTheSolutionOfTheSaddlePoint) {
    // All unknowns at once, by dense LU factors; what differs are nodal tangents for weak ones, O(h^k) of what moves.
    const Scene scene(mesh_of(waved, icosphere(2), 3));
    const int n = scene.space.size();
    VectorField v(3, n);
    for (int i = 0; i < n; ++i) v.col(i) = scene.mesh.nodes[i].x() * Eigen::Vector3d(0.3, 1.0, 0.2);
    const Eigen::VectorXd flux = scene.flux(v);
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(4 * n, 4 * n);
    const Eigen::MatrixXd L = stiffness_matrix(scene.space, scene.mesh);
    Eigen::VectorXd b(4 * n);
    for (int d = 0; d < 3; ++d) {
        A.block(d * n, d * n, n, n) = L;
        VectorField unit = VectorField::Zero(3, n);
        for (int i = 0; i < n; ++i) {  // (nu_d phi_i, phi): the flux of one node's unit velocity
            unit(d, i) = 1;
            A.block(3 * n, d * n + i, n, 1) = scene.flux(unit);
            unit(d, i) = 0;
        }
        A.block(d * n, 3 * n, n, n) = A.block(3 * n, d * n, n, n).transpose();
        b.segment(d * n, n) = -L * node_positions(scene.mesh).row(d).transpose() / 0.1;
    }
    b.tail(n) = flux;
    const Eigen::VectorXd x = solve_dense(A, b);
    const VectorField exact = x.head(3 * n).reshaped(n, 3).transpose(), w = scene.motion(flux, false, 0.1);
    EXPECT_LT((w - exact).norm(), 1e-2 * exact.norm());
    EXPECT_LT((scene.flux(w) - flux).norm(), 1e-3 * flux.norm());
}

TEST(MeshMotion, DoesNotRunAlongAStraightTube) {
    // A tube that has grown until its rings of triangles were long and thin, meshed anew, and noise of speeds up to 1
    // across it, as the first steps on a new mesh have it. No node needs to move along the tube faster than that. But
    // only the error of the normals resists a motion of the whole mesh along it, and what drives it is such an error,
    // too: it had speeds of 7, 78 and 1967 for k = 2, 3, 4, and runs blew up.
    std::mt19937 random(1);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (int order = 2; order <= 4; ++order) {
        const auto anew = remesh(tube_mesh({.radius = 7.1, .length = 2, .modes = {}}, 4, 10, order), {}, {});
        const Scene scene(std::get<Remeshed>(anew).mesh);
        VectorField v = scene.fields.normal;
        for (int i = 0; i < v.cols(); ++i) v.col(i) *= uniform(random);
        const VectorField w = scene.motion(scene.flux(v), false, 1);
        EXPECT_LT(w.row(2).cwiseAbs().maxCoeff(), 1) << order;
        EXPECT_NEAR(w.row(2).mean(), 0, 1e-2) << order;
    }
}

TEST(MeshMotion, ForgetsHowNodesMovedAlongTheSurface) {
    // A tube whose mesh turned by an angle in the last step. Nothing turns it on: w = 0 around the axis, so that by the
    // formula of the steps, X = (4 X - X_past)/3, each turns a third as far as the one before. With the pull of Xbar
    // each turned as far, as relaxation is short here.
    Motion motion(tube_mesh({.radius = 1, .length = 1, .modes = {}}, 2, 12, 3), {}, {.k = {1, 0, 0}, .H0 = 0},
                  {.relaxation = 1e-8});
    const double tau = 1e-4, angle = 1e-2;
    const VectorField start = motion.state.X;
    const Eigen::VectorXd u = motion.state.u;
    motion.steps(tau, 1);
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    MotionState& s = motion.state;
    const VectorField past = turn.transpose() * start;
    s.w = (s.X - past) / tau;
    Record record;
    record.kind = RecordKind::surface;
    record.numbers = {{"restart_period_past", 1}, {"restart_stretch_past", 0}};
    record.arrays = {array("restart_X_past", past), array("restart_w_past", s.w), array("restart_u_past", u)};
    s.memory = restored_memory(scheme_named("bdf2"), RecordReader(record, RecordKind::surface), s);
    motion.steps(tau, 2);
    const VectorField before = s.X;
    motion.steps(tau, 1);
    const VectorField step = s.X - before;
    EXPECT_LT(step.cwiseAbs().maxCoeff(), 1.2 * angle / 27 + 5 * tau);  // the radius grows with speed 1
}

// The deep neck of cases/pinch_off.toml.
Motion deep_neck(const Tube& tube, bool graded, bool follow) {
    const Curve profile = meridian(base(tube));
    const auto map = [&](const auto& p) { return position(tube, p); };
    const Resolution resolution = resolution_of(map, profile, 4);
    const TriangleMesh base = (graded ? graded_rings : uniform_rings)(resolution, profile, 128);
    MotionControl control;
    control.relaxation = 0.03;
    control.follow_curvature = follow;
    return {mesh_of(tube, base, 4), {}, {.k = {0.2, 0, 0}, .H0 = -2}, control};
}

// Mean width of the triangles within .2 of the neck's plane (z = length/2) over that of those as near to the belly's.
double neck_over_belly(const CurvedMesh& mesh) {
    double area[2] = {0, 0};
    int count[2] = {0, 0};
    const SurfaceSpace space(mesh);
    const Tabulation& table = space.tabulation();
    for (int cell = 0; cell < space.cells(); ++cell) {
        const CellColumns<3> X = cell_nodes(mesh, cell);
        const double from_belly = std::abs(std::remainder(X.row(2).mean(), mesh.period));
        if (from_belly > 0.2 && from_belly < mesh.period / 2 - 0.2) continue;
        const int where = from_belly < 0.2;
        ++count[where];
        for (int q = 0; q < table.points(); ++q) area[where] += table.weight[q] * tangent_point(X, table, q).area;
    }
    return std::sqrt(area[0] / count[0] / (area[1] / count[1]));
}

TEST(MeshMotion, FollowsTheCurvatureOfANeck) {
    const Tube tube{.radius = 1, .length = 2, .modes = {{.amplitude = 0.6, .n = 1}}};
    struct End {
        double ratio, turn, error;
    };
    const auto end_of = [&](bool graded, bool follow) {
        Motion motion = deep_neck(tube, graded, follow);
        double tau = 1e-6;
        for (double rest = 0.012; rest > 1e-12; rest -= tau) {
            tau = std::min({1.5 * tau, 1e-3, rest});
            motion.steps(tau, 1);
        }
        const MotionMeasures m = motion.measures();
        return End{neck_over_belly(motion.mesh()), m.turn.angle,
                   std::abs(m.bending.energy - 6.021027328665864)};  // tier axisym, asked for 1e-7
    };
    const End even = end_of(false, false), followed = end_of(true, true), left = end_of(true, false);
    EXPECT_LT(followed.ratio, 0.9 * left.ratio);
    EXPECT_LT(followed.turn, 0.95 * left.turn);
    EXPECT_LT(followed.error, 0.5 * even.error);
    EXPECT_LT(left.error, 0.5 * even.error);  // grading is not undone either
}

}  // namespace tubule::surface3d::mesh_motion_test
