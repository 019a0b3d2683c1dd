// Shape "file": a closed triangle mesh from a file, OBJ, OFF, PLY or STL, with a smooth surface fitted through it.
#pragma once

#include <string>

#include "common/shapes/meridian.hpp"

namespace tubule {

struct MeshFile {
    static constexpr const char* kind = "file";
    std::string path;   // relative to the case file
    double weld = 0;    // vertices nearer than this become one, in the units of the file
    int smoothing = 0;  // how often vertices are moved to the least-squares surface: for noisy scans
};

inline Asymmetry asymmetry(const MeshFile&) {
    return {"shape.kind", "must not be \"file\": meshes need tier = \"surface3d\""};
}

template <class Keys>
void keys(Keys& k, MeshFile& file) {
    k.text("path", file.path, k.required);
    k.number("weld", file.weld, {.from = 0});
    k.integer("smoothing", file.smoothing, {.from = 0, .to = 100});
}

}  // namespace tubule
