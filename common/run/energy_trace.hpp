// The energy along a run, for another run to be compared with.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace tubule {

class EnergyTrace {
public:
    // A point later than all before; else it is left out. All points of a trace have a slope, or none has.
    void add(double t, double energy) { add(t, energy, {}); }
    void add(double t, double energy, std::optional<double> slope);
    // A run resumes here: forgets everything later.
    void cut_after(double t);
    bool empty() const { return time_.empty(); }
    int size() const { return static_cast<int>(time_.size()); }
    double end() const { return time_.back(); }
    const std::vector<double>& times() const { return time_; }
    const std::vector<double>& energies() const { return energy_; }
    int points_after(double t) const;
    // The number of steps until t that grew by (clearly) less than this factor: their lengths were chosen for accuracy.
    int limited_steps(double growth, double t) const;

    // Between two points the cubic with their slopes, or the polynomial through them and their neighbours that are not
    // too near to them.
    double operator()(double t) const;
    // How far another run's energy is from this one's, absolute; nothing after the end, and nothing within the first
    // step, as the energy of a shape that is not smooth falls like a root of the time.
    std::optional<double> difference(double t, double energy) const;

    // The fields of a record (common/result/record.hpp), with names that begin with `name`.
    template <class Fields, class Trace>
    static void fields(Fields&& f, Trace& t, const std::string& name) {
        f.array(name + "_time", t.time_);
        f.array(name + "_energy", t.energy_, t.time_.size());
        f.optional_array(name + "_slope", t.slope_, t.time_.size());
    }

private:
    double through_neighbours(double t, int after) const;

    std::vector<double> time_, energy_, slope_;
};

}  // namespace tubule
