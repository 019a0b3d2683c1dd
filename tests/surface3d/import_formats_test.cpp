// Mesh files: every format gives the mesh that was written, and every refusal has its place and its words. Lines,
// columns and bytes are counted by hand.
#include "surface3d/import/import_formats.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "tests/surface3d/import_files.hpp"
#include "tests/surface3d/import_samples.hpp"

namespace tubule::surface3d::import_formats_test {

using namespace samples;

// What read_mesh refuses with, without the directory; "accepted" if it does not.
std::string refusal(const TemporaryDirectory& directory, const std::string& name, const std::string& contents,
                    double weld = 0) {
    try {
        read_mesh(directory.write(name, contents), weld);
    } catch (const MeshError& error) {
        const std::string message = error.what(), prefix = directory.path().string() + "/";
        return message.starts_with(prefix) ? message.substr(prefix.size()) : message;
    }
    return "accepted";
}

struct Refused {
    std::string contents, message;
};

void expect_refusals(const std::string& name, const std::vector<Refused>& cases) {
    const TemporaryDirectory directory;
    for (const auto& [contents, message] : cases) EXPECT_EQ(refusal(directory, name, contents), name + message);
}

ImportedMesh read(const std::string& name, const std::string& contents, double weld = 0) {
    const TemporaryDirectory directory;
    return read_mesh(directory.write(name, contents), weld);
}

// A mesh of one face (or several) is enough for a reader.
const std::string three = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
using Triangles = std::vector<std::array<int, 3>>;

class RoundTrip : public testing::Test {
protected:
    const TriangleMesh scan = irregular({.axes = {1, 1, 1}, .bump = 0.3}, 22);  // 9680 triangles
};

TEST_F(RoundTrip, FormatsWithVerticesGiveTheSameVerticesAndTriangles) {
    const std::vector<std::pair<std::string, std::string>> files{
        {"scan.obj", obj(scan)},
        {"scan.OFF", off(scan)},
        {"ascii.ply", ply(scan, "ascii")},
        {"little.ply", ply(scan, "binary_little_endian")},
        {"big.Ply", ply(scan, "binary_big_endian")},
    };
    for (const auto& [name, contents] : files) {
        const ImportedMesh read_back = read(name, contents);
        EXPECT_EQ(read_back.mesh.points, scan.points) << name;
        EXPECT_EQ(read_back.mesh.triangles, scan.triangles) << name;
        EXPECT_TRUE(read_back.notes.empty()) << name;
    }
}

TEST_F(RoundTrip, StlVerticesAreMergedAgain) {
    for (const bool ascii : {true, false}) {
        const ImportedMesh read_back = read("scan.stl", ascii ? stl_ascii(scan) : stl_binary(scan));
        ASSERT_EQ(read_back.mesh.points.size(), scan.points.size());
        ASSERT_EQ(read_back.mesh.triangles.size(), scan.triangles.size());
        for (std::size_t t = 0; t < scan.triangles.size(); ++t) {
            for (int i = 0; i < 3; ++i) {
                const Vector3d expected = scan.points[scan.triangles[t][i]];
                const Vector3d point = read_back.mesh.points[read_back.mesh.triangles[t][i]];
                EXPECT_LE((point - expected).norm(), ascii ? 0 : 1e-6);  // binary STL has float coordinates
            }
        }
    }
}

TEST(Obj, NegativeNumbersContinuationsMacLinesAndByteOrderMark) {
    const ImportedMesh mesh = read("a.obj",
                                   "\xEF\xBB\xBFv +0 0 0 1.0\rv 1e0 0 0\rv \\\r 0 1 0\rg part\rs off\rusemtl red\r"
                                   "f -3 -2 \\\r-1\r# end");
    EXPECT_EQ(mesh.mesh.points, (std::vector<Vector3d>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
    EXPECT_EQ(mesh.mesh.triangles, (Triangles{{0, 1, 2}}));
}

TEST(Obj, FacesMayComeBeforeTheirVertices) {
    EXPECT_EQ(read("a.obj", "f 1 2 3\n" + three).mesh.triangles, (Triangles{{0, 1, 2}}));
}

// The pentagon (0,0) (2,0) (2,2) (1,0.5) (0,2) has a dent at its fourth corner, seen from all of its three triangles.
TEST(Obj, PolygonsAreCutWithinThemselves) {
    const ImportedMesh mesh = read("a.obj", "v 0 0 5\nv 2 0 5\nv 2 2 5\nv 1 0.5 5\nv 0 2 5\nf 1 2 3 4 5\n");
    ASSERT_EQ(mesh.mesh.triangles.size(), 3u);
    double area = 0;
    for (const auto& t : mesh.mesh.triangles) {
        EXPECT_EQ(std::count(t.begin(), t.end(), 3), 1) << "a triangle without the dent crosses it";
        const Vector3d& x = mesh.mesh.points[t[0]];
        const Vector3d twice = (mesh.mesh.points[t[1]] - x).cross(mesh.mesh.points[t[2]] - x);
        EXPECT_GT(twice[2], 0) << "orientation is kept";
        area += twice[2] / 2;
    }
    EXPECT_NEAR(area, 4 - 1.5, 1e-14);  // the square less the triangle (2,2) (1,0.5) (0,2)
}

TEST(Obj, QuadrilateralsAreCutAlongTheBetterDiagonal) {
    // A rhombus of diagonals 1 and 4: the short one leaves wider angles.
    const ImportedMesh mesh = read("a.obj", "v -2 0 0\nv 0 -.5 0\nv 2 0 0\nv 0 .5 0\nf 1 2 3 4\n");
    ASSERT_EQ(mesh.mesh.triangles.size(), 2u);
    for (const auto& t : mesh.mesh.triangles) {
        EXPECT_EQ(std::count(t.begin(), t.end(), 1) + std::count(t.begin(), t.end(), 3), 2);
    }
}

TEST(Obj, Refusals) {
    expect_refusals(
        "a.obj",
        {{"v 0 0 zero\n", ":1:7: 'zero' is not a number"},
         {"v 0 0 0,5\n", ":1:7: '0,5' is not a number; decimals have a point: 0.5"},
         {"v 0 0 0\r\nv 0 nan 0\r\n", ":2:5: 'nan' is not a finite number"},
         {"v 1 2\n", ":1:1: a point needs three coordinates"},
         {three + "f 1 2\n", ":4:1: a face needs three vertices"},
         {three + "f 1 0 2\n", ":4:5: OBJ counts vertices from 1, or back from -1; there is no vertex 0"},
         {three + "f 1 2 -4\n", ":4:7: vertex -4 counts back from the end, but only 3 vertices have been read so far"},
         {three + "f 1/1 2/1 9/1\n", ":4:11: the face uses vertex 9, but vertices are numbered 1 to 3"},
         {three + "f 1 2 1\n", ":4:7: degenerate face: vertex 1 occurs twice"},
         {three + "f 1 2 3.5\n", ":4:7: '3.5' is not an integer"},
         {three + "f 1 2 3/x\n", ":4:7: 'x' is not an integer"},
         {three + "  curv 0 1 2\n", ":4:3: cannot read 'curv': only vertices and flat faces (v, f) are supported"},
         {three + "v 1 1 0\nf 1 4 2 3\n", ":5:3: a face of 4 vertices crosses itself or has no area"},
         {three, ": the file contains no faces"}});
}

TEST(Off, Refusals) {
    const std::string head = "OFF\n# a comment\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n";
    expect_refusals("a.off",
                    {{"3 1 0\n", ":1:1: an OFF file begins with the word OFF"},
                     {"\n# nothing\n", ":3:1: the file ends; expected the word OFF; is it complete?"},
                     {"4OFF\n3 1 0\n", ":1:1: only three-dimensional OFF is supported"},
                     {"OFF BINARY\n", ":1:1: binary OFF is not supported"},
                     {"OFF\n", ":2:1: the file ends; expected the numbers of vertices and faces; is it complete?"},
                     {"OFF 3\n", ":1:5: expected the numbers of vertices, faces (and edges)"},
                     {"OFF\n-3 1 0\n", ":2:1: the number of vertices must not be negative"},
                     {"OFF\n3 -1 0\n", ":2:3: the number of faces must not be negative"},
                     {"OFF 3 1 0\n0 0 0\n1 0 0", ":4:1: the file ends; expected vertex 2 of 3; is it complete?"},
                     {"OFF 3 1 0\n0 0\n", ":2:1: a point needs three coordinates"},
                     {head, ":7:1: the file ends; expected face 0 of 1; is it complete?"},
                     {head + "2 0 1\n", ":7:1: a face needs three vertices, this one has 2"},
                     {head + "4 0 1 2\n",
                      ":7:1: the line has fewer than the 4 vertices of this face, 0 of 1; is the file complete?"},
                     {"OFF\n4 2 0\n0 0 0\n1 0 0\n3 0 1 2\n",
                      ":5:1: vertex 2 has four numbers, as a face: are the numbers of vertices and faces, 4 and 2, "
                      "swapped in the header?"},
                     {head + "3 0 1 3\n", ":7:7: the face uses vertex 3, but vertices are numbered 0 to 2"},
                     {head + "3 0 1 2\n3 0 2 1\n", ":8:1: the file continues after its 1 faces"}});
}

// A PLY header of three vertices (float x y z) and one face, with one line exchanged.
std::string ply_head(const std::string& old_line = "", const std::string& new_line = "") {
    std::string head =
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 1\nproperty list uchar int vertex_index\nend_header\n";
    return old_line.empty() ? head : head.replace(head.find(old_line), old_line.size(), new_line);
}

TEST(Ply, Refusals) {
    const std::string points = "0 0 0\n1 0 0\n0 1 0\n";
    expect_refusals(
        "a.ply",
        {{"solid\n", ":1:1: a PLY file begins with the word ply"},
         {"ply\nformat ascii 1.0\n", ":3:1: the file ends; expected end_header; is it complete?"},
         {ply_head("ascii", "utf8"),
          ":9:1: the header must name a format (ascii, binary_little_endian or binary_big_endian)"},
         {ply_head("float y", "real y"), ":5:10: unknown type 'real'"},
         {ply_head("uchar int", "float int"), ":8:15: the length of a list must have an integer type"},
         {ply_head("float y", "float"), ":5:1: a property needs a type and a name"},
         {ply_head("element vertex 3", "element vertex many"), ":3:16: 'many' is not an integer"},
         {ply_head("element vertex 3", "element vertex -3"), ":3:16: the count must not be negative"},
         {ply_head("element vertex 3", "elements vertex 3"), ":3:1: not a line of a PLY header"},
         {ply_head("property list uchar int vertex_index\n", ""), ":8:1: element face has no properties"},
         {ply_head("face", "tristrips"), ":9:1: triangle strips are not supported; write faces instead"},
         {ply_head("float y", "float b"), ":9:1: the header needs one element 'vertex' with properties x, y and z"},
         {ply_head("vertex_index", "corners"),
          ":9:1: the header needs one element 'face' with one list vertex_indices (or vertex_index)"},
         {ply_head("uchar int", "uchar float"), ":9:1: the vertex indices of faces must have an integer type"},
         {ply_head() + "0 0 0\n1 0 inf\n", ":11:5: 'inf' is not a finite number"},
         {ply_head() + "0 0 0\n1 0 0\n", ":12:1: the file ends; expected vertex 2 of 3; is it complete?"},
         {ply_head() + points + "3 0 1\n", ":14:1: the file ends; expected face 0 of 1; is it complete?"},
         {ply_head() + points + "2 0 1\n", ":13:1: a face needs three vertices, this one has 2"},
         {ply_head() + points + "3 0 1 7\n", ":13:7: the face uses vertex 7, but vertices are numbered 0 to 2"},
         {ply_head() + points + "3 0 1 2\n3 0 2 1\n",
          ":14:1: the file continues after the elements that its header declares"}});
}

TEST(Ply, BinaryRefusalsNameTheByte) {
    const std::string head = ply_head("ascii", "binary_little_endian");
    const std::size_t begin = head.size();  // vertices of 12 bytes, then 1 + 3 * 4
    const auto body = [](float z, std::uint8_t corners, std::int32_t last) {
        std::string out;
        for (const float x : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, z}) out += bytes(x);
        return out + bytes(corners) + bytes(0) + bytes(1) + bytes(last);
    };
    const auto byte = [&](std::size_t n) { return fmt::format(": byte {}: ", begin + n); };
    const std::string good = head + body(0, 3, 2);
    EXPECT_EQ(read("a.ply", good + "\n").mesh.triangles, (Triangles{{0, 1, 2}}));
    expect_refusals("a.ply",
                    {{good.substr(0, begin + 30), byte(30) + "the file ends; expected vertex 2 of 3"},
                     {good.substr(0, begin + 45), byte(45) + "the file ends; expected face 0 of 1"},
                     {head + body(NAN, 3, 2), byte(32) + "a coordinate is not a finite number"},
                     {head + body(0, 2, 2), byte(36) + "a face needs three vertices, this one has 2"},
                     {head + body(0, 3, -1), byte(45) + "the face uses vertex -1, but vertices are numbered 0 to 2"},
                     {good + "x", byte(49) + "the file continues after the elements that its header declares"}});
}

TEST(Stl, SeveralSolidsAndAnyCase) {
    const std::string facet =
        "FACET NORMAL 0 0 1\nOUTER LOOP\nVERTEX 0 0 0\nVERTEX 1 0 0\nVERTEX 0 {} 0\nENDLOOP\nENDFACET\n";
    const std::string text = "SOLID one\n" + fmt::format(fmt::runtime(facet), 1) + "ENDSOLID\nSolid two\n" +
                             fmt::format(fmt::runtime(facet), -1) + "EndSolid two\n";
    EXPECT_EQ(read("a.stl", text).mesh.triangles, (Triangles{{0, 1, 2}, {0, 1, 3}}));
}

TEST(Stl, Refusals) {
    const std::string begin = "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n";
    expect_refusals(
        "a.stl",
        {{"solid\n", ":2:1: the file ends; expected 'facet' or 'endsolid'; is it complete?"},
         {begin, ":6:1: the file ends; expected 'vertex'; is it complete?"},
         {begin + "vertex 0 1 0 1\n", ":6:14: a point has three coordinates"},
         {begin + "vertex 0 1\n", ":6:1: a point needs three coordinates"},
         {begin + "vertex 0 1 0\nvertex 1 1 0\n", ":7:1: expected 'endloop'"},
         {"solid\nfacet normal 0 0 1\nouter ring\n", ":3:1: expected 'outer loop'"},
         {"solid\nface\n", ":2:1: expected 'facet' or 'endsolid'"},
         {"solid\nendsolid\nfacet\n", ":3:1: expected 'solid'"},
         {"solid\nendsolid\n", ": the file contains no faces"},
         {"stl",
          ": byte 3: not an STL file: it neither begins with 'solid' nor has the 84-byte header of binary STL"}});
    TriangleMesh mesh;
    mesh.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 1}};
    const std::string good = stl_binary(mesh);
    mesh.points[2][1] = NAN;
    expect_refusals("a.stl",
                    {{good.substr(0, 150),
                      ": byte 80: the header declares 2 facets, which need 184 bytes, but the file has "
                      "150"},
                     {stl_binary(mesh), ": byte 124: a coordinate is not a finite number"}});  // 84 + 12 + 2 * 12 + 4
}

