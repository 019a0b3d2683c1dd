#include "tools/scan/tiers.hpp"

#include "axisym/equilibrium_run.hpp"
#include "axisym/run.hpp"

namespace tubule {

std::vector<std::string> series_names(const Case& c) {
    if (c.equilibrium) return axisym::equilibrium_series_names(c);
    return c.tier == Tier::axisym ? axisym::series_names(c) : surface3d::series_names(c);
}

RunSummary run_tier(const Case& c, RunObserver& observer, const surface3d::Restart* restart) {
    if (c.equilibrium) return axisym::run_equilibrium(c, observer);
    if (c.tier == Tier::axisym) return axisym::run(c, observer, restart ? &restart->record : nullptr);
    if (restart && !c.moves()) observer.discard();  // nothing moves: there is no half of it to go on from
    return surface3d::run(c, observer, restart);
}

}  // namespace tubule
