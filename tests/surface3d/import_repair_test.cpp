// What is repaired of a mesh, and what is refused, each time for one defect put into a sound mesh.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "surface3d/import/import_check.hpp"
#include "surface3d/import/mesh_smoothing.hpp"
#include "tests/support/message_of.hpp"
#include "tests/surface3d/import_samples.hpp"

namespace tubule::surface3d::import_repair_test {

using namespace samples;
using testing::Test;

ImportedMesh repaired(const TriangleMesh& mesh, bool may_be_open = false) {
    ImportedMesh out = imported(mesh);
    repair_mesh(out, may_be_open);
    return out;
}
std::string refusal(const TriangleMesh& mesh, bool may_be_open = false) {
    return test::message_of<MeshError>([&] { repaired(mesh, may_be_open); });
}
using Notes = std::vector<std::string>;

const TriangleMesh ball = geodesic_sphere(3);  // 180 triangles, 92 vertices

TriangleMesh moved(TriangleMesh mesh, const Vector3d& by, double scale = 1) {
    for (Vector3d& x : mesh.points) x = scale * x + by;
    return mesh;
}
TriangleMesh both(TriangleMesh a, const TriangleMesh& b) {
    const int first = int(a.points.size());
    a.points.insert(a.points.end(), b.points.begin(), b.points.end());
    for (const auto& [i, j, k] : b.triangles) a.triangles.push_back({i + first, j + first, k + first});
    return a;
}

TEST(RepairMesh, LeavesASoundMeshAlone) {
    const ImportedMesh mesh = repaired(ball);
    EXPECT_EQ(mesh.mesh.triangles, ball.triangles);
    EXPECT_EQ(mesh.notes, Notes{});
}

TEST(RepairMesh, DropsUselessTriangles) {
    TriangleMesh mesh = ball;
    mesh.triangles.push_back({0, 1, 0});
    mesh.triangles.push_back(mesh.triangles[7]);
    std::swap(mesh.triangles[7][0], mesh.triangles[7][1]);  // the one that stays faces the other way
    const ImportedMesh out = repaired(mesh);
    EXPECT_EQ(out.mesh.triangles.size(), ball.triangles.size());
    EXPECT_EQ(out.notes, (Notes{"1 triangles with a vertex twice were dropped.", "1 repeated triangles were dropped.",
                                "1 of 180 triangles faced the other way than their neighbours and were turned."}));
    EXPECT_NEAR(mesh_volume(out.mesh), mesh_volume(ball), 1e-12);
}

TEST(RepairMesh, TurnsTrianglesThatFaceTheWrongWay) {
    TriangleMesh mesh = ball;
    for (std::size_t t = 0; t < mesh.triangles.size(); t += 3) std::swap(mesh.triangles[t][0], mesh.triangles[t][1]);
    const ImportedMesh out = repaired(mesh);
    EXPECT_NEAR(mesh_volume(out.mesh), mesh_volume(ball), 1e-12);
    ASSERT_FALSE(out.notes.empty());
    EXPECT_EQ(out.notes[0], "60 of 180 triangles faced the other way than their neighbours and were turned.");
    for (auto& t : mesh.triangles) std::swap(t[0], t[1]);
    EXPECT_NEAR(mesh_volume(repaired(mesh).mesh), mesh_volume(ball), 1e-12);
}

TEST(RepairMesh, DropsSpecksButNoSecondSurface) {
    const ImportedMesh out = repaired(both(ball, moved(geodesic_sphere(1), {3, 0, 0}, 0.05)));
    EXPECT_EQ(out.mesh.triangles, ball.triangles);
    EXPECT_EQ(out.notes,
              Notes{"1 pieces of less than 1 percent of the area of the largest, 20 triangles in all, were dropped."});
    EXPECT_EQ(refusal(both(ball, moved(ball, {3, 0, 0}))),
              "mesh: the mesh consists of 2 separate surfaces: triangle 180 is not connected to triangle 0; a case has "
              "one membrane: keep one of them in the file");
}

const std::string wrapping =
    "shape.wrap = LENGTH, with shape.remesh, puts one surface around everything, closing gaps of that length";

// The second ball is moved so that its vertex 0 lies where the first has vertex 4, and these become one.
TEST(RepairMesh, RefusesVesiclesThatTouchInAVertex) {
    TriangleMesh mesh = both(ball, moved(ball, 2 * ball.points[4]));
    int opposite = 0;
    for (int v = 0; v < int(ball.points.size()); ++v)
        if ((ball.points[v] + ball.points[4]).norm() < 1e-9) opposite = v;
    for (auto& t : mesh.triangles) std::replace(t.begin(), t.end(), opposite + 92, 4);
    const Vector3d x = ball.points[4];
    const std::string message = refusal(mesh);
    EXPECT_NE(
        message.find(fmt::format("meet at vertex 4 ({:.6g}, {:.6g}, {:.6g}), but no fan of triangles around it "
                                 "connects them: two surfaces, or two parts of one, touch there; move them apart, "
                                 "or {}",
                                 x[0], x[1], x[2], wrapping)),
        std::string::npos)
        << message;
}

TEST(RepairMesh, RefusesEdgesOfThreeTriangles) {
    TriangleMesh mesh = ball;
    const auto [a, b, c] = mesh.triangles[10];
    mesh.triangles.push_back({a, b, int(mesh.points.size())});
    mesh.points.push_back(2 * mesh.points[a]);
    const std::string message = refusal(mesh, true);
    EXPECT_EQ(message.find("mesh: non-manifold edge: the edge from vertex "), 0u) << message;
    EXPECT_CONTAINS(message, "belongs to 3 triangles, among them triangle 10, ");
    EXPECT_CONTAINS(message, wrapping);
}

// A band of 9 quadrilaterals, closed with a half turn.
TEST(RepairMesh, RefusesASurfaceOfOneSide) {
    TriangleMesh band;
    const int n = 9;
    for (int i = 0; i < n; ++i)
        for (const double side : {-0.3, 0.3}) {
            const double u = 2 * std::numbers::pi * i / n;
            const double r = 1 + side * std::cos(u / 2);
            band.points.emplace_back(r * std::cos(u), r * std::sin(u), side * std::sin(u / 2));
        }
    for (int i = 0; i < n; ++i) {
        const int a = 2 * i, b = a + 1, c = i + 1 < n ? a + 2 : 1, d = i + 1 < n ? a + 3 : 0;
        band.triangles.push_back({a, c, b}), band.triangles.push_back({b, c, d});
    }
    const std::string message = refusal(band, true);
    EXPECT_EQ(message.find("mesh: the surface has only one side, like a Moebius strip: triangle "), 0u) << message;
}

TEST(RepairMesh, KeepsHolesOnlyWhereTheyMayBe) {
    TriangleMesh mesh = ball;
    mesh.triangles.erase(mesh.triangles.begin() + 5);
    const std::string message = refusal(mesh);
    EXPECT_EQ(message.find("mesh: the mesh is open: the edge from vertex "), 0u) << message;
    EXPECT_CONTAINS(message,
                    "belongs to no other triangle (3 such edges); if the surface is closed there, shape.weld "
                    "joins vertices that are near each other; shape.fill_holes = true, with shape.remesh, "
                    "closes holes");
    EXPECT_EQ(repaired(mesh, true).mesh.triangles.size(), 179u);
}

// Two holes that touch in a vertex: triangles on opposite sides of it.
TEST(RepairMesh, TakesBordersApartThatTouch) {
    TriangleMesh mesh = geodesic_sphere(4);
    std::vector<std::size_t> around;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        if (std::ranges::count(mesh.triangles[t], 20) > 0) around.push_back(t);
    ASSERT_EQ(around.size(), 6u);
    const auto share = [&](std::size_t s, std::size_t t) {
        int common = 0;
        for (const int v : mesh.triangles[s]) common += int(std::ranges::count(mesh.triangles[t], v));
        return common;
    };
    std::size_t other = 0;  // shares no more than the vertex, and no neighbour
    for (const std::size_t t : around) {
        if (share(t, around[0]) > 1 || t == around[0]) continue;
        int joined = 0;
        for (const std::size_t s : around) joined += share(s, t) == 2 && share(s, around[0]) == 2;
        if (joined == 0) other = t;
    }
    ASSERT_GT(other, around[0]);
    mesh.triangles.erase(mesh.triangles.begin() + long(other));
    mesh.triangles.erase(mesh.triangles.begin() + long(around[0]));
    const ImportedMesh out = repaired(mesh, true);
    EXPECT_EQ(out.mesh.points.size(), mesh.points.size() + 1);
    EXPECT_EQ(out.notes, Notes{"At 1 vertices borders touched; they were taken apart."});
}

TEST(RepairMesh, RefusesTrianglesWithoutArea) {
    TriangleMesh mesh;
    mesh.points = {{0, 0, 0}, {1, 0, 0}};
    mesh.triangles = {{0, 1, 0}};
    EXPECT_EQ(refusal(mesh), "mesh: no triangle has an area");
}

}  // namespace tubule::surface3d::import_repair_test
