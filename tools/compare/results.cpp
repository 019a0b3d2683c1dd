#include "tools/compare/results.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "common/result/about.hpp"
#include "common/result/frame_profile.hpp"
#include "common/result/record.hpp"
#include "surface3d/run/mesh_record.hpp"
#include "tools/compare/alignment.hpp"
#include "tools/compare/surfaces.hpp"

namespace tubule::compare {

namespace {

constexpr double same_frame = 1e-6;

// By area. A period of a tube may begin anywhere, so that it is on the axis.
Eigen::Vector3d centre(const Surface& surface) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double area = 0;
    for (const Sample& s : surface.samples(0)) sum += s.weight * s.x, area += s.weight;
    sum /= area;
    if (surface.grain() == 0) sum[0] = sum[1] = 0;  // one meridian stood for all
    if (surface.period() > 0) sum[2] = 0;
    return sum;
}

// Throws std::invalid_argument if the frame has no surface, or a damaged one.
std::unique_ptr<Surface> frame_surface(const Record& frame, const Result& result) {
    if (frame.mesh) {
        if (*frame.mesh >= result.meshes.size())
            throw std::invalid_argument("the triangles of its surface are missing");
        return std::make_unique<TriangleSurface>(surface3d::frame_surface(frame, result.meshes[*frame.mesh]));
    }
    return std::make_unique<RevolutionSurface>(frame_curve(frame));
}

std::unique_ptr<Surface> surface_of(const Result& result, std::size_t frame, char which) {
    try {
        return frame_surface(result.frames[frame], result);
    } catch (const std::invalid_argument& error) {
        throw std::invalid_argument(
            fmt::format("frame {} of {}, t = {:.8g}: {}", frame, which, result.frames[frame].time, error.what()));
    }
}

}  // namespace

std::string stop_word(const Result& result) {
    const auto* stop = find_value<std::string>(result.about, "stop");
    return stop ? *stop : "unfinished";
}

double stop_time(const Result& result) {
    const auto& times = result.series.at("time");
    const auto* stop = find_value<double>(result.about, "stop_time");
    return stop ? *stop : times.empty() ? 0 : times.back();
}

double reference_energy(const Result& result) {
    const auto* energy = find_value<double>(result.about, "E_ref");
    return energy ? *energy : 0;
}

std::optional<double> stated_error(const Result& result) {
    const auto* error = find_value<double>(result.about, "estimated_error");
    return error ? std::optional(*error) : std::nullopt;
}

std::vector<FramePair> frames_in_common(const Result& a, const Result& b) {
    std::vector<FramePair> out;
    for (std::size_t i = 0, j = 0; i < a.frames.size() && j < b.frames.size();) {
        const double s = a.frames[i].time, t = b.frames[j].time;
        if (std::abs(s - t) <= same_frame * std::max(std::abs(s), std::abs(t)))
            out.emplace_back(i++, j++);
        else
            s < t ? ++i : ++j;
    }
    return out;
}

bool know_energies(const Result& a, const Result& b, FramePair frames) {
    return find_number(a.frames[frames.first], "energy") && find_number(b.frames[frames.second], "energy");
}

ShapeDifference compare_shapes(const Result& a, const Result& b, FramePair frames, bool align) {
    const auto [i, j] = frames;
    const auto of_a = surface_of(a, i, 'A'), of_b = surface_of(b, j, 'B');
    ShapeDifference out;
    out.frames = frames, out.time = a.frames[i].time;
    if (know_energies(a, b, frames)) {
        const double of_a = *find_number(a.frames[i], "energy"), of_b = *find_number(b.frames[j], "energy");
        const double stated = reference_energy(a), scale = stated > 0 ? stated : std::abs(of_a);
        out.energy = std::abs(of_a - of_b) / (scale > 0 ? scale : 1);
    }
    try {
        if (align) {
            const Eigen::Vector3d before = centre(*of_b);
            out.motion = alignment(*of_a, *of_b);
            out.moved = out.motion(before) - before;
        }
        out.distance = distance(*of_a, *of_b, out.motion);
    } catch (const std::invalid_argument& error) {
        throw std::invalid_argument(
            fmt::format("frame {} of A and {} of B cannot be compared: {}", i, j, error.what()));
    }
    return out;
}

}  // namespace tubule::compare
