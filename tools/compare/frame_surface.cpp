#include "tools/compare/frame_surface.hpp"

#include <stdexcept>

#include "common/result/frame_profile.hpp"
#include "tools/compare/revolution_surface.hpp"
#include "tools/compare/triangle_surface.hpp"

namespace tubule::compare {

std::unique_ptr<Surface> frame_surface(const Record& frame, const Result& result) {
    if (frame.mesh) {
        const Array* points = find_array(frame, "points");
        if (!points || *frame.mesh >= result.meshes.size())
            throw std::invalid_argument("the points or the triangles of its surface are missing");
        return std::make_unique<TriangleSurface>(result.meshes[*frame.mesh], points->data);
    }
    const auto profile = profile_of(frame);
    if (const auto* spline = std::get_if<Revolution>(&profile)) return std::make_unique<RevolutionSurface>(*spline);
    const auto& [r, z, length] = std::get<ProfilePoints>(profile);
    return std::make_unique<RevolutionSurface>(profile_curve(r, z, length));
}

}  // namespace tubule::compare
