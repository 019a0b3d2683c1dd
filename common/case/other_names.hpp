// Names that papers and other programs have for keys of a case.
#pragma once

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

namespace tubule {

struct OtherName {
    std::string_view table, names;  // names in small letters, each between blanks
    std::string_view key;           // of the same table; empty where there is none
    std::string_view words;         // what to write
};

inline constexpr std::array other_names{
    OtherName{"", " mode modes noise ", "", "write [[shape.mode]] or [[shape.noise]]"},
    OtherName{"", " title source ", "", "write it under [about]"},
    OtherName{"", " k20 k40 k42 h0 kappa c0 ", "", "write it under [energy]"},
    OtherName{"", " radius length ", "", "write it under [shape]"},
    OtherName{"", " end output ", "", "write it under [time]"},
    OtherName{"", " re gamma volume area tension pressure ", "", "write it under [model]"},
    OtherName{"units", " kappa k_b kb kc k_c bending_modulus rigidity energy ", "bending_rigidity",
              "write bending_rigidity"},
    OtherName{"energy", " kappa k_b kb kc k_c bending_rigidity bending_modulus rigidity ", "k20",
              "write k20 = kappa/2: the energy is INT k20 (H - H0)^2 dS, H the sum of the principal curvatures"},
    OtherName{"energy", " kappa_bar kappabar kbar k_bar kappa_g kg gaussian_modulus gaussian_rigidity ", "",
              "the Gaussian modulus bends no closed or periodic membrane; to count its energy, write [[energy.term]] "
              "with modulus, H = 0 and K = 1"},
    OtherName{"energy", " c0 c_0 h_0 spontaneous_curvature spontaneous ", "H0",
              "write H0 = -c0: spheres and tubes have H < 0, -2/R and -1/R, where papers have c0 > 0"},
    OtherName{"energy", " delta_a0 deltaa0 da0 delta_a area_difference ", "M0",
              "write M0 = -DeltaA0/D, with the distance D of the layers: M is the integral of H, negative on vesicles"},
    OtherName{"energy", " sigma tension surface_tension gamma ", "",
              "write model.tension, for a membrane whose area is free; what a fixed area needs is computed"},
    OtherName{"energy", " p pressure delta_p ", "",
              "write model.pressure, for a volume that is free; what a fixed volume needs is computed"},
    OtherName{"model", " viscosity eta mu ", "Re", "write Re, which is 1/viscosity"},
    OtherName{"model", " friction drag zeta ", "gamma", "write gamma"},
    OtherName{"model", " sigma surface_tension ", "tension", "write tension"},
    OtherName{"model", " p delta_p osmotic_pressure ", "pressure", "write pressure, inside minus outside"},
    OtherName{"model", " type name ", "kind", "write kind"},
    OtherName{"shape", " type name ", "kind", "write kind"},
    OtherName{"shape", " r r0 r_0 ", "radius", "write radius"},
    OtherName{"shape", " l l0 period wavelength height lambda ", "length", "write length"},
    OtherName{"shape", " amplitude epsilon perturbation wave waves ", "mode",
              "write [[shape.mode]] with amplitude and number of each wave"},
    OtherName{"time", " t tmax t_max tend t_end t_final final duration stop ", "end", "write end"},
    OtherName{"time", " dt step timestep time_step ", "",
              "the step follows from accuracy.energy; output has the times of frames"},
    OtherName{"time", " frames save interval n_frames output_times ", "output",
              "write output, times or a range \"lo:hi:n\""},
    OtherName{"accuracy", " tol tolerance rtol error ", "energy", "write energy, the asked error relative to E_ref"},
    OtherName{"discretisation", " mesh scheme step relaxation follow_curvature coarsen recovery smoothing ", "",
              "only tier \"surface3d\" has it"},
    OtherName{"discretisation", " time_order ", "", "write time.max_order, of IDA"},
    OtherName{"discretisation", " smoothness symmetry parametrisation ", "", "only tier \"axisym\" has it"},
    OtherName{"discretisation", " n resolution nodes points triangles n_elements ", "elements",
              "write elements, or leave it out: accuracy.energy decides"}};

inline const OtherName* other_name(std::string_view table, std::string_view key) {
    std::string name = " ";
    for (const char c : key) name += c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    name += ' ';
    const auto found = std::ranges::find_if(other_names, [&](const OtherName& other) {
        return other.table == table && other.names.find(name) != other.names.npos;
    });
    return found == other_names.end() ? nullptr : &*found;
}

}  // namespace tubule
