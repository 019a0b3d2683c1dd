#include "axisym/graph/graph_frame.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "common/geometry/profile_point.hpp"

namespace tubule::axisym {
namespace {

// Points of the period at which a profile is sampled: every element, divided evenly.
std::vector<double> sample_points(const std::vector<double>& knots, double length) {
    std::vector<double> ends{0};
    for (double knot : knots)
        if (knot > ends.back() + 1e-12 * length && knot < length * (1 - 1e-12)) ends.push_back(knot);
    ends.push_back(length);
    const int parts = std::clamp(static_cast<int>(256 / ends.size()), 4, 16);
    std::vector<double> points;
    for (std::size_t i = 0; i + 1 < ends.size(); ++i)
        for (int j = 0; j < parts; ++j) points.push_back(ends[i] + (ends[i + 1] - ends[i]) * j / parts);
    points.push_back(length);
    return points;
}

Array array(const std::string& name, std::vector<double> data) {
    return {name, {data.size()}, std::move(data)};
}
Array array(const std::string& name, const Eigen::VectorXd& v) {
    return array(name, std::vector<double>(v.begin(), v.end()));
}

const Array& find(const Record& record, const std::string& name) {
    for (const Array& a : record.arrays)
        if (a.name == name) return a;
    throw std::runtime_error(fmt::format("no restart record of tier axisym: it has no array {}", name));
}

}  // namespace

Record frame_record(double time, const ProfileSpace& space, const RestartState& s, const Eigen::VectorXd& rate,
                    double energy) {
    const Cell& cell = space.cell();
    const auto spline = space.unfold(s.coefficients, 0);
    std::vector<double> z = sample_points(spline.knots, cell.period()), r, H, K, u_n;
    for (double point : z) {
        const double turn = cell.length() * (cell.mirror ? 2 : 1);
        double inside = point - cell.z0 - std::floor((point - cell.z0) / turn) * turn;
        if (inside > cell.length()) inside = 2 * cell.length() - inside;
        inside = std::clamp(cell.z0 + inside, cell.z0, cell.z1);
        const int e = space.element_at(inside);
        const auto [value, slope, second] = space.evaluate(s.coefficients.data(), e, inside);
        const auto p = graph_point(value, slope, second);
        r.push_back(value);
        H.push_back(p.H);
        K.push_back(p.K);
        u_n.push_back(space.evaluate(rate.data(), e, inside)[0] * p.inverse_speed);
    }
    Record out;
    out.time = time;
    out.numbers = {{"degree", space.degree()}, {"length", cell.period()}, {"energy", energy}};
    out.arrays = {array("knots", spline.knots),
                  array("coefficients", spline.coefficients),
                  array("z", z),
                  array("r", r),
                  array("H", H),
                  array("K", K),
                  array("u_n", u_n),
                  array("restart_breaks", s.breaks),
                  array("restart_coefficients", s.coefficients),
                  array("restart_error_total", s.error_total),
                  array("restart_error_spatial", s.error_spatial),
                  array("restart_numbers",
                        std::vector<double>{cell.z0, cell.z1, cell.mirror ? 1.0 : 0.0, static_cast<double>(cell.copies),
                                            s.reference_energy, s.energy_start, s.dissipated, s.error_max,
                                            s.time_tolerance, s.defect, s.least_symbol})};
    return out;
}

RestartState restart_state(const Record& record) {
    const auto vector = [&](const char* name) {
        const Array& a = find(record, name);
        return Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(a.data.data(), a.data.size()));
    };
    const std::vector<double>& n = find(record, "restart_numbers").data;
    if (n.size() != 11)
        throw std::runtime_error("no restart record of tier axisym: restart_numbers has another length");
    RestartState s;
    s.cell = {n[0], n[1], n[2] != 0, static_cast<int>(n[3])};
    s.reference_energy = n[4], s.energy_start = n[5], s.dissipated = n[6];
    s.error_max = n[7], s.time_tolerance = n[8], s.defect = n[9], s.least_symbol = n[10];
    s.breaks = find(record, "restart_breaks").data;
    s.coefficients = vector("restart_coefficients");
    s.error_total = vector("restart_error_total");
    s.error_spatial = vector("restart_error_spatial");
    return s;
}

}  // namespace tubule::axisym
