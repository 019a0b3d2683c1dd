#include "axisym/curve/curve_frame.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>

#include "axisym/graph/graph_frame.hpp"
#include "common/case/read.hpp"
#include "common/geometry/profile_point.hpp"

namespace tubule::axisym {
namespace {

constexpr int samples_per_element = 6;

Array array(const std::string& name, std::vector<double> data) {
    return {name, {data.size()}, std::move(data)};
}
Array array(const std::string& name, const Eigen::VectorXd& v) {
    return array(name, std::vector<double>(v.begin(), v.end()));
}

const Array* find(const Record& record, const std::string& name) {
    for (const Array& a : record.arrays)
        if (a.name == name) return &a;
    return nullptr;
}

double number(const Record& record, const std::string& name) {
    for (const auto& [key, value] : record.numbers)
        if (key == name) return value;
    return 0;
}

// One point of the profile, and what happens there.
struct Sample {
    double r, z, H, K, u_n, u_t, u_theta, p;
};

Sample sample(const CurveMotion& motion, const CurveRestart& state, double s) {
    const CurveSpace& space = motion.space();
    const MotionLayout& at = motion.layout();
    const CurvePoint c = space.evaluate(state.y.head(space.size()), s);
    // At a pole the curvature around the axis is that along the profile: just beside it, they agree to rounding.
    constexpr double aside = 1e-5;
    const bool pole = space.closed() && (s < aside || (space.topology() == Topology::cell && s > 1 - aside));
    if (pole) {
        Sample beside = sample(motion, state, s < 0.5 ? aside : 1 - aside);
        beside.r = 0, beside.z = c.z, beside.u_t = 0, beside.u_theta = 0;
        return beside;
    }
    const auto p = profile_point(c.r, c.r1, c.r2, c.z1, c.z2);
    const double t_r = c.r1 * p.inverse_speed, t_z = c.z1 * p.inverse_speed;
    const bool flows = motion.law().flows;
    const double* v = flows ? state.y.data() : state.rate.data();
    const double u = space.r().evaluate(v + (flows ? at.u_r : at.r), s)[0];
    const double w = space.z().evaluate(v + (flows ? at.u_z : at.z), s)[0];
    Sample out{c.r, c.z, p.H, p.K, u * t_z - w * t_r, u * t_r + w * t_z, 0, 0};
    if (at.swirl >= 0) out.u_theta = space.r().evaluate(state.y.data() + at.swirl, s)[0];
    if (at.p >= 0) out.p = motion.pressures().evaluate(state.y.data() + at.p, s)[0];
    return out;
}

// The other half of what mirrors itself about the plane z = height.
void complete(std::vector<Sample>& samples, double height) {
    for (std::size_t i = samples.size() - 1; i-- > 0;) {
        Sample image = samples[i];
        image.z = 2 * height - image.z;
        image.u_t = -image.u_t;
        samples.push_back(image);
    }
}

Result read_start(const Case& c, const ResultFrame& from) {
    try {
        return read_result(std::filesystem::path(c.path).parent_path() / from.path);
    } catch (const std::runtime_error& error) {
        throw CaseError(fmt::format("{}: shape.path: {}", c.path, error.what()));
    }
}

struct MakeMeridian {
    const Case& c;
    template <class Exact>
    Meridian operator()(const Exact& shape) const {
        return meridian(shape);
    }
    Meridian operator()(const MeshFile&) const { throw CaseError(c.path + ": a mesh is no profile"); }
    Meridian operator()(const ResultFrame& from) const {
        const Result result = read_start(c, from);
        const int count = static_cast<int>(result.frames.size()),
                  number = from.frame < 0 ? count + from.frame : from.frame;
        if (number < 0 || number >= count)
            throw CaseError(fmt::format("{}: shape.frame must be one of the {} frames of {}, not {}", c.path, count,
                                        from.path, from.frame));
        try {
            return frame_meridian(result.frames[number]);
        } catch (const std::invalid_argument& error) {
            throw CaseError(fmt::format("{}: shape.path: {}", c.path, error.what()));
        }
    }
};

}  // namespace

Record curve_record(double time, const CurveMotion& motion, const CurveRestart& state, double energy) {
    const CurveSpace& space = motion.space();
    std::vector<Sample> samples;
    const std::vector<double>& breaks = state.breaks;
    for (std::size_t e = 0; e + 1 < breaks.size(); ++e)
        for (int i = 0; i < samples_per_element; ++i)
            samples.push_back(sample(motion, state, breaks[e] + (breaks[e + 1] - breaks[e]) * i / samples_per_element));
    samples.push_back(sample(motion, state, 1));
    if (space.topology() == Topology::half_cell) complete(samples, 0);
    if (space.topology() == Topology::half_tube) complete(samples, space.rise());

    Record out;
    out.time = time;
    out.numbers = {{"energy", energy}, {"length", space.length()}};
    const auto add = [&](const char* name, double Sample::*member) {
        std::vector<double> values;
        for (const Sample& s : samples) values.push_back(s.*member);
        out.arrays.push_back(array(name, std::move(values)));
    };
    add("r", &Sample::r), add("z", &Sample::z), add("H", &Sample::H), add("K", &Sample::K), add("u_n", &Sample::u_n);
    if (motion.law().flows) add("u_t", &Sample::u_t), add("p", &Sample::p);
    if (motion.law().swirls) add("u_theta", &Sample::u_theta);
    for (const Array& more :
         {array("restart_breaks", breaks), array("restart_y", state.y), array("restart_rate", state.rate)})
        out.arrays.push_back(more);
    out.numbers.insert(out.numbers.end(), {{"restart_elements", static_cast<double>(state.elements)},
                                           {"restart_tolerance", state.tolerance},
                                           {"restart_total_start", state.total_start},
                                           {"restart_dissipated", state.dissipated},
                                           {"restart_error", state.error},
                                           {"restart_reference_energy", state.reference_energy}});
    return out;
}

bool is_curve(const Record& record) {
    return find(record, "restart_y") != nullptr;
}

CurveRestart curve_restart(const Record& record) {
    const auto values = [&](const std::string& name) {
        const Array* a = find(record, name);
        if (!a) throw std::runtime_error(fmt::format("no restart record of a curve: it has no array {}", name));
        return a->data;
    };
    const auto vector = [&](const std::string& name) {
        const std::vector<double> data = values(name);
        return Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(data.data(), static_cast<Eigen::Index>(data.size())));
    };
    return {values("restart_breaks"),
            vector("restart_y"),
            vector("restart_rate"),
            static_cast<int>(number(record, "restart_elements")),
            number(record, "restart_tolerance"),
            number(record, "restart_total_start"),
            number(record, "restart_dissipated"),
            number(record, "restart_error"),
            number(record, "restart_reference_energy")};
}

Meridian frame_meridian(const Record& frame) {
    if (const Array* knots = find(frame, "knots"); knots && find(frame, "coefficients"))
        return meridian(Revolution{static_cast<int>(number(frame, "degree")), number(frame, "length"), knots->data,
                                   find(frame, "coefficients")->data});
    const Array *r = find(frame, "r"), *z = find(frame, "z");
    if (!r || !z) throw std::invalid_argument("holds no profile of tier \"axisym\"");
    std::vector<std::array<double, 2>> points;
    for (std::size_t i = 0; i < r->data.size(); ++i) points.push_back({r->data[i], z->data[i]});
    const double r_max = *std::max_element(r->data.begin(), r->data.end());
    const bool has_poles = std::abs(r->data.front()) < 1e-9 * r_max && std::abs(r->data.back()) < 1e-9 * r_max;
    return meridian(points, has_poles ? Topology::cell : Topology::tube, number(frame, "length"));
}

Meridian start_meridian(const Case& c) {
    return std::visit(MakeMeridian{c}, c.shape);
}

}  // namespace tubule::axisym
