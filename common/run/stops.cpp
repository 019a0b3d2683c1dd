#include "common/run/stops.hpp"

#include <fmt/format.h>

namespace tubule {

StopReport neck_closed(double radius, const std::string& where, double time) {
    return {Stop::pinch_off, time, fmt::format("the neck radius fell to {:.6g} at {}", radius, where),
            "lower accuracy.r_min to follow the neck further"};
}

StopReport ill_posed(const std::string& where, double time) {
    return {Stop::ill_posed, time, "the principal symbol f_HH + 2 f_HK x + f_KK x^2 reached zero at " + where,
            "the energy does not resist short waves there; more elements help only if these do not resolve the "
            "curvature"};
}

StopReport behind_wall(const std::string& where, double time) {
    return {Stop::undefined, time, "the membrane is behind the wall of a potential at " + where,
            "place the initial shape in front of the wall, or choose law = \"9-3\", which nothing passes"};
}

StopReport energy_rises(double rise, double time) {
    return {Stop::resolution_lost, time,
            fmt::format("the next step raises the energy by {:.2g} of E_ref, but this flow can only lose energy", rise),
            "use a tighter accuracy.energy; check that the energy resists bending where H = H0"};
}

StopReport unresolved_waves(const std::string& what, double times, double time, const std::string& refine) {
    return {Stop::resolution_lost, time,
            fmt::format("{} {:.2g} times sqrt(2 kg/|f_HH + 2 f_HK x + f_KK x^2|), the length below which only the "
                        "gradient term damps waves",
                        what, times),
            refine + "; a larger energy.kg needs fewer elements"};
}

StopReport undefined_energy(const FormulaDomain::Margin& margin, double time, const std::string& where) {
    return {Stop::undefined, time, fmt::format("a formula is hardly defined any more at {}: {}", where, words(margin)),
            "choose a formula that is defined for all curvatures and places which the membrane may take"};
}

StopReport undefined_pressure(const FormulaDomain::Margin& margin, double time) {
    return {
        Stop::undefined, time,
        fmt::format("the pressure is hardly defined any more at the volume {:.6g}: {}", margin.place, words(margin)),
        "choose a formula for model.pressure that is defined for all volumes which the membrane may enclose"};
}

}  // namespace tubule
