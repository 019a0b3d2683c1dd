// The curved meshes that a case begins with.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/case/problem.hpp"
#include "common/shapes/disturbed_shape.hpp"
#include "surface3d/curvature/curvature.hpp"
#include "surface3d/mesh/curved_mesh.hpp"

namespace tubule::surface3d {

struct StartMesh {
    CurvedMesh mesh;
    std::optional<CurvatureField> exact;  // where the case asks for Recovery::exact
    VectorField velocity = {};            // of the nodes, where there is one
    Eigen::VectorXd H0 = {};              // of the nodes, where the file of a profile has it
};

// The shape of the case, or what is handed over to it. Files are read, checked and fitted once, and so is everything
// that meshes of all sizes have in common.
class Start {
public:
    // Throws CaseError that names the key to blame: a file that cannot be read or used, a result without such a frame,
    // a mesh or exact curvatures that this shape does not have.
    explicit Start(const Problem& c);

    // With elements of this order and about this many triangles, where their number can be chosen. Throws TooLarge.
    StartMesh mesh(int triangles, int order) const;
    bool resizable() const { return resizable_; }                     // whether it can; a file brings its own triangles
    const std::vector<std::string>& notes() const { return notes_; }  // what was changed on the way, whole sentences

    // The note that time.end is far from the times in which a surface of this size moves, if so; else empty.
    const std::string& time_scale() const { return time_scale_; }

    using Make = std::function<StartMesh(int triangles, int order)>;
    // Meshes that are made elsewhere.
    Start(Make make, bool resizable) : make_(std::move(make)), resizable_(resizable) {}

private:
    Make make_;
    bool resizable_ = true;
    std::vector<std::string> notes_;
    std::string time_scale_;
    int fields_ = 1;  // that a run solves for at the nodes
};

// Surfaces that a case brings as triangles, made larger and disturbed as it says.

double area_of(const CurvedMesh& mesh);

CurvedMesh scaled(CurvedMesh mesh, double factor);

// Each node moved along the normal: of a sphere by the height in its direction from the centroid of the surface, of a
// tube by that at its height and angle.
CurvedMesh displaced(CurvedMesh mesh, const DisturbedShape& modes);

}  // namespace tubule::surface3d
