#include "tools/run/engine.hpp"

#include <stdexcept>

#include "axisym/equilibrium/equilibrium_run.hpp"
#include "axisym/run_profile.hpp"
#include "surface3d/run/equilibrium_run.hpp"
#include "surface3d/run/run_surface.hpp"
#include "tools/auto/auto_run.hpp"
#include "tools/auto/joined_file.hpp"

namespace tubule {

Engine::Engine(Problem c) : case_(std::move(c)) {
    if (case_.unknowns == Unknowns::equilibrium) {
        axisym::check_equilibrium(case_);
        return;
    }
    if (case_.model.kind == ModelKind::automatic) throw std::logic_error("a case whose model is not chosen yet");
    if (case_.unknowns == Unknowns::automatic)
        choice_ = choice_for(case_);
    else if (!case_.runs_in_tier_axisym())
        choice_.start.emplace(case_);
    if (case_.unknowns == Unknowns::surface_equilibrium) surface3d::check_equilibrium(case_, *choice_.start);
}

std::vector<std::string> Engine::series_names() const {
    switch (case_.unknowns) {
        case Unknowns::graph:
        case Unknowns::curve:
            return axisym::series_names(case_);
        case Unknowns::equilibrium:
            return axisym::equilibrium_series_names(case_);
        case Unknowns::surface_equilibrium:
            return surface3d::equilibrium_series_names(case_);
        case Unknowns::automatic:
            return joined_series_names(case_, choice_.axisymmetric);
        default:
            return surface3d::series_names(case_);
    }
}

void Engine::check_restart(const Record& record) const {
    if (case_.runs_in_tier_axisym() || (case_.unknowns == Unknowns::automatic && !record.mesh))
        axisym::check_restart(record);
    else if (case_.unknowns != Unknowns::surface && !case_.is_equilibrium())
        surface3d::check_restart(case_, record);
}

RunSummary Engine::run(RunObserver& observer, const Restart* restart, const Result* unfinished) const {
    switch (case_.unknowns) {
        case Unknowns::graph:
        case Unknowns::curve:
            return axisym::run_profile(case_, observer, restart);
        case Unknowns::equilibrium:
            return axisym::run_equilibrium(case_, observer);
        case Unknowns::surface_equilibrium:
            return surface3d::run_equilibrium(case_, *choice_.start, observer);
        case Unknowns::automatic:
            return run_auto(case_, choice_, observer, restart, unfinished);
        default:
            return surface3d::run_surface(case_, *choice_.start, observer, restart);
    }
}

}  // namespace tubule
