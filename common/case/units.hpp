// What the dimensionless numbers of a case stand for: its table [units], theory.md (12.1), (12.2).
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace tubule {

struct Case;

// Quantities as text, each a number with a unit; empty where they are absent.
struct Units {
    std::string length;            // of one unit of length
    std::string bending_rigidity;  // kappa, which is 2 k20 of the case
    std::string temperature = "25 C";
    // What fixes the unit of time, as far as the model has it:
    std::string viscosity, density, friction;
};

enum class QuantityKind { length, energy, temperature, viscosity, density, friction };

// What such a text must be, for messages.
std::string quantity_words(QuantityKind kind);
// What is wrong with it, worded to follow the key; else empty.
std::string wrong_quantity(const std::string& text, QuantityKind kind);

// One unit of the case in SI units; kT in J.
struct Scales {
    double temperature = 0, kT = 0, length = 0, energy = 0;
    std::optional<double> time;
    std::string time_from;  // the key that fixes it
};

// The units of a case with [units]. Throws CaseError where the quantities contradict the case.
Scales scales_of(const Case& c);
// The same; none without [units].
std::optional<Scales> known_scales(const Case& c);

// A number of the case times `scale` is one in the unit `name`.
struct LabUnit {
    double scale = 1;
    std::string name = {};
    std::string after() const { return name.empty() ? "" : " " + name; }  // a number
};

// For a unit as the catalogue of series has it, such as energy/length^2. A name that is empty: the number stays as it
// is, since it has no dimension, or its unit is not known. Tensions, forces, pressures and velocities have the prefix
// that suits this number of the case.
LabUnit lab_unit(const std::optional<Scales>& scales, std::string_view unit, double number = 1);

}  // namespace tubule
