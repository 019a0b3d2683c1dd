// A spontaneous curvature that goes with the points of a surface: its force, and runs against the shape equations.
#include <gtest/gtest.h>

#include <cmath>

#include "common/geometry/profile_point.hpp"
#include "common/shapes/sphere.hpp"
#include "surface3d/curvature/bending_force.hpp"
#include "surface3d/fem/projection.hpp"
#include "surface3d/mesh/base_meshes.hpp"
#include "surface3d/mesh/mapped_mesh.hpp"
#include "surface3d/motion/motion_forms.hpp"
#include "tests/support/message_of.hpp"
#include "tests/support/profile_points.hpp"
#include "tests/surface3d/run_case.hpp"
#include "tests/surface3d/smooth_field.hpp"

namespace tubule::surface3d::varying_H0_test {

constexpr double step = 1e-3;

CurvedMesh mesh_of(const Sphere& shape, int n, int order) {
    return mapped_mesh(icosphere(n), order, [&](const auto& p) { return position(shape, p); });
}

Eigen::VectorXd H0_on(const CurvedMesh& mesh) {
    Eigen::VectorXd out(mesh.size());
    for (int i = 0; i < mesh.size(); ++i) out[i] = -1 + 0.6 * std::sin(mesh.nodes[i].z() + 0.5 * mesh.nodes[i].x());
    return out;
}

MotionFields fields_of(const CurvedMesh& mesh, const Eigen::VectorXd& H0) {
    const SurfaceSpace space(mesh);
    MotionFields out = motion_fields(space, mesh, Projection(space, mesh));
    out.H0 = H0;
    return out;
}

// (b nu + f_H0 grad H0, v) of a fluid at rest.
double power(const CurvedMesh& mesh, const Eigen::VectorXd& H0, const Bending& bending, const VectorField& v) {
    const SurfaceLaw law = motion_law({.kind = ModelKind::fluid, .Re = 2, .gamma = 0.5, .keeps_volume = {}});
    const SurfaceSpace space(mesh);
    const MotionUnknowns unknowns(mesh, law, bending);
    StepBase base;
    base.mesh = &mesh, base.fields = fields_of(mesh, H0), base.te = 1;
    base.displacement = base.mesh_velocity = VectorField::Zero(3, mesh.size());
    base.velocity = base.past = Eigen::VectorXd::Zero(3 * mesh.size());
    StepSystem system;
    assemble(space, unknowns, law, bending, base, system);
    return system.force.head(3 * mesh.size()).dot(Eigen::MatrixXd(v.transpose()).reshaped());
}

double energy_after(CurvedMesh mesh, const Eigen::VectorXd& H0, const Bending& bending, const VectorField& by) {
    for (int i = 0; i < mesh.size(); ++i) mesh.nodes[i] += by.col(i);
    const MotionFields f = fields_of(mesh, H0);
    return observe(SurfaceSpace(mesh), mesh, {f.normal, {}, f.H, f.K}, bending, H0).energy;
}

Bending all_terms() {
    Bending out{.k = {1, 0.1, 1}, .H0 = 0};
    out.terms.push_back({.modulus = 0.3, .H = 1, .K = 1});
    out.terms.push_back(
        {.modulus = 0.1, .formula = std::make_shared<const Formula>(parse_formula("H*H0^2", EnergyTerm::variables))});
    return out;
}

TEST(VaryingH0, theForceApproachesTheRateOfTheEnergyOfMaterialNodes) {
    // theory.md (2.18): the power of the force is minus the rate of E where H0 goes with the nodes, up to the error of
    // the fields. Without the force along the surface, or the slope of H0 in that along the normal, a part would stay.
    const Bending bending = all_terms();
    const Sphere wavy{.radius = 1, .modes = {{0.15, 2, 1}, {0.1, 3, 2}}};
    const auto gap = [&](int n) {
        const CurvedMesh mesh = mesh_of(wavy, n, 4);
        const Eigen::VectorXd H0 = H0_on(mesh);
        const VectorField v = smooth_at(mesh);
        const auto at = [&](double s) { return energy_after(mesh, H0, bending, s * v); };
        const double rate = (8 * (at(step) - at(-step)) - (at(2 * step) - at(-2 * step))) / (12 * step);
        return std::abs(power(mesh, H0, bending, v) + rate) / std::abs(rate);
    };
    const double coarse = gap(2), fine = gap(4);
    EXPECT_GT(std::log2(coarse / fine), 3);
    EXPECT_LT(fine, 3e-4);
}

TEST(VaryingH0, theForceAlongASphere) {
    // Exact: on the unit sphere with k20 = 1 and H0 = c + d z the force f_H0 grad H0 = -2 (H - H0) grad H0 has against
    // v = grad z the power 2 d (2 + c) INT 1 - z^2 = 2 d (2 + c) 8 pi/3.
    const CurvedMesh mesh = mesh_of({.radius = 1, .modes = {}}, 4, 4);
    const double c = -1, d = 0.3;
    Eigen::VectorXd H0(mesh.size());
    VectorField v(3, mesh.size());
    for (int i = 0; i < mesh.size(); ++i) {
        const Eigen::Vector3d x = mesh.nodes[i].normalized();
        H0[i] = c + d * x.z();
        v.col(i) = Eigen::Vector3d::UnitZ() - x.z() * x;
    }
    EXPECT_NEAR(power(mesh, H0, {.k = {1, 0, 0}, .H0 = 0}, v), 2 * d * (2 + c) * 8 * pi / 3, 1e-4);
}

const std::string two_domains = R"case(
[energy]
k20 = 0.5
H0 = "-2 - tanh(((1 + z)/2 - 0.6)/0.1)"
[model]
volume = "free"
[shape]
kind = "sphere"
radius = 1
[discretisation]
elements = 80
[accuracy]
energy = 1e-2
[time]
end = 0.02
)case";

