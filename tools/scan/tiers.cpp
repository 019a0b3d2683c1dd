#include "tools/scan/tiers.hpp"

#include "axisym/equilibrium/equilibrium_run.hpp"
#include "axisym/run.hpp"
#include "tools/auto/auto_run.hpp"

namespace tubule {

std::vector<std::string> series_names(const Case& c) {
    if (c.equilibrium) return axisym::equilibrium_series_names(c);
    if (c.tier == Tier::automatic) return auto_series_names(c);
    return c.tier == Tier::axisym ? axisym::series_names(c) : surface3d::series_names(c);
}

void check_start(const Case& c) {
    if (c.tier == Tier::surface3d) surface3d::check_start(c);
    if (c.tier == Tier::automatic) check_auto_start(c);
    if (c.equilibrium) axisym::check_equilibrium(c);
}

void check_restart(const Case& c, const Record& record) {
    if (!record.mesh)
        axisym::check_restart(record);
    else if (c.moves())
        surface3d::check_restart(record);
}

RunSummary run_tier(const Case& c, RunObserver& observer, const surface3d::Restart* restart, const Result* unfinished) {
    if (c.tier == Tier::automatic) return run_auto(c, observer, restart, unfinished);
    if (c.equilibrium) return axisym::run_equilibrium(c, observer);
    if (c.tier == Tier::axisym) return axisym::run(c, observer, restart ? &restart->record : nullptr);
    if (restart && !c.moves()) observer.discard();  // nothing moves: there is no half of it to go on from
    return surface3d::run(c, observer, restart);
}

}  // namespace tubule
