// Every series that a result can have, declared once: what [expect] accepts, how results are compared, the attributes
// in the file, the labels of pictures and the table of docs/results.md derive from here.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace tubule {

enum class SeriesUse {
    effort,      // how the run went: neither expected nor compared
    diagnostic,  // what the numbers are worth: expected, but not compared
    energy,      // compared relative to E_ref
    quantity     // compared relative to its largest magnitude
};

struct SeriesEntry {
    std::string_view name;     // of a family: up to <...>, which stands for a number
    std::string_view unit;     // in powers of energy, length and time of the case
    std::string_view meaning;  // a phrase, for tables and legends
    SeriesUse use = SeriesUse::quantity;

    constexpr bool is_family() const { return name.ends_with('>'); }
    constexpr std::string_view stem() const { return name.substr(0, name.find('<')); }
};

// In the order of tables and messages.
inline constexpr SeriesEntry series_catalogue[] = {
    {"time", "time", "time; of stationary shapes their number", SeriesUse::diagnostic},
    {"step_size", "time", "last step of the time integrator", SeriesUse::effort},
    {"order", "1", "order of the last step", SeriesUse::effort},
    {"newton_iterations", "1", "Newton iterations so far", SeriesUse::effort},
    {"energy", "energy", "bending energy E", SeriesUse::energy},
    {"energy_<kl>", "energy", "part of the term with modulus k<kl> in E", SeriesUse::energy},
    {"energy_formula", "energy", "part of the term given by a formula in E", SeriesUse::energy},
    {"energy_kg", "energy", "part of the gradient term, kg INT (grad H)^2 dS, in E", SeriesUse::energy},
    {"energy_alpha", "energy", "part of area-difference elasticity, alpha/2 (M - M0)^2, in E", SeriesUse::energy},
    {"potential_energy", "energy", "part of the potentials of places in E", SeriesUse::energy},
    {"free_energy", "energy", "F = E + tension A - pressure V - force L", SeriesUse::energy},
    {"work", "energy",
     "work of changes of tension, pressure and force, and of sources; kinetic energy from a reservoir",
     SeriesUse::energy},
    {"dissipation", "energy/time", "dissipation, at which F and the kinetic energy fall"},
    {"identity_defect", "energy", "energy-balance residual", SeriesUse::diagnostic},
    {"area", "length^2", "area"},
    {"volume", "length^3", "enclosed volume"},
    {"volume_drift", "1", "relative change of a volume that is to be kept", SeriesUse::diagnostic},
    {"reduced_volume", "1", "volume over that of the sphere with the same area"},
    {"r_min", "length", "smallest radius"},
    {"r_max", "length", "largest radius"},
    {"mode_<n>", "length", "amplitude of mode <n> of the profile r(z)"},
    {"kinetic_energy", "energy", "kinetic energy", SeriesUse::energy},
    {"speed", "length/time", "largest speed"},
    {"momentum_x", "energy time/length", "momentum along x"},
    {"momentum_y", "energy time/length", "momentum along y"},
    {"momentum_z", "energy time/length", "momentum along z"},
    {"angular_momentum_x", "energy time", "angular momentum about the x axis"},
    {"angular_momentum_y", "energy time", "angular momentum about the y axis"},
    {"angular_momentum_z", "energy time", "angular momentum about the z axis"},
    {"lambda", "energy/length^3", "multiplier of the volume, in the force -lambda nu"},
    {"tension", "energy/length^2", "tension, given or measured"},
    {"pressure", "energy/length^3", "pressure inside minus outside, given or measured"},
    {"force", "energy/length", "axial force on a period, between beads or rings, given or measured"},
    {"bead_distance", "length", "distance of the beads"},
    {"potential_force", "energy/length", "axial force of the potentials of places on the membrane"},
    {"stretching", "1", "norm of div_P u over that of grad_P u"},
    {"correction_energy", "energy", "energy spent on keeping area and volume"},
    {"M", "length", "integral of H"},
    {"integral_H2", "1", "integral of H^2"},
    {"integral_K", "1", "integral of K"},
    {"gauss_bonnet_defect", "1", "integral of K less 2 pi times the Euler characteristic", SeriesUse::diagnostic},
    {"quality", "1", "quality of the worst triangle", SeriesUse::diagnostic},
    {"turn", "radian", "largest angle between normals of neighbouring nodes", SeriesUse::diagnostic},
    {"parameter", "that of the key", "value of the key that varies along a branch"},
    {"special", "1", "1 at a fold, 2 at a bifurcation, else 0"},
    {"branch", "1", "0 of the first branch, then the number of one that bifurcates from it"},
    {"negative_directions", "1", "number of directions in which the energy falls"},
    {"rate_<i>", "1/time", "growth rate of the <i>-th slowest mode"},
    {"rate_error_<i>", "1/time", "estimated error of rate_<i>; -1 if unknown"},
    {"frequency_<i>", "1/time", "angular frequency of mode <i> of a fluid"},
    {"frequency_error_<i>", "1/time", "estimated error of frequency_<i>; -1 if unknown"},
    {"wave_number_<i>", "1", "azimuthal wave number m of mode <i> about the axis of the shape; -1 if there is no axis"},
    {"growth_<m>", "1/time", "growth rate of modes with the azimuthal wave number m = <m>"},
    {"meridian_length", "length", "length of the profile"},
    {"height", "length", "height from pole to pole or ring to end, or period"},
    {"r_middle", "length", "radius at half the profile"},
    {"pole_curvature", "1/length", "curvature at the south pole, or at that of a patch"},
    {"distance_to_start", "length", "Hausdorff distance to the start, mean heights aligned"},
    {"energy_error", "energy", "estimated error of the energy", SeriesUse::diagnostic},
    {"elements", "1", "number of elements", SeriesUse::diagnostic},
    {"mesh_width", "length", "edge of an equilateral triangle with the mean area", SeriesUse::effort},
    {"tier", "1", "1: axisym, 2: surface3d", SeriesUse::diagnostic},
    {"wall_seconds", "s", "wall time since the run began or was resumed", SeriesUse::effort},
};

// The entry of a series, be it a member of a family; nullptr if there is none.
const SeriesEntry* find_series(std::string_view name);

// The meaning of the series `name`, with its number in place of <...>.
std::string meaning_of(const SeriesEntry& entry, std::string_view name);

// Whether a series of this name can be expected, and the names to suggest: families as such but for the energy terms.
bool is_expectable(std::string_view name);
std::vector<std::string> expectable_series();

// What follows energy_ in the name of a part of the energy, such as 42 or formula; empty for other series.
std::string_view energy_part(std::string_view name);

// A name or family of the catalogue: any other does not compile.
class SeriesName {
public:
    consteval SeriesName(const char* name) : entry_(nullptr) {
        for (const SeriesEntry& entry : series_catalogue)
            if (entry.name == name) entry_ = &entry;
        if (!entry_) throw "the catalogue has no such series";
    }
    const SeriesEntry& entry() const { return *entry_; }

private:
    const SeriesEntry* entry_;
};

}  // namespace tubule
