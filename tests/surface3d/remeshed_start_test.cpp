// From rough meshes to smooth surfaces: number of triangles, volume, distances from exactly known surfaces, notes,
// refusals; and the single steps that CGAL takes. Built with CGAL alone.
#include "surface3d/run/remeshed_start.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "surface3d/curvature/curvature.hpp"
#include "surface3d/import/import_cgal.hpp"
#include "surface3d/import/import_check.hpp"
#include "surface3d/import/mesh_distance.hpp"
#include "surface3d/import/mesh_smoothing.hpp"
#include "surface3d/motion/extent.hpp"
#include "tests/support/message_of.hpp"
#include "tests/surface3d/import_samples.hpp"

namespace tubule::surface3d::remeshed_start_test {

using namespace samples;

const Surface ellipsoid{.axes = {1, 0.8, 0.6}};

double uniform(std::mt19937& random) {
    return double(random()) / 4294967295.0;
}

// Every vertex displaced in all directions, of this standard deviation in mean edges.
TriangleMesh noisy(TriangleMesh mesh, double deviation, unsigned seed = 1) {
    const double edge = even_edge(mesh_area(mesh), double(mesh.triangles.size()));
    std::mt19937 random(seed);
    for (Vector3d& x : mesh.points)
        for (double& coordinate : x) {
            double sum = -6;
            for (int i = 0; i < 12; ++i) sum += uniform(random);
            coordinate += deviation * edge * sum;
        }
    return mesh;
}

// The surface where value(x) = 0, from the values on a grid of n^3 cubes of [-a, a]^3, each cut into six tetrahedra:
// thin triangles, and tiny ones where it comes near a point of the grid.
template <class Value>
TriangleMesh contoured(const Value& value, double a, int n) {
    TriangleMesh mesh;
    std::map<std::pair<int, int>, int> number;
    const auto id = [&](int i, int j, int k) { return (i * (n + 1) + j) * (n + 1) + k; };
    std::vector<double> at;
    const auto place = [&](int v) -> Vector3d {
        return Vector3d(v / (n + 1) / (n + 1), v / (n + 1) % (n + 1), v % (n + 1)) * (2 * a / n) -
               Vector3d::Constant(a);
    };
    for (int v = 0; v < (n + 1) * (n + 1) * (n + 1); ++v) at.push_back(value(place(v)));
    const auto cut = [&](int u, int v) {
        const auto [it, added] = number.try_emplace(std::minmax(u, v), int(mesh.points.size()));
        const double t = at[u] / (at[u] - at[v]);
        if (added) mesh.points.push_back((1 - t) * place(u) + t * place(v));
        return it->second;
    };
    const auto add = [&](int p, int q, int r, const Vector3d& outward) {
        const Vector3d normal = (mesh.points[q] - mesh.points[p]).cross(mesh.points[r] - mesh.points[p]);
        if (normal.dot(outward) < 0) std::swap(q, r);
        mesh.triangles.push_back({p, q, r});
    };
    const auto tetrahedron = [&](const std::array<int, 4>& corner) {
        std::vector<int> in, out;
        Vector3d outward = Vector3d::Zero();
        for (const int v : corner) (at[v] < 0 ? in : out).push_back(v);
        if (in.empty() || out.empty()) return;
        for (const int v : in) outward -= place(v) / double(in.size());
        for (const int v : out) outward += place(v) / double(out.size());
        if (in.size() == 2) {
            const int p = cut(in[0], out[0]), q = cut(in[0], out[1]), r = cut(in[1], out[1]), s = cut(in[1], out[0]);
            add(p, q, r, outward), add(p, r, s, outward);
        } else {
            const std::vector<int>&one = in.size() == 1 ? in : out, &three = in.size() == 1 ? out : in;
            add(cut(one[0], three[0]), cut(one[0], three[1]), cut(one[0], three[2]), outward);
        }
    };
    const int steps[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j)
            for (int k = 0; k < n; ++k)
                for (const auto& step : steps) {
                    std::array<int, 3> x{i, j, k};
                    std::array<int, 4> corner{id(i, j, k)};
                    for (int s = 0; s < 3; ++s) ++x[step[s]], corner[s + 1] = id(x[0], x[1], x[2]);
                    tetrahedron(corner);
                }
    return mesh;
}

double distance_from(const CurvedMesh& mesh, const Surface& surface) {
    double most = 0;
    for (const Vector3d& x : mesh.nodes) most = std::max(most, std::abs(surface.value(x)) / surface.gradient(x).norm());
    return most;
}
double volume_of(const CurvedMesh& mesh) {
    return extent(SurfaceSpace(mesh), mesh).volume;
}
RemeshedStart start_of(const TriangleMesh& mesh, const MeshFile& options, int order = 3) {
    return remeshed_start(imported(mesh), options, order);
}
std::string refusal(const TriangleMesh& mesh, const MeshFile& options) {
    return test::message_of<MeshError>([&] { start_of(mesh, options); });
}
bool has(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

// Marching tetrahedra of a field with noise. The smooth ellipsoid is met to a hundredth of its size, sqrt(8) = 2.83,
// the volume is that of the mesh given.
TEST(NewTriangles, FromANoisyContour) {
    std::mt19937 random(5);
    const TriangleMesh mesh =
        contoured([&](const Vector3d& x) { return ellipsoid.value(x) + 0.04 * (uniform(random) - 0.5); }, 1.2, 24);
    const RemeshedStart start = start_of(mesh, {.path = "", .remesh = 400});
    EXPECT_NEAR(start.surface.triangles(), 400, 20);
    EXPECT_NEAR(volume_of(start.surface) / mesh_volume(mesh), 1, 1e-9);
    EXPECT_LT(distance_from(start.surface, ellipsoid), 0.01);
    ASSERT_EQ(start.notes.size(), 2u);
    EXPECT_TRUE(has(start.notes[0], fmt::format("{} new triangles instead of {}, smoothed over ",
                                                start.surface.triangles(), mesh.triangles.size())))
        << start.notes[0];
    EXPECT_TRUE(has(start.notes[1], "The initial shape is at most ")) << start.notes[1];
}

// Noise so strong that triangles turn over and intersect, which is no reason to refuse them: it is smoothed away.
TEST(NewTriangles, NoiseOfAFifthOfAnEdge) {
    const TriangleMesh mesh = noisy(irregular(ellipsoid, 16), 0.2);
    EXPECT_TRUE(has(test::message_of<MeshError>([&] {
                        ImportedMesh raw = imported(mesh);
                        close_mesh(raw);
                    }),
                    "intersects itself"));
    const RemeshedStart start = start_of(mesh, {.path = "", .remesh = 400, .smoothing_length = 1.0});
    EXPECT_LT(distance_from(start.surface, ellipsoid), 0.025);
    EXPECT_NEAR(volume_of(start.surface) / mesh_volume(mesh), 1, 1e-9);
}

// 980 triangles for bumps of a third of the radius, with noise: a decimated scan.
TEST(NewTriangles, FromACoarseIrregularMesh) {
    const Surface bumpy{.axes = {1, 1, 1}, .bump = 0.3};
    const TriangleMesh mesh = noisy(irregular(bumpy, 7), 0.05);
    for (const int order : {2, 4}) {
        const RemeshedStart start = start_of(mesh, {.path = "", .remesh = 500}, order);
        const CurvedMesh surface = start.of_order(order);
        EXPECT_EQ(surface.order, order);
        EXPECT_NEAR(surface.triangles(), 500, 25);
        EXPECT_NEAR(volume_of(surface) / mesh_volume(mesh), 1, 1e-9);
        EXPECT_LT(distance_from(surface, bumpy), 0.06);
    }
}

// The stated distance is the larger one of both directions, so no node is farther from the file.
TEST(NewTriangles, StatesItsDistance) {
    const TriangleMesh mesh = geodesic_sphere(4);
    const RemeshedStart start = start_of(mesh, {.path = "", .remesh = 300});
    double stated = 0;
    ASSERT_EQ(std::sscanf(start.notes.back().c_str(), "The initial shape is at most %lf from the file", &stated), 1);
    const MeshDistance distance(mesh);
    double most = 0;
    for (const Vector3d& x : start.surface.nodes) most = std::max(most, distance(x));
    EXPECT_GE(stated, most * (1 - 1e-2));
    EXPECT_LT(stated, 1.5 * most + 0.02);
}

TEST(NewTriangles, CreasesAreRoundedAndSaidToBe) {
    TriangleMesh cube;
    for (int v = 0; v < 8; ++v) cube.points.emplace_back(v & 1, v >> 1 & 1, v >> 2);
    const int face[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    for (const auto& f : face)
        cube.triangles.push_back({f[0], f[1], f[2]}), cube.triangles.push_back({f[0], f[2], f[3]});
    const RemeshedStart start = start_of(cube, {.path = "", .remesh = 600});
    EXPECT_NEAR(volume_of(start.surface), 1, 1e-9);
    EXPECT_TRUE(has(start.notes.back(),
                    "The file has 12 creases (edges kinked by more than 45 degrees, up to 90), which "
                    "are rounded over the length of smoothing; away from them it is at most "))
        << start.notes.back();
}

TEST(NewTriangles, HolesAreFilledWhenAsked) {
    TriangleMesh mesh = geodesic_sphere(8);
    std::erase_if(mesh.triangles, [&](const auto& t) {
        return (mesh.points[t[0]] + mesh.points[t[1]] + mesh.points[t[2]])[2] > 3 * 0.93;
    });
    EXPECT_TRUE(has(refusal(mesh, {.path = "", .remesh = 300}), "the mesh is open"))
        << refusal(mesh, {.path = "", .remesh = 300});
    const RemeshedStart start = start_of(mesh, {.path = "", .remesh = 300, .fill_holes = true});
    EXPECT_TRUE(has(start.notes[0], "1 holes were filled; the longest border, at (")) << start.notes[0];
    // Fairing continues the sphere into the hole, whose flat cover would be 0.07 below it.
    EXPECT_LT(distance_from(start.surface, {}), 0.03);
}

// A ball in 20 pieces that do not join: their triangles shrunk towards their centres. The volume of what encloses them
// is that of the ball, to the width of the gaps.
TEST(NewTriangles, WrapsWhatIsNoSurface) {
    TriangleMesh soup;
    const TriangleMesh ball = geodesic_sphere(4);
    for (const auto& t : ball.triangles) {
        const Vector3d centre = (ball.points[t[0]] + ball.points[t[1]] + ball.points[t[2]]) / 3;
        const int first = int(soup.points.size());
        for (const int v : t) soup.points.push_back(centre + 0.9 * (ball.points[v] - centre));
        soup.triangles.push_back({first, first + 1, first + 2});
    }
    EXPECT_TRUE(has(refusal(soup, {.path = "", .remesh = 200}), "mesh: "))
        << refusal(soup, {.path = "", .remesh = 200});
    const RemeshedStart start = start_of(soup, {.path = "", .remesh = 200, .wrap = 0.2});
    EXPECT_TRUE(has(start.notes[0], "was wrapped around the 320 of the file; gaps narrower than 0.2 are closed"))
        << start.notes[0];
    EXPECT_LT(distance_from(start.surface, {}), 0.05);
}

// Nothing ends a wrapping once it runs.
TEST(NewTriangles, RefusesToWrapForHours) {
    TriangleMesh ball = geodesic_sphere(4);
    ball.points[7] = {1e9, 0, 0};
    const std::string message = refusal(ball, {.path = "", .remesh = 100, .wrap = 0.3});
    EXPECT_TRUE(has(message, "mesh: shape.wrap = 0.3 is too small for a surface of area ")) << message;
    EXPECT_TRUE(has(message, "; try shape.wrap = ")) << message;
}

TEST(NewTriangles, RefusesASheet) {
    TriangleMesh pillow = geodesic_sphere(6);
    for (Vector3d& x : pillow.points) x[2] *= 1e-4;
    const std::string message = refusal(pillow, {.path = "", .remesh = 200});
    EXPECT_TRUE(has(message, "the surface encloses next to nothing: a volume of ")) << message;
}

// Through each other for a third of their radius: no noise.
TEST(NewTriangles, RefusesABodyThatCrossesItself) {
    const std::string message = refusal(bent_body(-0.5), {.path = "", .remesh = 600});
    EXPECT_TRUE(has(message, "parts of the surface that are far from each other along it intersect at (")) << message;
    EXPECT_TRUE(has(message, "; move them apart in the file, or shape.wrap = LENGTH joins them")) << message;
}

TEST(NewTriangles, RefusesWhatTheyCannotResolve) {
    const Surface disc{.axes = {1, 1, 0.05}};
    const std::string message = refusal(irregular(disc, 16), {.path = "", .remesh = 100, .smoothing_length = 0.01});
    EXPECT_TRUE(has(message, "mesh: smoothed over 0.01, ")) << message;
    EXPECT_TRUE(has(message, "try shape.remesh = 200, or shape.smoothing_length = 0.02")) << message;
}

TEST(NewTriangles, OfEqualEdges) {
    const TriangleMesh mesh = cgal::isotropic(irregular({}, 10), 0.2);
    const double wanted = 4 * std::numbers::pi / (std::sqrt(3.0) / 4 * 0.04);
    EXPECT_NEAR(double(mesh.triangles.size()) / wanted, 1, 0.15);
    ImportedMesh out = imported(mesh);
    EXPECT_EQ(close_mesh(out).genus, 0);
    for (const auto& t : mesh.triangles)
        for (int i = 0; i < 3; ++i) {
            const double edge = (mesh.points[t[i]] - mesh.points[t[(i + 1) % 3]]).norm();
            EXPECT_GT(edge, 0.1);
            EXPECT_LT(edge, 0.3);
        }
    for (const Vector3d& x : mesh.points) EXPECT_NEAR(x.norm(), 1, 0.01);  // on the triangles of the file
}

}  // namespace tubule::surface3d::remeshed_start_test
