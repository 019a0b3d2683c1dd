// What a mesh must be to be the boundary of one body, each refusal naming its element; and whether triangles meet, on
// pairs whose answer is plain to see.
#include "surface3d/import/import_check.hpp"

#include <gtest/gtest.h>

#include "surface3d/mesh/self_intersection.hpp"
#include "tests/support/message_of.hpp"
#include "tests/surface3d/import_files.hpp"
#include "tests/surface3d/import_samples.hpp"

namespace tubule::surface3d::import_check_test {

using namespace samples;

std::string refusal(ImportedMesh mesh) {
    return test::message_of<MeshError>([&] { close_mesh(mesh); });
}

// Why a file of these vertices and faces is refused, with its name cut to "a.obj".
std::string refusal_of_obj(const std::string& text) {
    const TemporaryDirectory directory;
    ImportedMesh mesh = read_mesh(directory.write("a.obj", text));
    mesh.file = "a.obj";
    return refusal(mesh);
}

// A tetrahedron, outward.
const std::string corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";                   // lines 1 to 4
const std::string faces = "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";                     // lines 5 to 8
const std::string second_corners = "v 3 0 0\nv 4 0 0\nv 3 1 0\nv 3 0 1\n";            // lines 9 to 12
const std::string second_faces = "f -4 -2 -3\nf -4 -3 -1\nf -3 -2 -1\nf -2 -4 -1\n";  // lines 13 to 16

const std::string wrapping =
    "shape.wrap = LENGTH, with shape.remesh, puts one surface around everything, closing gaps of that length";

TEST(CloseMesh, MeasuresATetrahedron) {
    TriangleMesh tetrahedron;
    tetrahedron.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    tetrahedron.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
    ImportedMesh mesh = imported(tetrahedron);
    const MeshReport report = close_mesh(mesh);
    EXPECT_EQ(report.genus, 0);
    EXPECT_NEAR(report.volume, 1 / 6., 1e-15);
    EXPECT_NEAR(report.area, 1.5 + std::sqrt(3) / 2, 1e-15);
    // Between (1,1,1)/sqrt 3 and (0,0,-1).
    EXPECT_NEAR(report.kink_max, std::acos(-1 / std::sqrt(3)) * 180 / std::numbers::pi, 1e-12);
    ASSERT_EQ(mesh.notes.size(), 1u);
    EXPECT_EQ(mesh.notes[0],
              "The largest kink is 125 degrees, between triangle 0 and triangle 2: a smooth surface through such "
              "edges is a guess.");
}

TriangleMesh torus(int around, int along) {
    TriangleMesh mesh;
    for (int i = 0; i < along; ++i) {
        for (int j = 0; j < around; ++j) {
            const double s = 2 * std::numbers::pi * i / along, t = 2 * std::numbers::pi * j / around;
            mesh.points.emplace_back((2 + std::cos(t)) * std::cos(s), (2 + std::cos(t)) * std::sin(s), std::sin(t));
            const auto at = [&](int a, int b) { return (a % along) * around + b % around; };
            mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
            mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
        }
    }
    return mesh;
}

TEST(CloseMesh, CountsTheHandleOfATorus) {
    ImportedMesh mesh = imported(torus(20, 40));
    const MeshReport report = close_mesh(mesh);
    EXPECT_EQ(report.genus, 1);
    EXPECT_NEAR(report.volume, 4 * std::numbers::pi * std::numbers::pi, 1);  // 2 pi^2 R r^2, less the chords
    EXPECT_TRUE(mesh.notes.empty());
}

TEST(CloseMesh, TurnsASurfaceThatFacesInward) {
    TriangleMesh inward = geodesic_sphere(4);
    for (auto& t : inward.triangles) std::swap(t[0], t[1]);
    ImportedMesh mesh = imported(inward);
    EXPECT_GT(close_mesh(mesh).volume, 0);
    for (std::size_t t = 0; t < mesh.mesh.triangles.size(); ++t) {
        const auto& [a, b, c] = mesh.mesh.triangles[t];
        const auto& x = mesh.mesh.points;
        EXPECT_GT((x[b] - x[a]).cross(x[c] - x[a]).dot(x[a]), 0);
    }
    ASSERT_EQ(mesh.notes.size(), 1u);
    EXPECT_EQ(mesh.notes[0], "All triangles faced inward; their orientation was reversed.");
}

TEST(CloseMesh, DropsVerticesOfNoTriangleAndKeepsTheNamesOfTheOthers) {
    const TemporaryDirectory directory;
    ImportedMesh mesh = read_mesh(directory.write("a.obj", "v 9 9 9\n" + corners +
                                                               "f -4 -2 -3\nf -4 -3 -1\nf -3 -2 -1\n"
                                                               "f -2 -4 -1\n"));
    close_mesh(mesh);
    EXPECT_EQ(mesh.mesh.points.size(), 4u);
    EXPECT_EQ(mesh.vertex_number, (std::vector<std::int64_t>{2, 3, 4, 5}));
    EXPECT_EQ(mesh.mesh.triangles[0], (std::array<int, 3>{0, 2, 1}));
    ASSERT_GE(mesh.notes.size(), 1u);
    EXPECT_EQ(mesh.notes[0], "1 vertices belong to no triangle and were dropped.");
}

TEST(CloseMesh, RefusesWhatIsNotClosed) {
    EXPECT_EQ(
        refusal_of_obj(corners + "f 1 3 2\nf 1 2 4\nf 2 3 4\n"),
        "a.obj: the mesh is open: the edge from vertex 1 (0, 0, 0) to vertex 3 (0, 1, 0) of triangle 1 (line 5) "
        "belongs to no other triangle (3 such edges); if the surface is closed there, shape.weld joins vertices that "
        "are near each other; shape.fill_holes = true, with shape.remesh, closes holes");
}

TEST(CloseMesh, RefusesAnEdgeOfThreeTriangles) {
    EXPECT_EQ(
        refusal_of_obj(corners + faces + "v 1 1 1\nf 1 2 5\n"),
        "a.obj: non-manifold edge: the edge from vertex 2 (1, 0, 0) to vertex 1 (0, 0, 0) belongs to 3 triangles, "
        "among them triangle 1 (line 5), triangle 2 (line 6) and triangle 5 (line 10); " +
            wrapping);
}

// Two tetrahedra that share their first vertex.
TEST(CloseMesh, RefusesAVertexWhereTwoSheetsTouch) {
    EXPECT_EQ(
        refusal_of_obj(corners + faces + "v -1 0 0\nv 0 -1 0\nv 0 0 -1\nf 1 5 6\nf 1 7 5\nf 5 7 6\nf 6 7 1\n"),
        "a.obj: non-manifold vertex: triangle 1 (line 5) and triangle 5 (line 12) meet at vertex 1 (0, 0, 0), but "
        "no fan of triangles around it connects them: two surfaces, or two parts of one, touch there; move them apart, "
        "or " +
            wrapping);
}

TEST(CloseMesh, RefusesMixedOrientation) {
    EXPECT_EQ(refusal_of_obj(corners + "f 1 3 2\nf 1 2 4\nf 2 4 3\nf 3 1 4\n"),
              "a.obj: inconsistently oriented: triangle 1 (line 5) and triangle 3 (line 7) traverse the same direction "
              "along the "
              "edge from vertex 3 (0, 1, 0) to vertex 2 (1, 0, 0); turn one of them, or let shape.remesh do so");
}

TEST(CloseMesh, RefusesDegenerateTriangles) {
    EXPECT_EQ(refusal_of_obj("v 0 0 0\nv 1 0 0\nv 0.5 1e-7 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"),
              "a.obj: triangle 1 (line 5) is degenerate: vertex 1 (0, 0, 0), vertex 3 (0.5, 1e-07, 0) and vertex 2 "
              "(1, 0, 0) are collinear");
    // Two vertices at one place become one, and their triangle an edge.
    EXPECT_EQ(refusal_of_obj("v 0 0 0\nv 1 0 0\nv 1 0 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"),
              "a.obj: triangle 1 (line 5) is degenerate: vertex 2 (1, 0, 0) occurs twice in it");
}

TEST(CloseMesh, RefusesDuplicateFaces) {
    EXPECT_EQ(refusal_of_obj(corners + faces + "f 2 4 1\n"),
              "a.obj: duplicate faces: triangle 2 (line 6) and triangle 5 (line 9) have the same vertices");
    EXPECT_EQ(refusal_of_obj(corners + faces + "f 4 2 1\n"),
              "a.obj: duplicate faces: triangle 2 (line 6) and triangle 5 (line 9) have the same vertices");
}

TEST(CloseMesh, RefusesSeveralComponents) {
    EXPECT_EQ(refusal_of_obj(corners + faces + second_corners + second_faces),
              "a.obj: the mesh consists of 2 separate surfaces: triangle 5 (line 13) is not connected to triangle 1 "
              "(line 5); a case has one membrane: keep one of them in the file");
}

TEST(CloseMesh, RefusesBrokenMeshesInMemory) {
    TriangleMesh mesh = geodesic_sphere(2);
    EXPECT_EQ(refusal(imported({})), "mesh: the mesh has no triangles");
    mesh.triangles[3][1] = 99;
    EXPECT_EQ(refusal(imported(mesh)), "mesh: triangle 3 uses point 99, but there are 42");
    mesh = geodesic_sphere(2);
    mesh.points[mesh.triangles[0][0]] = Vector3d(0, NAN, 0);
    EXPECT_EQ(refusal(imported(mesh)), "mesh: vertex 0 (0, nan, 0) is not finite");
    mesh = geodesic_sphere(2);
    mesh.period = 2;
    EXPECT_EQ(refusal(imported(mesh)), "mesh: a periodic mesh is not closed");
}

// The vertex of a fine sphere that is farthest down, pulled up beyond the top: its six triangles go through the others.
TEST(CloseMesh, RefusesSelfIntersectionOnTenThousandTriangles) {
    TriangleMesh mesh = irregular({}, 22);
    const auto lowest = std::min_element(mesh.points.begin(), mesh.points.end(),
                                         [](const Vector3d& a, const Vector3d& b) { return a[2] < b[2]; });
    const int spike = int(lowest - mesh.points.begin());
    *lowest = Vector3d(0.01, 0.02, 1.5);
    const std::string message = refusal(imported(mesh));
    int first = -1, second = -1;
    ASSERT_EQ(std::sscanf(message.c_str(), "mesh: the surface intersects itself: triangle %d intersects triangle %d",
                          &first, &second),
              2)
        << message;
    const auto has_spike = [&](int t) { return std::ranges::count(mesh.triangles[t], spike) == 1; };
    const auto on_top = [&](int t) {
        return std::ranges::all_of(mesh.triangles[t], [&](int v) { return mesh.points[v][2] > 0.9; });
    };
    EXPECT_TRUE((has_spike(first) && on_top(second)) || (has_spike(second) && on_top(first))) << message;
}

// The largest triangle pair test there is: many flat neighbours, turned so that their coordinates are rounded, far
// away.
TEST(CloseMesh, FlatFacesOfATurnedCubeDoNotIntersect) {
    TriangleMesh mesh;
    std::map<std::array<int, 3>, int> number;
    const int n = 12;
    for (int side = 0; side < 6; ++side) {
        const auto vertex = [&](int i, int j) {
            std::array<int, 3> at{};
            at[side % 3] = side < 3 ? 0 : n;
            at[(side + 1) % 3] = side < 3 ? j : i;
            at[(side + 2) % 3] = side < 3 ? i : j;
            const auto [it, added] = number.try_emplace(at, int(mesh.points.size()));
            if (added) mesh.points.emplace_back(at[0], at[1], at[2]);
            return it->second;
        };
        for (int i = 0; i < n; ++i) {
            for (int j = 0; j < n; ++j) {
                mesh.triangles.push_back({vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1)});
                mesh.triangles.push_back({vertex(i, j), vertex(i + 1, j + 1), vertex(i, j + 1)});
            }
        }
    }
    const Eigen::AngleAxisd turn(0.7, Vector3d(1, 2, 3).normalized());
    for (Vector3d& x : mesh.points) x = turn * x + Vector3d(1000, -2000, 500);
    ImportedMesh cube = imported(mesh);
    EXPECT_NEAR(close_mesh(cube).volume, n * n * n, 1e-6);
}