TEST(VaryingH0, runsLoseWhatTheyDissipate) {
    // theory.md (3.12), (3.13), (3.14).
    for (const std::string kind : {"gradient-flow", "overdamped", "stokes", "fluid"}) {
        SCOPED_TRACE(kind);
        const Outcome o = run_case(two_domains, {"model.kind=" + kind, "accuracy.estimate=false"});
        ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
        for (const double defect : o.series("identity_defect"))
            EXPECT_LT(std::abs(defect), 1e-2 * o.summary.reference_energy);
        EXPECT_LT(o.series("energy").back(), 0.99 * o.series("energy").front());
        if (kind == "gradient-flow") continue;
        for (const double area : o.series("area")) EXPECT_NEAR(area / o.series("area").front(), 1, 1e-8);
    }
}

TEST(VaryingH0, anInextensibleCellComesToRestAsTheShapeEquationsSay) {
    // Independent computation: as in tests/axisym/varying_H0_test.cpp, for these domains; on the sphere (1 + z)/2 is
    // the part of the area below.
    for (const std::vector<std::string>& model :
         {std::vector<std::string>{"model.kind=stokes", "model.gamma=1"}, {"model.kind=overdamped"}}) {
        std::vector<std::string> sets{"energy.H0=\"-2 - 0.5*tanh(((1 + z)/2 - 0.6)/0.25)\"", "time.end=3",
                                      "accuracy.estimate=false"};
        sets.insert(sets.end(), model.begin(), model.end());
        const Outcome o = run_case(two_domains, sets);
        ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
        EXPECT_NEAR(o.last("energy"), 0.7837975776, 1e-3);
        EXPECT_NEAR(o.last("height"), 2.0555857309, 2e-3);
    }
}

TEST(VaryingH0, ofThePointsOfAProfileIsThatOfTheFormula) {
    // Definition: on a sphere, whose area below is (1 + z)/2, and on a straight tube, both say the same.
    const auto domains = [](double below) { return -2 - std::tanh((below - 0.6) / 0.25); };
    const auto waves = [](double z) { return -1 + 0.3 * std::cos(2 * pi * z / 4) + 0.1 * std::sin(2 * pi * z / 4); };
    struct Scene {
        int n;
        std::function<std::array<double, 3>(double)> at;
        std::string formula, length;
    };
    const Scene cell{120,
                     [&](double t) {
                         const double z = -std::cos(pi * t);
                         return std::array{t == 0 || t == 1 ? 0 : std::sin(pi * t), z, domains((1 + z) / 2)};
                     },
                     "-2 - tanh(((1 + z)/2 - 0.6)/0.25)", ""};
    const Scene tube{60,
                     [&](double t) {
                         return std::array{1.0, 4 * t, waves(4 * t)};
                     },
                     "-1 + 0.3*cos(2*pi*z/4) + 0.1*sin(2*pi*z/4)", "length = 4.0\n"};
    for (const auto& [n, at, formula, length] : {cell, tube}) {
        SCOPED_TRACE(formula);
        const std::string energy = "[energy]\nk20 = 0.5\n",
                          more = length +
                                 "[discretisation]\nelements = 80\n[accuracy]\nenergy = 1e-2\nestimate = "
                                 "false\n[model]\nkind = \"overdamped\"\nvolume = \"free\"\n[time]\nend = 0.005\n";
        const test::ProfilePoints points(n, at), ignored(n, at, "weight");
        const Outcome by_points = run_case(energy + points.shape(more)),
                      by_formula = run_case(energy + "H0 = \"" + formula + "\"\n" + ignored.shape(more));
        ASSERT_EQ(by_points.summary.stop.reason, Stop::finished) << by_points.summary.stop.message;
        const auto H0_at_start = [](const Outcome& o) { return find_array(o.watch.frames.front(), "H0")->data; };
        const std::vector<double> a = H0_at_start(by_points), b = H0_at_start(by_formula);
        ASSERT_EQ(a.size(), b.size());
        for (std::size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(a[i], b[i], 1e-6) << i;
        EXPECT_NEAR(by_points.last("energy"), by_formula.last("energy"), 1e-5 * by_formula.summary.reference_energy);
        EXPECT_LT(std::abs(by_points.last("identity_defect")), 1e-2 * by_points.summary.reference_energy);
        EXPECT_LT(by_points.last("energy"), by_points.series("energy").front());
    }
}

TEST(VaryingH0, refusals) {
    const auto refused = [](const std::vector<std::string>& sets) {
        return test::message_of<CaseError>([&] { run_case(two_domains, sets); });
    };
    const auto says = [&](const std::vector<std::string>& sets, const std::string& part) {
        EXPECT_CONTAINS(refused(sets), part);
    };
    says({"energy.H0=\"area\""}, "there is no 'area'; allowed are x, y, z");
    says({"energy.H0=\"log(z)\""}, "energy.H0 is no number at (");
    says({"shape={kind = \"tube\", radius = 1.0, length = 4.0}"},
         "energy.H0 must repeat itself with the period 4 along z");
}

}  // namespace tubule::surface3d::varying_H0_test
