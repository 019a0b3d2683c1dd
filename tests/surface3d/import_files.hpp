// Mesh files for tests: a directory of their own, and writers of each format.
#pragma once

#include <fmt/format.h>
#include <unistd.h>

#include <bit>
#include <filesystem>
#include <fstream>
#include <string>

#include "surface3d/mesh/triangle_mesh.hpp"

namespace tubule::surface3d::samples {

// Gone again at the end of the test.
class TemporaryDirectory {
public:
    TemporaryDirectory() : path_(std::filesystem::temp_directory_path() / fmt::format("tubule_import_{}", getpid())) {
        std::filesystem::create_directories(path_);
    }
    ~TemporaryDirectory() { std::filesystem::remove_all(path_); }
    TemporaryDirectory(const TemporaryDirectory&) = delete;
    TemporaryDirectory& operator=(const TemporaryDirectory&) = delete;

    const std::filesystem::path& path() const { return path_; }
    std::filesystem::path write(const std::string& name, const std::string& contents) const {
        std::ofstream(path_ / name, std::ios::binary) << contents;
        return path_ / name;
    }

private:
    std::filesystem::path path_;
};

// The bytes of a number, in either order.
template <class T>
std::string bytes(T value, bool big_endian = false) {
    const auto raw = std::bit_cast<std::array<char, sizeof(T)>>(value);
    const bool swap = big_endian != (std::endian::native == std::endian::big);
    return swap ? std::string(raw.rbegin(), raw.rend()) : std::string(raw.begin(), raw.end());
}

// fmt writes the shortest text that reads back as the same number.
inline std::string obj(const TriangleMesh& mesh) {
    std::string out = "# a scan\r\no scan\r\nvn 0 0 1\r\nvt 0.5 0.5\r\n";
    for (const auto& x : mesh.points) out += fmt::format("v {} {} {} 0.1 0.2 0.3\r\n", x[0], x[1], x[2]);
    for (const auto& [a, b, c] : mesh.triangles) out += fmt::format("f {}/1/1 {}//1 {}/1\r\n", a + 1, b + 1, c + 1);
    return out;
}

inline std::string off(const TriangleMesh& mesh) {
    std::string out = fmt::format("NOFF # with normals\n{} {} 0\n", mesh.points.size(), mesh.triangles.size());
    for (const auto& x : mesh.points) out += fmt::format("{} {} {}  0 0 1\n", x[0], x[1], x[2]);
    for (const auto& [a, b, c] : mesh.triangles) out += fmt::format("3 {} {} {}  255 0 0\n", a, b, c);
    return out;
}

// With more properties and elements than a surface needs, in awkward places.
inline std::string ply(const TriangleMesh& mesh, const std::string& format) {
    const bool ascii = format == "ascii", big = format == "binary_big_endian";
    std::string out = fmt::format(
        "ply\nformat {} 1.0\ncomment a scan\nelement camera 1\nproperty list uchar short lens\nelement vertex {}\n"
        "property uchar red\nproperty double x\nproperty double y\nproperty list uchar float extra\nproperty double z\n"
        "element face {}\nproperty float quality\nproperty list uchar int vertex_indices\nproperty short flag\n"
        "end_header\n",
        format, mesh.points.size(), mesh.triangles.size());
    const auto put = [&](auto value) { out += ascii ? fmt::format("{} ", value) : bytes(value, big); };
    const auto end_line = [&] { out += ascii ? "\n" : ""; };
    put(std::uint8_t(2)), put(std::int16_t(-3)), put(std::int16_t(300)), end_line();
    for (const auto& x : mesh.points) {
        put(std::uint8_t(200)), put(x[0]), put(x[1]), put(std::uint8_t(1)), put(0.5f), put(x[2]), end_line();
    }
    for (const auto& t : mesh.triangles) {
        put(0.25f), put(std::uint8_t(3));
        for (const int v : t) put(std::int32_t(v));
        put(std::int16_t(-1)), end_line();
    }
    return out;
}

// Normals are left zero, as many programs do: the order of corners is what counts.
inline std::string stl_ascii(const TriangleMesh& mesh) {
    std::string out = "solid a scan of\n";
    for (const auto& t : mesh.triangles) {
        out += "facet normal 0 0 0\n outer loop\n";
        for (const int v : t) {
            out += fmt::format("  vertex {} {} {}\n", mesh.points[v][0], mesh.points[v][1], mesh.points[v][2]);
        }
        out += " endloop\nendfacet\n";
    }
    return out + "endsolid\n";
}

inline std::string stl_binary(const TriangleMesh& mesh) {
    std::string out = "solid, says this binary file";
    out.resize(80, ' ');
    out += bytes(std::uint32_t(mesh.triangles.size()));
    for (const auto& t : mesh.triangles) {
        for (int i = 0; i < 3; ++i) out += bytes(0.0f);
        for (const int v : t) {
            for (int d = 0; d < 3; ++d) out += bytes(float(mesh.points[v][d]));
        }
        out += bytes(std::uint16_t(0));
    }
    return out;
}

}  // namespace tubule::surface3d::samples
