// The smooth surface through irregular vertices, against surfaces known exactly: a sphere, a triaxial ellipsoid, a
// bumpy sphere. Orders come from theory (fitted polynomials of degree k + 1 leave nodes O(h^(k+2)) off the surface;
// elements of degree k have errors O(h^(k+1)) in position, O(h^k) in the normal, O(h^(k-1)) in H). Magnitudes were
// measured once; the bounds are 1.3 times those, so that a worse fit of the right order is noticed too.
#include "surface3d/import/import_fit.hpp"

#include <gtest/gtest.h>

#include "tests/support/message_of.hpp"
#include "tests/surface3d/import_files.hpp"
#include "tests/surface3d/import_samples.hpp"

namespace tubule::surface3d::import_fit_test {

using namespace samples;

ImportedMesh closed(const TriangleMesh& mesh) {
    ImportedMesh out = imported(mesh);
    close_mesh(out);
    return out;
}

const Surface sphere, ellipsoid{.axes = {1, 0.8, 0.6}}, bumpy{.axes = {1, 1, 1}, .bump = 0.3};

// Root mean square distance of the nodes from the surface.
double node_error(const CurvedMesh& mesh, const Surface& surface) {
    double sum = 0;
    for (const Vector3d& x : mesh.nodes) sum += std::pow(surface.value(x) / surface.gradient(x).norm(), 2);
    return std::sqrt(sum / mesh.size());
}

struct Expected {
    const char* name;
    const Surface& surface;
    int order;
    double position, normal, mean_curvature;  // measured at 5120 triangles

    friend std::ostream& operator<<(std::ostream& out, const Expected& e) { return out << e.name << " P" << e.order; }
};

class Convergence : public testing::TestWithParam<Expected> {};

TEST_P(Convergence, OrdersAndErrorsFrom1280To5120IrregularTriangles) {
    const auto& [name, surface, k, position, normal, mean_curvature] = GetParam();
    const CurvedMesh coarse = fit_surface(closed(irregular(surface, 8)), {.order = k}).surface;
    const CurvedMesh fine = fit_surface(closed(irregular(surface, 16)), {.order = k}).surface;
    const Errors e = errors(coarse, surface), f = errors(fine, surface);
    EXPECT_GT(std::log2(node_error(coarse, surface) / node_error(fine, surface)), k + 2 - 0.6);
    EXPECT_GT(std::log2(e.position / f.position), k + 1 - 0.2);
    EXPECT_GT(std::log2(e.normal / f.normal), k - 0.2);
    EXPECT_GT(std::log2(e.mean_curvature / f.mean_curvature), k - 1 - 0.2);
    EXPECT_LT(f.position, 1.3 * position);
    EXPECT_LT(f.normal, 1.3 * normal);
    EXPECT_LT(f.mean_curvature, 1.3 * mean_curvature);
}

INSTANTIATE_TEST_SUITE_P(Fit, Convergence,
                         testing::Values(Expected{"sphere", sphere, 2, 2.45e-6, 9.87e-5, 6.54e-3},
                                         Expected{"sphere", sphere, 3, 1.83e-7, 1.96e-5, 3.82e-3},
                                         Expected{"sphere", sphere, 4, 3.10e-8, 1.09e-6, 6.02e-5},
                                         Expected{"ellipsoid", ellipsoid, 2, 6.33e-6, 4.19e-4, 3.98e-2},
                                         Expected{"ellipsoid", ellipsoid, 3, 9.68e-7, 9.56e-5, 1.52e-2},
                                         Expected{"ellipsoid", ellipsoid, 4, 2.44e-7, 1.20e-5, 8.81e-4},
                                         Expected{"bumpy", bumpy, 2, 1.41e-5, 1.17e-3, 1.03e-1},
                                         Expected{"bumpy", bumpy, 3, 1.75e-6, 1.53e-4, 2.16e-2},
                                         Expected{"bumpy", bumpy, 4, 3.86e-7, 2.09e-5, 1.61e-3}),
                         [](const auto& info) { return fmt::format("{}_P{}", info.param.name, info.param.order); });

class EveryOrder : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Fit, EveryOrder, testing::Values(2, 3, 4));

