#include "common/result/frame_profile.hpp"

#include <fmt/format.h>

#include <stdexcept>

namespace tubule {

namespace {

[[noreturn]] void refuse_frame(const std::string& what) {
    throw std::invalid_argument(what);
}

double number(const Record& frame, const char* name) {
    const std::optional<double> found = find_number(frame, name);
    if (!found) refuse_frame(fmt::format("it is damaged: {} is missing", name));
    return *found;
}

const std::vector<double>& values(const Record& frame, const char* name) {
    const Array* found = find_array(frame, name);
    if (!found) refuse_frame(fmt::format("it is damaged: {} is missing", name));
    return found->data;
}

}  // namespace

ProfilePoints profile_points(const Record& frame) {
    if (kind_of(frame) == RecordKind::surface)
        refuse_frame(
            "it holds a surface in three dimensions, but tier \"axisym\" begins with a profile: set tier = "
            "\"surface3d\"");
    if (!find_array(frame, "r") && !find_array(frame, "z")) refuse_frame("it holds neither a surface nor a profile");
    ProfilePoints out{values(frame, "r"), values(frame, "z"), number(frame, "length")};
    if (out.r.empty() || out.r.size() != out.z.size()) refuse_frame("it is damaged: r and z differ in length");
    return out;
}

PerturbedCurve frame_curve(const Record& frame) {
    if (kind_of(frame) == RecordKind::graph)
        return spline_curve(static_cast<int>(number(frame, "degree")), number(frame, "length"), values(frame, "knots"),
                            values(frame, "coefficients"));
    const auto [r, z, length] = profile_points(frame);
    return curve_through(r, z, length);
}

std::optional<CurveVelocity> frame_velocity(const Record& frame, const PerturbedCurve& curve) {
    const Array *normal = find_array(frame, "u_n"), *along = find_array(frame, "u_t"),
                *around = find_array(frame, "u_theta");
    if (!normal || !along) return std::nullopt;
    return curve_velocity(curve, {normal->data, along->data, around ? around->data : std::vector<double>{}});
}

}  // namespace tubule
