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

Revolution spline_of(const Record& frame) {
    Revolution out{static_cast<int>(number(frame, "degree")), number(frame, "length"), values(frame, "knots"),
                   values(frame, "coefficients")};
    if (out.degree < 1 || out.degree > 7 || !(out.length > 0) || out.coefficients.empty() ||
        out.knots.size() != out.coefficients.size() + static_cast<std::size_t>(out.degree) + 1)
        refuse_frame("it is damaged: degree, length, knots and coefficients do not define a spline");
    return out;
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

ProfilePoints points_of(const Revolution& graph) {
    constexpr int n = 1000;
    ProfilePoints out{.r = {}, .z = {}, .length = graph.length};
    for (int i = 0; i <= n; ++i) {
        out.z.push_back(graph.length * i / n);
        out.r.push_back(radius_at(graph, i < n ? out.z.back() : 0.0));
    }
    return out;
}

std::variant<Revolution, ProfilePoints> profile_of(const Record& frame) {
    if (kind_of(frame) == RecordKind::graph) return spline_of(frame);
    return profile_points(frame);
}

}  // namespace tubule
