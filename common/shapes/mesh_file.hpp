// Shape "file": a closed triangle mesh from a file, OBJ, OFF, PLY or STL, with a smooth surface fitted through it, or
// through new triangles that are made of it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/shapes/curve.hpp"
#include "common/shapes/sphere.hpp"

namespace tubule {

struct MeshFile {
    static constexpr const char* kind = "file";
    std::string path;           // relative to the case file
    double weld = 0;            // vertices nearer than this become one, in the units of the file
    int smoothing = 0;          // how often vertices are moved to the least-squares surface: for noisy scans
    std::optional<int> remesh;  // repair the mesh and give it this many triangles
    std::optional<double> smoothing_length = {};  // then: waves of this length keep half of their height
    bool fill_holes = false;
    std::optional<double> wrap = {};  // put a new surface around all triangles that closes gaps narrower than this
    std::optional<double> scale = {}, area = {};  // of the finished surface: a factor, or the area that it gets
    std::vector<SphereMode> modes = {};           // waves along the normal, then
    std::vector<ShapeNoise> noise = {};           // becomes modes once the case is read
};

// Adds the modes of the noise to the others, and forgets the noise.
void make_noise(MeshFile& file);

inline Asymmetry asymmetry(const MeshFile&) {
    return {"shape.kind", "must not be \"file\": meshes need tier = \"surface3d\""};
}

template <class Keys>
void keys(Keys& k, MeshFile& file) {
    k.text("path", file.path, k.required);
    k.number("area", file.area, {.above = 0});
    if (file.area)
        k.absent("scale", "must be absent: area says how large the surface is");
    else
        k.number("scale", file.scale, {.above = 0});
    harmonic_keys(k, file);
    k.number("weld", file.weld, {.from = 0});
    k.integer("remesh", file.remesh, {.from = 100, .to = 20000});
    if (!file.remesh) {
        k.integer("smoothing", file.smoothing, {.from = 0, .to = 100});
        for (const char* key : {"smoothing_length", "fill_holes", "wrap"})
            k.absent(key, "must be absent: only valid with remesh");
        return;
    }
    k.absent("smoothing",
             "must be absent: with remesh, smoothing_length is the length over which a surface is smoothed");
    k.number("smoothing_length", file.smoothing_length, {.above = 0});
    k.number("wrap", file.wrap, {.above = 0});
    if (file.wrap)
        k.absent("fill_holes", "must be absent: wrap closes all holes narrower than its length");
    else
        k.flag("fill_holes", file.fill_holes);
}

}  // namespace tubule
