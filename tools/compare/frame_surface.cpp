#include "tools/compare/frame_surface.hpp"

#include <stdexcept>

#include "tools/compare/revolution_surface.hpp"
#include "tools/compare/triangle_surface.hpp"

namespace tubule::compare {

namespace {

const Array* find_array(const Record& record, const std::string& name) {
    for (const Array& array : record.arrays)
        if (array.name == name) return &array;
    return nullptr;
}

double number(const Record& record, const std::string& name) {
    for (const auto& [key, value] : record.numbers)
        if (key == name) return value;
    return 0;
}

}  // namespace

std::unique_ptr<Surface> frame_surface(const Record& frame, const Result& result) {
    if (frame.mesh) {
        const Array* points = find_array(frame, "points");
        if (!points || *frame.mesh >= result.meshes.size())
            throw std::invalid_argument("the points or the triangles of its surface are missing");
        return std::make_unique<TriangleSurface>(result.meshes[*frame.mesh], points->data);
    }
    const Array *knots = find_array(frame, "knots"), *coefficients = find_array(frame, "coefficients");
    if (knots && coefficients)
        return std::make_unique<RevolutionSurface>(Revolution{
            static_cast<int>(number(frame, "degree")), number(frame, "length"), knots->data, coefficients->data});
    const Array *r = find_array(frame, "r"), *z = find_array(frame, "z");
    if (!r || !z) throw std::invalid_argument("it holds no surface and no profile of one");
    return std::make_unique<RevolutionSurface>(profile_curve(r->data, z->data, number(frame, "length")));
}

}  // namespace tubule::compare