// A sphere by latitudes, 4 points each, as programs write it: each pole is there four times, in quadrilaterals cut into
// two triangles. Half of these at the poles have no area.
TEST(ReadMesh, WeldsPolesThatAreThereSeveralTimes) {
    std::string text;
    for (const double z : {-1.0, 0.0, 1.0})
        for (int j = 0; j < 4; ++j) {
            const double r = z == 0 ? 1 : 0, x = j % 2 == 0 ? 1 - j : 0, y = j % 2 == 1 ? 2 - j : 0;
            text += fmt::format("v {} {} {}\n", r * x, r * y, z);
        }
    for (int i = 0; i < 2; ++i)
        for (int j = 0; j < 4; ++j) {
            const int a = 4 * i + j + 1, b = 4 * i + (j + 1) % 4 + 1;
            text += fmt::format("f {} {} {}\nf {} {} {}\n", a, b, b + 4, a, b + 4, a + 4);
        }
    EXPECT_EQ(read("poles.obj", text).mesh.triangles.size(), 16u);  // all are kept, to be refused by name
    const ImportedMesh welded = read("poles.obj", text, 1e-6);
    EXPECT_EQ(welded.mesh.triangles.size(), 8u);
    EXPECT_EQ(welded.mesh.points.size(), 6u);
    EXPECT_EQ(welded.notes,
              std::vector<std::string>{"8 triangles collapsed when vertices were welded, and were dropped."});
}

