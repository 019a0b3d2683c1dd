// Builds without CGAL: shape.remesh is refused before any of these is called.
#include <stdexcept>

#include "surface3d/import/import_cgal.hpp"

namespace tubule::surface3d::cgal {

namespace {
[[noreturn]] void missing() {
    throw std::logic_error("this build has no CGAL");
}
}  // namespace

bool available() {
    return false;
}
TriangleMesh isotropic(const TriangleMesh&, double) {
    missing();
}
FilledHoles fill_holes(const TriangleMesh&) {
    missing();
}
TriangleMesh wrap(const TriangleMesh&, double, double) {
    missing();
}

}  // namespace tubule::surface3d::cgal
