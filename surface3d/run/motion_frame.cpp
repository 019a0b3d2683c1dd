#include "surface3d/run/motion_frame.hpp"

#include <algorithm>
#include <stdexcept>

namespace tubule::surface3d {
namespace {

// The members of a memory under their names.
template <class Memory, class Visit>
void for_each_number(Memory& m, Visit&& visit) {
    visit("restart_next_step", m.next_step), visit("restart_relaxation", m.relaxation);
    visit("restart_elements", m.settings.elements), visit("restart_tolerance", m.settings.tolerance);
    visit("restart_difference", m.settings.difference), visit("restart_pair", m.settings.pair);
    visit("restart_role", m.settings.role);
    visit("restart_area", m.area), visit("restart_volume", m.volume);
    visit("restart_least_variation", m.least_variation), visit("restart_lowest_total", m.lowest_total);
    visit("restart_total_start", m.total_start), visit("restart_dissipated", m.dissipated);
    visit("restart_corrected", m.corrected), visit("restart_error", m.error);
    visit("restart_reference_energy", m.reference_energy), visit("restart_defect", m.defect);
    visit("restart_dissipation_past", m.dissipation_past), visit("restart_moved", m.moved);
    visit("restart_steps", m.steps), visit("restart_rejected", m.rejected);
    visit("restart_mesh_since", m.mesh_since), visit("restart_meshes", m.meshes);
}

Array column(const std::string& name, const Eigen::VectorXd& values) {
    return array(name, values.transpose());
}

[[noreturn]] void missing(const std::string& name) {
    throw std::runtime_error("nothing can go on from this frame: " + name +
                             " is missing, as in results of another version; run the case without --resume");
}
const Array& array_of(const Record& record, const std::string& name) {
    for (const Array& a : record.arrays)
        if (a.name == name) return a;
    missing(name);
}
double number_of(const Record& record, const std::string& name) {
    for (const auto& [key, value] : record.numbers)
        if (key == name) return value;
    missing(name);
}
Eigen::VectorXd vector_of(const Record& record, const std::string& name) {
    const std::vector<double>& data = array_of(record, name).data;
    return Eigen::Map<const Eigen::VectorXd>(data.data(), data.size());
}
VectorField field_of(const Record& record, const std::string& name) {
    const std::vector<double>& data = array_of(record, name).data;
    return Eigen::Map<const VectorField>(data.data(), 3, data.size() / 3);
}

}  // namespace

Record motion_record(const MotionStepper& stepper, const MotionState& s, const MotionMeasures& m,
                     const Bending& bending, const MotionMemory& memory, std::size_t mesh_number) {
    Record out;
    out.time = s.time;
    out.mesh = mesh_number;
    out.numbers = {{"energy", m.bending.energy},
                   {"restart_lambda", s.lambda},
                   {"restart_solved_time", s.solved.time},
                   {"restart_lag", s.lag},
                   {"restart_solved_lambda", s.solved.lambda},
                   {"restart_step", s.step},
                   {"restart_missed_area", s.missed.area},
                   {"restart_missed_volume", s.missed.volume}};
    for_each_number(memory, [&](const char* name, const auto& value) {
        out.numbers.emplace_back(name, static_cast<double>(value));
    });
    Eigen::VectorXd density_at(s.X.cols());
    for (int i = 0; i < density_at.size(); ++i) density_at[i] = density(bending, m.fields.H[i], m.fields.K[i]).f;
    const Eigen::VectorXd u_n = m.velocity.cwiseProduct(m.fields.normal).colwise().sum().transpose();
    out.arrays = {array("points", s.X), array("normal", m.fields.normal), array("u", m.velocity), column("u_n", u_n)};
    if (s.p.size() > 0) out.arrays.push_back(column("p", stepper.pressure_at_nodes(s)));
    for (const Array& more : {column("H", m.fields.H), column("K", m.fields.K), column("energy_density", density_at),
                              array("restart_w", s.w), column("restart_u", s.u), array("restart_X_past", s.X_past),
                              array("restart_w_past", s.w_past), column("restart_u_past", s.u_past)})
        out.arrays.push_back(more);
    if (s.p.size() > 0) out.arrays.push_back(column("restart_p", s.p));
    if (s.u_rate.size() > 0) {
        out.arrays.push_back(array("restart_X_rate", s.X_rate));
        out.arrays.push_back(column("restart_u_rate", s.u_rate));
        if (s.p.size() > 0) out.arrays.push_back(column("restart_solved_p", s.solved.p));
    }
    return out;
}

MotionRestart motion_restart(const Record& record) {
    MotionRestart out;
    MotionState& s = out.state;
    s.time = record.time;
    s.step = number_of(record, "restart_step");
    s.lambda = number_of(record, "restart_lambda");
    s.solved.time = number_of(record, "restart_solved_time");
    s.lag = number_of(record, "restart_lag");
    s.solved.lambda = number_of(record, "restart_solved_lambda");
    s.X = field_of(record, "points"), s.w = field_of(record, "restart_w"), s.u = vector_of(record, "restart_u");
    s.X_past = field_of(record, "restart_X_past"), s.w_past = field_of(record, "restart_w_past");
    s.u_past = vector_of(record, "restart_u_past");
    s.missed = {number_of(record, "restart_missed_area"), number_of(record, "restart_missed_volume")};
    const auto has = [&](const char* name) {
        return std::any_of(record.arrays.begin(), record.arrays.end(), [&](const Array& a) { return a.name == name; });
    };
    if (has("restart_p")) s.p = vector_of(record, "restart_p");
    if (has("restart_solved_p")) s.solved.p = vector_of(record, "restart_solved_p");
    if (has("restart_u_rate"))
        s.X_rate = field_of(record, "restart_X_rate"), s.u_rate = vector_of(record, "restart_u_rate");
    for_each_number(out.memory, [&]<class Number>(const char* name, Number& value) {
        value = static_cast<Number>(number_of(record, name));
    });
    return out;
}

}  // namespace tubule::surface3d
