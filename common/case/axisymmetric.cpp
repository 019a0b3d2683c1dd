// Which starts tier "axisym" takes.
#include <fmt/format.h>

#include "common/case/keys.hpp"

namespace tubule {

namespace {

using Refusal = std::pair<std::string, std::string>;

template <class Mode>
Refusal wave_around(const std::vector<Mode>& modes) {
    for (std::size_t i = 0; i < modes.size(); ++i)
        if (modes[i].m != 0)
            return {fmt::format("shape.mode.{}.m", i),
                    fmt::format("must be 0, not {}: tier \"axisym\" is axisymmetric and has no waves around the axis",
                                modes[i].m)};
    return {};
}

struct NotAxisymmetric {
    Refusal operator()(const Tube& tube) const { return wave_around(tube.modes); }
    Refusal operator()(const Sphere& sphere) const { return wave_around(sphere.modes); }
    Refusal operator()(const Ellipsoid& e) const {
        if (e.a == e.b) return {};
        return {"shape.b", fmt::format("must be a = {}, not {}: tier \"axisym\" is axisymmetric about z", e.a, e.b)};
    }
    Refusal operator()(const MeshFile&) const {
        return {"shape.kind", "must not be \"file\": meshes need tier = \"surface3d\""};
    }
    template <class Other>
    Refusal operator()(const Other&) const {
        return {};
    }
};

}  // namespace

Refusal not_axisymmetric(const Shape& shape) {
    return std::visit(NotAxisymmetric{}, shape);
}

}  // namespace tubule