TEST(ReadMesh, RefusesWhatIsNoMeshFile) {
    const TemporaryDirectory directory;
    const auto message = [&](const std::string& name, double weld = 0) -> std::string {
        try {
            read_mesh(directory.path() / name, weld);
        } catch (const MeshError& error) {
            return std::string(error.what()).substr(directory.path().string().size() + 1);
        }
        return "accepted";
    };
    EXPECT_EQ(message("none.obj"), "none.obj: cannot be opened: No such file or directory");
    EXPECT_EQ(message("scan.vtk"), "scan.vtk: the extension must be .obj, .off, .ply or .stl");
    std::filesystem::create_directory(directory.path() / "folder.obj");
    EXPECT_EQ(message("folder.obj"), "folder.obj: is a directory: give a file in it");
    directory.write("empty.ply", "");
    directory.write("bare.off", "OFF 0 1 0\n3 0 1 2\n");
    EXPECT_EQ(message("bare.off"), "bare.off: the file contains no vertices");
    for (const char* size : {"1e100", "1e160", "1e-100"}) {  // the cube of their areas is no number
        directory.write("far.obj", fmt::format("v 0 0 0\nv {0} 0 0\nv 0 {0} 0\nf 1 2 3\n", size));
        EXPECT_EQ(message("far.obj").find("far.obj: the largest coordinate is 1e"), 0u);
    }
    ASSERT_EQ(mkfifo((directory.path() / "pipe.obj").c_str(), 0600), 0);
    EXPECT_EQ(message("pipe.obj"), "pipe.obj: is a pipe or a device, not a file: save its contents to a file first");
    directory.write("huge.obj", "");
    std::filesystem::resize_file(directory.path() / "huge.obj", 1ull << 40);  // takes no room on the disk
    EXPECT_EQ(message("huge.obj"), "huge.obj: is larger than 512 MB, the most that is read");
    EXPECT_EQ(message("empty.ply"), "empty.ply: is empty");
    directory.write("a.obj", three + "f 1 2 3\n");
    EXPECT_EQ(message("a.obj", -1), "a.obj: weld must be a number >= 0, not -1");
    EXPECT_EQ(message("a.obj", NAN), "a.obj: weld must be a number >= 0, not nan");
    EXPECT_EQ(message("a.obj", 1e-16), "a.obj: weld = 1e-16 is below the rounding error of coordinates as large as 1");
}