TEST_P(EveryOrder, PassesThroughTheVerticesAndJoinsAtEdges) {
    const int k = GetParam();
    const ImportedMesh mesh = closed(irregular(bumpy, 5));
    const Fit fit = fit_surface(mesh, {.order = k});
    const CurvedMesh& surface = fit.surface;
    const int vertices = int(mesh.mesh.points.size()), triangles = int(mesh.mesh.triangles.size());
    // Each edge (there are 3/2 of them a triangle) has k - 1 nodes of its own, each triangle (k-1)(k-2)/2.
    ASSERT_EQ(surface.size(), vertices + triangles * 3 / 2 * (k - 1) + triangles * (k - 1) * (k - 2) / 2);
    ASSERT_EQ(surface.triangles(), triangles);
    std::map<std::pair<int, int>, std::vector<int>> edges;  // nodes along each directed edge
    for (int cell = 0; cell < triangles; ++cell) {
        for (int i = 0; i < 3; ++i) {
            const int a = surface.node(cell, i), b = surface.node(cell, (i + 1) % 3);
            EXPECT_EQ(a, mesh.mesh.triangles[cell][i]);
            EXPECT_EQ(surface.nodes[a], mesh.mesh.points[a]);
            for (int n = 0; n < k - 1; ++n) edges[{a, b}].push_back(surface.node(cell, 3 + i * (k - 1) + n));
        }
    }
    for (const auto& [ends, nodes] : edges) {
        const std::vector<int>& back = edges.at({ends.second, ends.first});
        EXPECT_TRUE(std::equal(nodes.begin(), nodes.end(), back.rbegin()));
    }
}

// A rotation with a shift, and other numbers for triangles and vertices, change no point of the surface.
TEST_P(EveryOrder, MovesAlongWithTheMeshWhateverTheNumbering) {
    const TriangleMesh original = irregular(bumpy, 5);
    const Eigen::AngleAxisd turn(1.1, Vector3d(2, -1, 1).normalized());
    const Vector3d shift(3, -2, 1);
    const int n = int(original.points.size());
    TriangleMesh moved;
    moved.points.resize(original.points.size());
    const auto number = [&](int v) { return (v * 5 + 3) % n; };  // 252 vertices: 5 has no factor of 252
    for (int v = 0; v < n; ++v) moved.points[number(v)] = turn * original.points[v] + shift;
    for (auto t = original.triangles.rbegin(); t != original.triangles.rend(); ++t) {
        moved.triangles.push_back({number((*t)[0]), number((*t)[1]), number((*t)[2])});
    }
    const CurvedMesh a = fit_surface(closed(original), {.order = GetParam(), .smoothing = 1}).surface;
    const CurvedMesh b = fit_surface(closed(moved), {.order = GetParam(), .smoothing = 1}).surface;
    for (int cell = 0; cell < a.triangles(); ++cell) {
        for (int i = 0; i < a.nodes_per_cell(); ++i) {
            const Vector3d expected = turn * a.position(cell, i) + shift;
            EXPECT_LT((b.position(a.triangles() - 1 - cell, i) - expected).norm(), 1e-11);
        }
    }
}

// Noise of standard deviation 0.024 of an edge. One smoothing divides the errors of normals by 4 and of H by 5 at
// least, a second one helps again; the report separates noise (0.020, measured) from none.
TEST_P(EveryOrder, SmoothingTakesNoiseOut) {
    const int n = 18;
    TriangleMesh noisy = irregular(bumpy, n);
    std::mt19937 random(5);
    for (Vector3d& x : noisy.points) x *= 1 + 0.03 / n * std::sqrt(3) * (2 * double(random()) / 4294967295.0 - 1);
    const ImportedMesh mesh = closed(noisy);
    std::vector<Errors> e;
    std::vector<FitReport> report;
    for (int smoothing = 0; smoothing < 3; ++smoothing) {
        const Fit fit = fit_surface(mesh, {.order = GetParam(), .smoothing = smoothing});
        e.push_back(errors(fit.surface, bumpy));
        report.push_back(fit.report);
    }
    EXPECT_LT(e[1].position, e[0].position / 2);
    EXPECT_LT(e[1].normal, e[0].normal / 4);
    EXPECT_LT(e[1].mean_curvature, e[0].mean_curvature / 5);
    EXPECT_LT(e[2].normal, 0.8 * e[1].normal);
    EXPECT_LT(e[2].mean_curvature, 0.8 * e[1].mean_curvature);
    EXPECT_NEAR(report[0].roughness, 0.020, 0.002);
    ASSERT_EQ(report[0].notes.size(), 1u);
    EXPECT_EQ(report[0].notes[0],
              fmt::format("The vertices are {:.2g} of an edge (root mean square) off the smooth surface through their "
                          "neighbours: the mesh is coarse, or it is noisy; shape.remesh makes a smooth one of new "
                          "triangles.",
                          report[0].roughness));
    EXPECT_TRUE(report[1].notes.empty());
    EXPECT_LT(fit_surface(closed(irregular(bumpy, n)), {.order = GetParam()}).report.roughness, 2e-3);
}

