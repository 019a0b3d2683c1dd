// The curved mesh that a case begins with.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/case/case.hpp"
#include "surface3d/curvature/curvature.hpp"

namespace tubule::surface3d {

struct StartMesh {
    CurvedMesh mesh;
    bool resizable = true;                // whether the number of triangles can be chosen; a file brings its own
    std::vector<std::string> notes;       // what was changed on the way, in whole sentences
    std::optional<CurvatureField> exact;  // where the case asks for Recovery::exact
    VectorField velocity = {};            // of the nodes, where the start has one
};

// The shape of the case, or what is handed over to it, with about this many triangles, where that can be chosen. Throws
// CaseError that names the key to blame: a file that cannot be read or used, a result without such a frame, a mesh or
// exact curvatures that this shape has not.
StartMesh start_mesh(const Case& c, int triangles);

}  // namespace tubule::surface3d