TEST(ReadMesh, RefusesFacesOfTooManyVertices) {
    std::string points, face = "f";
    for (int i = 1; i <= 1001; ++i) {
        points += fmt::format("v {} {} 0\n", std::cos(i * 0.006), std::sin(i * 0.006));
        face += fmt::format(" {}", i);
    }
    expect_refusals("a.obj", {{points + face + "\n",
                               ":1002:3: a face has 1001 vertices; polygons of at most 1000 can be triangulated"}});
}

// OBJ announces no counts, so a cut one is found only when the surface is checked: it is open.
TEST(ReadMesh, ACutFileIsRefusedWhereverItIsCut) {
    const TriangleMesh mesh = geodesic_sphere(1);
    struct {
        FileMesh (*read)(const std::string&, std::string_view);
        std::string whole;
    } const files[]{
        {read_off, off(mesh)},
        {read_ply, ply(mesh, "ascii")},
        {read_ply, ply(mesh, "binary_little_endian")},
        {read_ply, ply(mesh, "binary_big_endian")},
        {read_stl, stl_ascii(mesh)},
        {read_stl, stl_binary(mesh)},
    };
    for (const auto& [read_format, whole] : files) {
        std::size_t refused = 0;
        for (std::size_t size = 0; size < whole.size(); ++size) {
            try {
                const FileMesh part = read_format("a", std::string_view(whole).substr(0, size));
                EXPECT_EQ(part.faces.size(), mesh.triangles.size()) << whole.substr(0, 30) << "... cut at " << size;
            } catch (const MeshError&) {
                ++refused;
            }
        }
        // A last colour that loses a digit, or a last line end, is not missed.
        EXPECT_GE(refused, whole.size() - 10);
    }
}