// A pass changes a smooth surface by O(h^4), that is by O(h^3) edges: a factor 8.
TEST(Smoothing, LeavesSmoothSurfacesAlone) {
    double moved[2];
    for (const int level : {0, 1})
        moved[level] = fit_surface(closed(irregular(bumpy, level ? 32 : 16)), {.order = 2}).report.roughness;
    EXPECT_GT(std::log2(moved[0] / moved[1]), 3 - 0.3);
}

// The way of a scan: a file with 9680 irregular triangles, read, checked, fitted.
TEST(Scan, FromAFileToASmoothSurface) {
    const TemporaryDirectory directory;
    for (const bool binary : {true, false}) {
        const std::string name = binary ? "scan.ply" : "scan.stl";
        const TriangleMesh written = irregular(bumpy, 22);
        ImportedMesh scan =
            read_mesh(directory.write(name, binary ? ply(written, "binary_big_endian") : stl_ascii(written)));
        EXPECT_EQ(close_mesh(scan).genus, 0);
        EXPECT_EQ(scan.mesh.triangles.size(), 9680u);
        const Fit fit = fit_surface(scan, {.order = 3});
        EXPECT_TRUE(scan.notes.empty());
        EXPECT_TRUE(fit.report.notes.empty());
        EXPECT_EQ(fit.report.reduced, 0u);
        EXPECT_LT(errors(fit.surface, bumpy).position, 1.3 * 3.8e-7);  // measured; the bumps are 0.3 high
    }
}

// About an icosahedron's corner there are five neighbours: not enough for a quadratic and for judging it.
TEST(Fit, SmallMeshesGetLowerDegreesWithANote) {
    const Fit fit = fit_surface(closed(geodesic_sphere(1)), {.order = 2});
    EXPECT_EQ(fit.report.reduced, 12u);
    ASSERT_EQ(fit.report.notes.size(), 1u);
    EXPECT_EQ(
        fit.report.notes[0],
        "At 12 of 12 vertices the neighbourhood does not determine a polynomial of degree 3; a lower one was used.");
}

std::string refusal(const TriangleMesh& mesh, int order) {
    return test::message_of<MeshError>([&] { fit_surface(closed(mesh), {.order = order}); });
}

const std::string advice =
    "; the mesh is too coarse or too rough there for a smooth surface: shape.remesh = NUMBER makes one of so many new "
    "triangles";

// A disc with a rim of radius of curvature 0.01, far below the mesh width.
TEST(Fit, RefusesARimThatTheMeshDoesNotResolve) {
    const std::string message = refusal(irregular({.axes = {1, 1, 0.1}}, 8), 3);
    int triangle = -1;
    ASSERT_EQ(std::sscanf(message.c_str(), "mesh: triangle %d: ", &triangle), 1) << message;
    EXPECT_EQ(
        message,
        fmt::format("mesh: triangle {}: the polynomials fitted at its vertices do not reach a common point above it{}",
                    triangle, advice));
}

TEST(Fit, RefusesElementsThatFold) {
    TriangleMesh rough = irregular(sphere, 5, 0);
    std::mt19937 random(0);
    for (Vector3d& x : rough.points) x *= 1 + 0.8 / 5 * (2 * double(random()) / 4294967295.0 - 1);
    EXPECT_EQ(refusal(rough, 2), "mesh: triangle 8: the fitted element folds" + advice);
}

// The ends of a bent body, 0.003 into each other where they are smooth, apart where they are flat.
TEST(Fit, RefusesElementsThatMeetWhereFlatTrianglesDoNot) {
    EXPECT_EQ(refusal(bent_body(0.01), 3), "accepted");
    EXPECT_EQ(refusal(bent_body(-0.003), 3),
              "mesh: triangle 43: the fitted element intersects that of triangle 1358" + advice);
}

TEST(Fit, RefusesOrdersOutOfRange) {
    EXPECT_THROW(fit_surface(closed(geodesic_sphere(2)), {.order = 5}), std::invalid_argument);
}

}  // namespace tubule::surface3d::import_fit_test