struct Pair {
    const char* what;
    std::array<Vector3d, 6> points;
    std::array<int, 3> second;  // the first triangle is 0 1 2
    bool meet;
};

// In the plane z = 0 or about it; the first triangle is (0,0) (4,0) (0,4).
const std::array<Vector3d, 3> base{Vector3d(0, 0, 0), Vector3d(4, 0, 0), Vector3d(0, 4, 0)};
Pair apart(const char* what, Vector3d a, Vector3d b, Vector3d c, bool meet) {
    return {what, {base[0], base[1], base[2], a, b, c}, {3, 4, 5}, meet};
}
Pair at_vertex(const char* what, Vector3d b, Vector3d c, bool meet) {
    return {what, {base[0], base[1], base[2], b, c, c}, {0, 3, 4}, meet};
}
Pair at_edge(const char* what, Vector3d c, bool meet) {
    return {what, {base[0], base[1], base[2], c, c, c}, {1, 0, 3}, meet};
}

TEST(FirstIntersection, PairsOfTriangles) {
    const std::vector<Pair> pairs{
        apart("pierces", {1, 1, -1}, {1, 1, 1}, {9, 9, 1}, true),
        apart("is pierced", {-9, -9, 1}, {9, -9, 1}, {1, 11, -1}, true),
        apart("beside, across the plane", {5, 5, -1}, {5, 5, 1}, {9, 9, 1}, false),
        apart("above", {0, 0, 1e-9}, {4, 0, 1e-9}, {0, 4, 1e-9}, false),
        apart("a corner touches the inside", {1, 1, 0}, {1, 1, 1}, {2, 1, 1}, true),
        apart("a corner touches an edge", {2, 0, 0}, {2, -1, 1}, {3, -1, 1}, true),
        apart("a corner just short of the edge", {2, -1e-9, 0}, {2, -1, 1}, {3, -1, 1}, false),
        apart("edges cross", {2, -1, 1}, {2, 1, -1}, {2, -1, -1}, true),
        apart("edges pass each other", {2, -1, .9}, {2, 1, -1.1}, {2, -1, -1}, false),
        apart("edges on one line, apart", {5, 0, 0}, {9, 0, 0}, {7, 0, 1}, false),
        apart("edges on one line, overlapping", {3, 0, 0}, {9, 0, 0}, {7, 0, 1}, true),
        apart("in the plane, apart", {4, 4, 0}, {4, 1, 0}, {5, 5, 0}, false),
        apart("in the plane, overlapping", {3, 3, 0}, {.5, .5, 0}, {5, 5.5, 0}, true),
        apart("in the plane, within", {.5, .5, 0}, {1, .5, 0}, {.5, 1, 0}, true),
        apart("in the plane, around", {-9, -9, 0}, {20, -9, 0}, {-9, 20, 0}, true),
        at_vertex("fan in the plane", {-4, 0, 0}, {0, -4, 0}, false),
        at_vertex("in the plane, overlapping", {1, 2, 0}, {-4, 4, 0}, true),
        at_vertex("in the plane, edge upon edge", {2, 0, 0}, {1, -4, 0}, true),
        at_vertex("rises from the vertex", {4, 4, 1}, {5, 4, 1}, false),
        at_vertex("goes through it", {1, 1, 1}, {1, 1, -1}, true),
        at_vertex("is gone through by the other", {9, 9, 1}, {9, 9, -1}, true),
        at_vertex("edge along the inside", {1, 1, 0}, {1, 1, 1}, true),
        at_edge("flat neighbours", {2, -4, 0}, false),
        at_edge("a sharp fold", {2, 4, 1e-3}, false),
        at_edge("folded onto it", {2, 4, 0}, true),
    };
    std::mt19937 random(11);
    for (const Pair& pair : pairs) {
        for (int turn = 0; turn < 24; ++turn) {
            // Rotating the corners and the order, turning about by right angles (which keeps coordinates exact).
            TriangleMesh mesh;
            mesh.points.assign(pair.points.begin(), pair.points.end());
            for (Vector3d& x : mesh.points) {
                for (int i = 0; i < turn % 3; ++i) x = Vector3d(x[1], x[2], x[0]);
                if (turn % 2) x = Vector3d(-x[1], x[0], x[2]);
            }
            mesh.triangles = {{0, 1, 2}, pair.second};
            for (auto& t : mesh.triangles) std::rotate(t.begin(), t.begin() + random() % 3, t.end());
            if (turn % 4 < 2) std::swap(mesh.triangles[0], mesh.triangles[1]);
            const auto found = first_intersection(mesh);
            ASSERT_EQ(found.has_value(), pair.meet) << pair.what << ", turn " << turn;
            EXPECT_EQ(found.value_or(std::pair{0, 1}), (std::pair<std::size_t, std::size_t>(0, 1)));
        }
    }
}

