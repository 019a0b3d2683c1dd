#include "tools/auto/choice.hpp"

#include <fmt/format.h>

#include "common/case/keys.hpp"

namespace tubule {

Choice choice_for(const Case& c) {
    if (const auto [key, complaint] = not_axisymmetric(c.shape); !key.empty())
        return {false,
                fmt::format("the start is not axisymmetric: {} {}", key,
                            std::holds_alternative<MeshFile>(c.shape) ? "is a mesh" : "breaks the symmetry"),
                surface3d::Start(surface_case(c))};
    if (std::holds_alternative<ResultFrame>(c.shape))
        if (surface3d::Start start(surface_case(c)); !start.resizable())
            return {false, "the start is not axisymmetric: the frame of shape.path is a surface in three dimensions",
                    std::move(start)};
    return {true, "start and model are axisymmetric", {}};
}

Case axisym_case(const Case& c, double end, std::vector<double> output) {
    Case out = c;
    out.tier = Tier::axisym;
    out.time.end = end;
    out.time.output = std::move(output);
    return out;
}

Case surface_case(const Case& c) {
    Case out = c;
    out.tier = Tier::surface3d;
    return out;
}

}  // namespace tubule
