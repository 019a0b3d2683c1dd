#include "tools/auto/choice.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <stdexcept>

#include "common/case/keys.hpp"
#include "common/case/read.hpp"
#include "common/result/result.hpp"

namespace tubule {

namespace {

bool is_surface(const Case& c, const ResultFrame& from) {
    try {
        const Result result = read_result(std::filesystem::path(c.path).parent_path() / from.path);
        const int count = static_cast<int>(result.frames.size()),
                  number = from.frame < 0 ? count + from.frame : from.frame;
        // A frame that there is not is refused by the tier.
        return number >= 0 && number < count && result.frames[number].mesh.has_value();
    } catch (const std::runtime_error& error) {
        throw CaseError(fmt::format("{}: shape.path: {}", c.path, error.what()));
    }
}

}  // namespace

Choice choice_for(const Case& c) {
    if (const auto [key, complaint] = not_axisymmetric(c.shape); !key.empty())
        return {false, fmt::format("the start is not axisymmetric: {} {}", key,
                                   std::holds_alternative<MeshFile>(c.shape) ? "is a mesh" : "breaks the symmetry")};
    if (const auto* from = std::get_if<ResultFrame>(&c.shape); from && is_surface(c, *from))
        return {false, "the start is not axisymmetric: the frame of shape.path is a surface in three dimensions"};
    return {true, "start and model are axisymmetric"};
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
