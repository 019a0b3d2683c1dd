#include "axisym/curve/curve_frame.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "axisym/curve/curve_samples.hpp"
#include "common/case/read.hpp"
#include "common/geometry/profile_point.hpp"
#include "common/result/frame_profile.hpp"
#include "common/result/start_frame.hpp"

namespace tubule::axisym {
namespace {

// What a run needs to resume, by name.
template <class Fields, class State>
void restart_fields(Fields&& f, State& s) {
    f.array("restart_breaks", s.breaks);
    f.array("restart_y", s.y), f.array("restart_rate", s.rate, s.y.size());
    f.number("restart_elements", s.settings.elements), f.number("restart_tolerance", s.settings.tolerance);
    f.number("restart_pair", s.settings.pair), f.number("restart_role", s.settings.is_coarser);
    f.number("restart_total_start", s.total_start), f.number("restart_dissipated", s.dissipated);
    f.number("restart_error", s.error), f.number("restart_reference_energy", s.reference_energy);
    f.number("restart_least_symbol", s.least_symbol), f.number("restart_work", s.work);
    f.array("restart_density", s.settings.density), f.number("restart_excess", s.settings.excess);
    f.number("restart_lost", s.mesh_need.lost), f.array("restart_wanted", s.mesh_need.wanted);
    EnergyTrace::fields(f, s.trace, "restart_trace");
}

// One point of the profile, with curvatures and flow.
struct Sample {
    double r, z, H, K, u_n, u_t, u_theta, p;
};

Sample sample(const CurveMotion& motion, const CurveRestart& state, double s) {
    const CurveSpace& space = motion.space();
    const MotionLayout& at = motion.layout();
    const CurveSample c = space.evaluate(state.y.head(space.size()), s);
    if (const double beside = beside_pole(space, s); beside != s) {
        Sample pole = sample(motion, state, beside);
        pole.r = 0, pole.z = c.z, pole.u_t = 0, pole.u_theta = 0;
        return pole;
    }
    const auto p = profile_point(c.r, c.r1, c.r2, c.z1, c.z2);
    const double t_r = c.r1 * p.inverse_speed, t_z = c.z1 * p.inverse_speed;
    const bool flows = motion.law().inextensible;
    const double* v = flows ? state.y.data() : state.rate.data();
    const double u = space.r().evaluate(v + (flows ? at.u_r : at.r), s)[0];
    double w = space.z().evaluate(v + (flows ? at.u_z : at.z), s)[0];
    if (!flows && at.stretch >= 0) w -= state.y[at.stretch] * space.z().evaluate(state.y.data() + at.z, s)[0];
    Sample out{c.r, c.z, p.H, p.K, u * t_z - w * t_r, u * t_r + w * t_z, 0, 0};
    if (at.swirl >= 0) out.u_theta = space.r().evaluate(state.y.data() + at.swirl, s)[0];
    if (at.p >= 0) out.p = motion.pressures().evaluate(state.y.data() + at.p, s)[0];
    return out;
}

struct MakeMeridian {
    const Problem& c;
    template <class Exact>
    Curve operator()(const Exact& shape) const {
        return meridian(shape);
    }
    Curve operator()(const ProfileFile& file) const { return start_profile(c, file).curve; }
    Curve operator()(const MeshFile&) const { throw complaint(c, "shape.kind", "is a mesh, not a profile"); }
    Curve operator()(const ResultFrame&) const {
        try {
            return meridian(disturbed_curve(c, start_frame(c).record));
        } catch (const std::invalid_argument& error) {
            throw complaint(c, "shape.path", fmt::format("cannot be used: {}", error.what()));
        }
    }
};

}  // namespace

Record curve_record(double time, const CurveMotion& motion, const CurveRestart& state, double energy) {
    const CurveSpace& space = motion.space();
    std::vector<double> parameters;
    const auto sample_at = [&](double s) {
        parameters.push_back(s);
        return sample(motion, state, s);
    };
    const std::vector<Sample> samples = sample_profile(space, sample_at, [](Sample& image) { image.u_t = -image.u_t; });

    Record out;
    out.time = time, out.kind = RecordKind::curve;
    out.numbers = {{"energy", energy}, {"length", space.length(state.y.data())}};
    const auto add = [&](const char* name, double Sample::*member) {
        std::vector<double> values;
        for (const Sample& s : samples) values.push_back(s.*member);
        out.arrays.push_back(array(name, std::move(values)));
    };
    add("r", &Sample::r), add("z", &Sample::z), add("H", &Sample::H), add("K", &Sample::K), add("u_n", &Sample::u_n);
    if (motion.law().inextensible) add("u_t", &Sample::u_t), add("p", &Sample::p);
    if (motion.law().swirls) add("u_theta", &Sample::u_theta);
    if (motion.forms().bending().H0_varies())  // of a whole cell or period
        out.arrays.push_back(array("H0", motion.forms().H0_at(state.y.head(space.size()), parameters)));
    restart_fields(RecordWriter(out), state);
    return out;
}

Record state_record(double time, const CurveRestart& state) {
    Record out;
    out.time = time, out.kind = RecordKind::curve;
    restart_fields(RecordWriter(out), state);
    return out;
}

CurveRestart curve_restart(const Record& record) {
    CurveRestart s;
    restart_fields(RecordReader(record, RecordKind::curve), s);
    s.trace.cut_after(record.time);
    return s;
}

std::optional<PerturbedCurve> initial_velocity(const Problem& c) {
    if (c.velocity.initial != InitialVelocity::result) return std::nullopt;
    const Record frame = start_frame(c).record;
    PerturbedCurve out = frame_curve(frame);
    out.velocity = frame_velocity(frame, out);
    if (!out.velocity)
        throw complaint(c, "velocity.initial",
                        "must not be \"result\": the frame of shape.path is no profile with a velocity");
    return out;
}

Curve initial_curve(const Problem& c) {
    return std::visit(MakeMeridian{c}, c.shape);
}

}  // namespace tubule::axisym