TEST(Weld, EqualPlacesBecomeOneVertexInEveryFormat) {
    const ImportedMesh mesh =
        read("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv -0 0 0\nv 1 0 0\nv 0 0 1\nf 1 2 3\nf 4 6 5\n");
    EXPECT_EQ(mesh.mesh.triangles, (Triangles{{0, 1, 2}, {0, 3, 1}}));
    EXPECT_EQ(mesh.vertex_number, (std::vector<std::int64_t>{1, 2, 3, 6}));
}

// The bumpy scan as STL with every corner off by its own 1e-5: 3 * 9680 vertices, until welded.
TEST(Weld, NearPlacesBecomeOneVertexWithinTheTolerance) {
    TriangleMesh soup;
    const TriangleMesh scan = irregular({.axes = {1, 1, 1}, .bump = 0.3}, 22);
    std::mt19937 random(7);
    const auto off = [&] { return 1e-5 * (double(random()) / 4294967295.0 - 0.5); };
    for (const auto& t : scan.triangles) {
        const int n = int(soup.points.size());
        for (const int v : t) soup.points.push_back(scan.points[v] + Vector3d(off(), off(), off()));
        soup.triangles.push_back({n, n + 1, n + 2});
    }
    EXPECT_EQ(read("scan.stl", stl_binary(soup)).mesh.points.size(), soup.points.size());
    const ImportedMesh welded = read("scan.stl", stl_binary(soup), 1e-4);
    EXPECT_EQ(welded.mesh.points.size(), scan.points.size());
    EXPECT_EQ(welded.mesh.triangles.size(), scan.triangles.size());
    EXPECT_TRUE(welded.notes.empty());
}

TEST(Weld, CollapsedTrianglesAreDroppedWithANote) {
    const std::string text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0.001 0\nf 1 2 4\nf 4 2 3\nf 1 4 3\n";
    const ImportedMesh mesh = read("a.obj", text, 0.01);
    EXPECT_EQ(mesh.mesh.triangles, (Triangles{{0, 1, 2}}));
    EXPECT_EQ(mesh.source[0].place.line, 6u);
    ASSERT_EQ(mesh.notes.size(), 1u);
    EXPECT_EQ(mesh.notes[0], "2 triangles collapsed when vertices were welded, and were dropped.");
}

}  // namespace tubule::surface3d::import_formats_test
