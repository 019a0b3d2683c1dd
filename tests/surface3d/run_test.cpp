// Cases of tier surface3d: energies of exactly known shapes as accurate as asked and as stated, on every kind of mesh;
// guards; refusals.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <set>

#include "common/case/read.hpp"
#include "common/geometry/profile_point.hpp"
#include "common/result/start_frame.hpp"
#include "surface3d/run/run_surface.hpp"
#include "tests/support/message_of.hpp"
#include "tests/support/paths.hpp"

namespace tubule::surface3d::run_test {

struct Watch : RunObserver {
    std::vector<double> values;
    std::vector<Record> frames;
    std::vector<SurfaceCells> meshes;
    void row(std::span<const double> row) override { values.assign(row.begin(), row.end()); }
    std::size_t mesh(const SurfaceCells& cells) override {
        meshes.push_back(cells);
        return meshes.size() - 1;
    }
    void frame(const std::function<Record()>& make) override { frames.push_back(make()); }
};

struct Outcome {
    Case c;
    Watch watch;
    RunSummary summary;
    double at(const std::string& series) const {
        const std::vector<std::string> names = series_names(c);
        return watch.values.at(std::find(names.begin(), names.end(), series) - names.begin());
    }
};

Outcome run_case(const std::string& shape, const std::vector<std::string>& sets = {}) {
    Outcome out{parse_case("tier = \"surface3d\"\n[energy]\nk20 = 1.0\n[shape]\n" + shape, sets, "case.toml"), {}, {}};
    out.summary = run_surface(out.c, out.watch);
    return out;
}

const std::string perturbed = "kind = \"sphere\"\nradius = 1\nmode = [{amplitude = 0.5, l = 5, m = 3}]\n";

// The error of the energy is at most the stated one, which is at most the required one, and the run says so.
void expect_honest(const Outcome& o, double exact) {
    ASSERT_EQ(o.summary.stop.reason, Stop::finished) << o.summary.stop.message;
    const double error = std::abs(o.summary.energy - exact) / o.summary.reference_energy;
    EXPECT_LE(error, o.summary.estimated_error + 1e-14);
    EXPECT_LE(o.summary.estimated_error, o.c.accuracy.energy);
    EXPECT_TRUE(o.summary.as_accurate_as_asked);
}

TEST(SurfaceRun, EnergiesAreAsAccurateAsAsked) {
    // Exact values: theory.md (7.10).
    expect_honest(run_case(perturbed), 135.8066231985);
    expect_honest(run_case(perturbed, {"energy.k20=0", "energy.k42=1"}), 160.529992807);
    expect_honest(run_case("kind = \"torus\"\nradius = 1.5\ntube_radius = 0.5\n"), integral_H2(Torus{1.5, 0.5}));
    expect_honest(run_case("kind = \"ellipsoid\"\na = 1\nb = 1.3\nc = 0.7\n",
                           {"energy.k20=0", "energy.k42=1", "accuracy.energy=1e-5"}),
                  integral_K2(Ellipsoid{1, 1.3, 0.7}));
    expect_honest(run_case("kind = \"tube\"\nradius = 0.5\nlength = 2\n", {"accuracy.energy=1e-6"}), 2 * pi * 2 / 0.5);
}

TEST(SurfaceRun, ErrorsOfSmoothShapesAreWithinAFactorOfTenOfTheirEstimates) {
    // The exact integral is that of common/geometry.
    const std::string ellipsoid = "kind = \"ellipsoid\"\na = 1\nb = 1.3\nc = 0.7\n";
    const double exact = integral_K2(Ellipsoid{1, 1.3, 0.7});
    for (const int order : {2, 3, 4}) {
        const Outcome o = run_case(ellipsoid, {"energy.k20=0", "energy.k42=1", "discretisation.elements=5120",
                                               fmt::format("discretisation.order={}", order)});
        const double error = std::abs(o.summary.energy - exact) / o.summary.reference_energy;
        EXPECT_LT(error, o.summary.estimated_error) << order;
        EXPECT_GT(error, o.summary.estimated_error / 10) << order;
    }
}

TEST(SurfaceRun, RecoveriesOfSecondOrderAreAsAccurateAsTheySay) {
    // On their first meshes they get better faster than that.
    struct Trial {
        const char* recovery;
        double c, asked;
    };
    for (const auto& [recovery, c, asked] : {Trial{"elementwise", 0.15, 0.0063}, Trial{"elementwise", 0.736, 0.0063},
                                             Trial{"elementwise", 3.61, 0.0063}, Trial{"weak", 0.15, 0.0158}}) {
        SCOPED_TRACE(recovery);
        expect_honest(run_case(fmt::format("kind = \"ellipsoid\"\na = 1\nb = 1.3\nc = {}\n", c),
                               {"energy.k20=0", "energy.k42=1", fmt::format("accuracy.energy={}", asked),
                                fmt::format("discretisation.recovery={}", recovery)}),
                      integral_K2(Ellipsoid{1, 1.3, c}));
    }
}

TEST(SurfaceRun, AreaAndVolume) {
    const Outcome o = run_case("kind = \"dumbbell\"\n", {"accuracy.energy=1e-5"});
    EXPECT_NEAR(o.at("area"), 5.176926500756, 2e-5);  // theory.md (7.9)
    EXPECT_NEAR(o.at("volume"), 0.777918180889, 1e-5);
    EXPECT_NEAR(o.at("integral_K"), 4 * pi, 1e-4);
    EXPECT_EQ(o.at("elements"), o.summary.elements);
}

TEST(SurfaceRun, EveryKindOfMesh) {
    for (const char* kind : {"uniform", "graded", "irregular"}) {
        const Outcome o = run_case("kind = \"ellipsoid\"\na = 1\nb = 1.3\nc = 0.7\n",
                                   {"energy.k20=0", "energy.k42=1", "discretisation.elements=800",
                                    std::string("discretisation.mesh=") + kind});
        SCOPED_TRACE(kind);
        EXPECT_NEAR(o.summary.elements, 800, 80);
        expect_honest(o, integral_K2(Ellipsoid{1, 1.3, 0.7}));
    }
}

TEST(SurfaceRun, AnEnergyOfZeroIsNoAccuracy) {
    // A sphere of radius 1 has H = -2 everywhere. One mesh says nothing of the error, however small its energy is.
    const Outcome o = run_case("kind = \"sphere\"\nradius = 1\n", {"energy.H0=-2.0", "discretisation.elements=80"});
    EXPECT_LT(o.summary.energy, 1e-3);
    EXPECT_EQ(o.summary.estimated_error, 1);
    EXPECT_EQ(o.summary.warnings.size(), 1u);
}

TEST(SurfaceRun, FrameIsTheSurface) {
    const Outcome o = run_case("kind = \"sphere\"\nradius = 2\n", {"discretisation.elements=320"});
    ASSERT_EQ(o.watch.frames.size(), 1u);
    const Record& frame = o.watch.frames[0];
    ASSERT_EQ(frame.mesh, 0u);
    const std::size_t nodes = o.watch.meshes.at(0).nodes;
    for (const Array& array : frame.arrays) EXPECT_EQ(array.shape[0], nodes) << array.name;
    for (std::size_t i = 0; i < nodes; ++i) {
        const Eigen::Map<const Eigen::Vector3d> x(&frame.arrays[0].data[3 * i]), normal(&frame.arrays[1].data[3 * i]);
        EXPECT_NEAR(x.norm(), 2, 1e-14);
        EXPECT_NEAR(normal.dot(x), 2, 1e-5);
        EXPECT_NEAR(frame.arrays[2].data[i], -1, 1e-3);    // H
        EXPECT_NEAR(frame.arrays[3].data[i], 0.25, 1e-3);  // K
    }
}

TEST(SurfaceRun, ExactCurvatureOfExactShapes) {
    const Outcome o = run_case("kind = \"sphere\"\nradius = 2\n", {"discretisation.recovery=exact"});
    for (const double H : o.watch.frames.at(0).arrays[2].data) EXPECT_NEAR(H, -1, 1e-13);
    for (const double K : o.watch.frames.at(0).arrays[3].data) EXPECT_NEAR(K, 0.25, 1e-13);
    expect_honest(o, 16 * pi);
    expect_honest(run_case("kind = \"torus\"\nradius = 1.5\ntube_radius = 0.5\n",
                           {"discretisation.recovery=exact", "discretisation.mesh=irregular", "accuracy.energy=1e-3"}),
                  integral_H2(Torus{1.5, 0.5}));
    expect_honest(run_case("kind = \"ellipsoid\"\na = 1\nb = 1.3\nc = 0.7\n",
                           {"energy.k20=0", "energy.k42=1", "discretisation.recovery=exact", "accuracy.energy=1e-3"}),
                  integral_K2(Ellipsoid{1, 1.3, 0.7}));
}

TEST(SurfaceRun, StopsWhereTheAnswerMeansNothing) {
    const Outcome coarse = run_case(perturbed, {"discretisation.elements=80", "discretisation.recovery=elementwise"});
    EXPECT_EQ(coarse.summary.stop.reason, Stop::resolution_lost);
    EXPECT_CONTAINS(coarse.summary.stop.message, "INT ");
    EXPECT_EQ(coarse.watch.frames.size(), 1u);  // to look at

    const Outcome folded = run_case("kind = \"sphere\"\nradius = 1\nmode = [{amplitude = 1.0, l = 12, m = 7}]\n",
                                    {"discretisation.elements=80"});
    EXPECT_EQ(folded.summary.stop.reason, Stop::mesh_lost);
    EXPECT_EQ(folded.summary.estimated_error, 1) << "nothing is known of its energy";
    EXPECT_CONTAINS(folded.summary.stop.message, "folds at (");
}

TEST(Start, ReadsItsFileOnce) {
    const auto path = std::filesystem::temp_directory_path() / fmt::format("tubule_start_{}.off", getpid());
    std::filesystem::copy_file(test::cases + "/meshes/ellipsoid.off", path);
    const Case c = parse_case(
        "tier = \"surface3d\"\n[energy]\nk20 = 1.0\n[shape]\nkind = \"file\"\npath = \"" + path.string() + "\"\n", {},
        "");
    const Start start(c), other(c);
    std::filesystem::remove(path);
    EXPECT_FALSE(start.resizable());
    for (const int order : {2, 3, 2}) {  // the same nodes whatever was made before
        const CurvedMesh mesh = start.mesh(0, order).mesh;
        EXPECT_EQ(mesh.order, order);
        EXPECT_EQ(mesh.nodes, other.mesh(0, order).mesh.nodes);
    }
    EXPECT_THROW(Start{c}, CaseError);
}

TEST(Start, MeshesDoNotDependOnThoseMadeBefore) {
    const Case c = parse_case(
        "tier = \"surface3d\"\n[energy]\nk20 = 1.0\n[shape]\nkind = \"capsule\"\nradius = 0.5\nlength = 1.0\n"
        "[discretisation]\nmesh = \"graded\"\n",
        {}, "");
    const Start start(c);
    start.mesh(300, 3), start.mesh(100, 2);
    EXPECT_EQ(start.mesh(200, 3).mesh.nodes, Start(c).mesh(200, 3).mesh.nodes);
    EXPECT_EQ(start.mesh(200, 2).mesh.nodes, Start(c).mesh(200, 2).mesh.nodes);
}

TEST(Start, WavesAlongATubeAskForWideTriangles) {
    // Differences of degree 5 of 0.25 sin(pi z) exceed those of the circle by about 0.25 pi^5, whose fifth root is 2.4.
    // Equal sides where the triangles are given, or where azimuthal waves add to axial ones.
    const auto lowest_points = [](const std::string& rest) {
        const Case c = parse_case(
            "tier = \"surface3d\"\n[energy]\nk20 = 1.0\n[shape]\nkind = \"tube\"\nradius = 1.0\nlength = 2.0\n" + rest,
            {}, "");
        const CurvedMesh mesh = Start(c).mesh(240, 4).mesh;
        std::set<int> corners;
        for (int cell = 0; cell < mesh.triangles(); ++cell)
            for (int a = 0; a < 3; ++a)
                if (mesh.nodes[mesh.node(cell, a)].z() < 1e-9) corners.insert(mesh.node(cell, a));
        EXPECT_NEAR(mesh.triangles(), 240, 40) << rest;
        return corners.size();
    };
    const std::string wave = "[[shape.mode]]\namplitude = 0.25\nn = 1\n", given = "[discretisation]\nelements = 240\n";
    EXPECT_EQ(lowest_points(""), 18u);
    EXPECT_EQ(lowest_points(wave), 12u);
    EXPECT_EQ(lowest_points(wave + given), 18u);
    EXPECT_EQ(lowest_points(wave + "[[shape.mode]]\namplitude = 0.01\nn = 1\nm = 1\n"), 18u);
}

TEST(SurfaceRun, InterruptedAtOnce) {
    struct Impatient : Watch {
        bool interrupted() override { return true; }
    };
    for (const char* elements : {"", "[discretisation]\nelements = 2000\n"}) {
        Impatient watch;
        const Case c =
            parse_case("tier = \"surface3d\"\n[energy]\nk20 = 1.0\n[shape]\n" + perturbed + elements, {}, "case.toml");
        const RunSummary s = run_surface(c, watch);
        EXPECT_EQ(s.stop.reason, Stop::interrupted);
        EXPECT_EQ(s.estimated_error, 1);  // one mesh does not show the error
        for (const double value : watch.values) EXPECT_TRUE(std::isfinite(value));
        EXPECT_EQ(watch.frames.size(), 1u);
    }
}

TEST(SurfaceRun, ShapesThatCannotBeMade) {
    const auto refusal = [](const std::string& shape, const std::vector<std::string>& sets = {}) -> std::string {
        return test::message_of<CaseError>([&] { run_case(shape, sets); });
    };
    EXPECT_EQ(refusal("kind = \"torus\"\nradius = 2\ntube_radius = 1\n", {"discretisation.mesh=graded"}),
              "--set discretisation.mesh=graded: discretisation.mesh must be \"uniform\" or \"irregular\" for a torus, "
              "not \"graded\"");
    EXPECT_EQ(refusal("kind = \"file\"\npath = \"none.obj\"\n"),
              "case.toml:6:8: shape.path cannot be used: none.obj: cannot be opened: No such file or directory");
    EXPECT_EQ(refusal("kind = \"result\"\npath = \"none.hdf\"\n"),
              "case.toml:6:8: shape.path cannot be used: cannot open none.hdf: No such file or directory");
    for (const char* key : {"discretisation.elements=100", "discretisation.mesh=graded"})
        EXPECT_EQ(refusal("kind = \"file\"\npath = \"none.obj\"\n", {key}),
                  fmt::format("--set {}: {} must be absent: the triangles come from shape.path", key,
                              std::string(key).substr(0, std::string(key).find('='))));
    EXPECT_EQ(refusal("kind = \"file\"\npath = \"none.obj\"\n", {"discretisation.recovery=exact"}),
              "--set discretisation.recovery=exact: discretisation.recovery must not be \"exact\": a surface made of "
              "triangles is known only at "
              "points");
}

// A frame of tier axisym may be a patch: it has no closed surface.
TEST(SurfaceRun, RefusesAPatch) {
    Record frame;
    frame.kind = RecordKind::equilibrium, frame.numbers = {{"length", 0.0}};
    Array r{"r", {12}, {}}, z{"z", {12}, {}};
    for (int i = 0; i < 12; ++i) r.data.push_back(1 - i / 11.0), z.data.push_back(0.3 * (1 - r.data[i] * r.data[i]));
    frame.arrays = {r, z};
    Result result;
    result.frames = {frame};
    Case c =
        parse_case("tier = \"surface3d\"\n[energy]\nk20 = 1\n[shape]\nkind = \"result\"\npath = \"x.hdf\"\nframe = 0\n",
                   {}, "case.toml");
    c.input = frame_as_input(std::get<ResultFrame>(c.shape), result);
    EXPECT_CONTAINS(test::message_of<CaseError>([&] { const Start start(c); }), "shape.path must not hold a patch");
}

}  // namespace tubule::surface3d::run_test