// Against all pairs of a soup of triangles, decided by another way: the line of two planes, cut by both triangles.
TEST(FirstIntersection, ASoupAgreesWithTheIntervalTestOnAllPairs) {
    std::mt19937 random(3);
    const auto uniform = [&] { return double(random()) / 4294967295.0; };
    // The interval that triangle x cuts out of the line of both planes, along its direction; empty: low > high.
    const auto interval = [](const std::array<Vector3d, 3>& x, const Vector3d& normal, double offset,
                             const Vector3d& line) {
        std::pair<double, double> out{HUGE_VAL, -HUGE_VAL};
        for (int i = 0; i < 3; ++i) {
            const Vector3d &a = x[i], &b = x[(i + 1) % 3];
            const double da = normal.dot(a) - offset, db = normal.dot(b) - offset;
            if ((da > 0) == (db > 0)) continue;
            const double t = line.dot(a + (b - a) * da / (da - db));
            out = {std::min(out.first, t), std::max(out.second, t)};
        }
        return out;
    };
    int met = 0;
    for (int trial = 0; trial < 400; ++trial) {
        TriangleMesh soup;
        for (int t = 0; t < 8; ++t) {
            const Vector3d centre(uniform(), uniform(), uniform());
            for (int i = 0; i < 3; ++i) {
                soup.points.push_back(centre + 0.6 * Vector3d(uniform() - .5, uniform() - .5, uniform() - .5));
            }
            soup.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
        }
        std::optional<std::pair<std::size_t, std::size_t>> expected;
        for (std::size_t a = 0; a < 8 && !expected; ++a) {
            for (std::size_t b = a + 1; b < 8 && !expected; ++b) {
                std::array<Vector3d, 3> x, y;
                for (int i = 0; i < 3; ++i) x[i] = soup.points[3 * a + i], y[i] = soup.points[3 * b + i];
                const Vector3d n = (x[1] - x[0]).cross(x[2] - x[0]), m = (y[1] - y[0]).cross(y[2] - y[0]);
                const auto [low, high] = interval(x, m, m.dot(y[0]), n.cross(m));
                const auto [from, to] = interval(y, n, n.dot(x[0]), n.cross(m));
                if (std::max(low, from) <= std::min(high, to)) expected = std::pair{a, b};
            }
        }
        EXPECT_EQ(first_intersection(soup), expected);
        met += expected.has_value();
    }
    EXPECT_GT(met, 100) << "too few soups meet to be a test";
    EXPECT_LT(met, 300) << "too few soups are free to be a test";
}

}  // namespace tubule::surface3d::import_check_test
