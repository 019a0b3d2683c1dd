// Each property that a key needs is missing once: the case is refused there, with the words of its row.
#include "common/case/requirements.hpp"

#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

#include "common/case/read.hpp"
#include "tests/support/message_of.hpp"

namespace tubule::requirements_test {

const std::string tube = "[energy]\nk20 = 1\n[shape]\nkind = \"tube\"\nradius = 1\nlength = 2\n",
                  motion = "[time]\nend = 1\n";
const std::string axisym = "tier = \"axisym\"\n" + tube + motion, surface = "tier = \"surface3d\"\n" + tube,
                  moving = surface + motion, automatic = "tier = \"auto\"\n" + tube + motion,
                  surface_equilibrium =
                      "tier = \"surface3d\"\nequilibrium = {}\n[energy]\nk20 = 1\n[shape]\nkind = \"sphere\"\n"
                      "radius = 1\n[accuracy]\nenergy = 0.1\n",
                  equilibrium =
                      "tier = \"axisym\"\nequilibrium = {}\n[energy]\nk20 = 1\n[shape]\nkind = \"sphere\"\n"
                      "radius = 1\n";

const std::string sphere = "tier = \"axisym\"\n[energy]\nk20 = 1\n[shape]\nkind = \"sphere\"\nradius = 1\n" + motion;

// A case, what is set in it, and the property that the last of the keys then lacks.
struct Refused {
    std::string text;
    std::vector<std::string> sets;
    std::string words;
};
const std::string wall = "energy.potential=[{kind=\"plane\", z=-2, strength=1, range=0.1}]";
const std::string H0_of_z = "energy.H0=sin(pi*z)", H0_of_area = "energy.H0=-1-0.1*area";
const std::string units = "units={length=\"50 nm\", bending_rigidity=\"20 kT\"}";
const std::vector<Refused> refused{
    {axisym, {"auto.modes=2"}, "tier = \"auto\""},
    {surface, {"shape={kind=\"patch\", radius=1}"}, "tier = \"axisym\""},
    {axisym, {"model.rim=hinged"}, "shape.kind = \"patch\""},
    {equilibrium,
     {"shape={kind=\"patch\", radius=1, height=1}",
      "equilibrium={held=\"nothing\", branch={vary=\"shape.height\", to=2, step=1}}"},
     "shape.second_radius"},
    {moving, {"equilibrium.modes=2"}, "tier = \"axisym\""},
    {automatic, {"equilibrium.descend=true"}, "tier = \"axisym\" or"},
    {surface_equilibrium, {"equilibrium.family=prolate"}, "tier = \"axisym\""},
    {surface_equilibrium, {H0_of_z}, "tier = \"axisym\" where [equilibrium] is"},
    {surface_equilibrium, {"equilibrium.branch={vary=\"energy.kg\", to=1, step=0.5}"}, "tier = \"axisym\""},
    {equilibrium,
     {"shape={kind=\"patch\", radius=1, height=1}",
      "equilibrium={held=\"nothing\", branch={vary=\"energy.kg\", to=1, step=0.5}}"},
     "a closed surface or a tube"},
    {equilibrium, {"equilibrium.rates=2"}, "tier = \"surface3d\""},
    {equilibrium, {"model.kind=fluid", "equilibrium.modes=2"}, "a model without inertia"},
    {equilibrium, {"shape={kind=\"torus\", radius=2, tube_radius=1}"}, "a motion, without [equilibrium]"},
    {surface, {"model.kind=fluid"}, "a table [time]"},
    {axisym, {"model.Re=1"}, "model.kind = \"stokes\" or"},
    {axisym, {"model.gamma=1"}, "model.kind = \"overdamped\" or"},
    {axisym, {"model.chosen=fluid"}, "model.kind = \"auto\""},
    {axisym, {"model.kind=auto", "model.chosen=overdamped"}, "model.gamma > 0"},
    {equilibrium, {"model.kind=auto"}, "a motion, without [equilibrium]"},
    {moving, {"discretisation.step=0.1", "discretisation.scheme=paper", "model.kind=auto"}, "a discretisation.scheme"},
    {axisym, {"model.kind=stokes", "model.area=free"}, "model.kind = \"gradient-flow\""},
    {axisym, {"model.area=reservoir"}, "model.kind = \"overdamped\" or"},
    {equilibrium, {"model.area=fixed", "model.period=free"}, "a tube"},
    {axisym, {"model.period=free"}, "a fixed area or volume"},
    {axisym, {"model.area=fixed", "model.tension=1"}, "model.area = \"free\" or"},
    {axisym, {"model.volume=fixed", "model.pressure=1"}, "model.volume = \"free\""},
    {axisym, {"model.force=1"}, "model.period = \"free\" or model.bead_width"},
    {axisym, {"model.bead_width=0.1"}, "a closed surface"},
    {equilibrium,
     {"model.bead_width=0.1", "model.extension={time=[0,1],value=[0,1]}"},
     "a motion, without [equilibrium]"},
    {axisym, {"model.extension=1"}, "model.bead_width"},
    {equilibrium, {"model.tension={time=[0,1],value=[0,1]}"}, "a motion, without [equilibrium]"},
    {equilibrium, {"model.pressure={time=[0,1],value=[0,1]}"}, "a motion, without [equilibrium]"},
    {"tier = \"axisym\"\nequilibrium = {}\n" + tube,
     {"model.period=free", "model.area=fixed", "model.force={time=[0,1],value=[0,1]}"},
     "a motion, without [equilibrium]"},
    {automatic, {"model.source.mass=t"}, "tier = \"axisym\" or"},
    {equilibrium, {"model.source.force_z=t"}, "a motion, without [equilibrium]"},
    {axisym, {"model.kind=auto", "model.source.force_z=t"}, "a model that is named"},
    {axisym, {"model={area=\"fixed\", period=\"free\"}", "model.source.force_z=t"}, "model.period = \"fixed\""},
    {axisym, {"shape={kind=\"patch\", radius=1}", "model.source.force_z=t"}, "a closed surface or a tube"},
    {axisym, {"model.kind=stokes", "model.source.force_z=t"}, "inertia or friction"},
    {axisym, {"model.source.mass=t"}, "model.kind = \"overdamped\" or"},
    {axisym, {"model={kind=\"fluid\", area=\"reservoir\"}", "model.source.mass=t"}, "model.area = \"fixed\""},
    {axisym, {"model.source.force_theta=t"}, "model.kind = \"fluid\" or"},
    {surface, {"velocity.initial=rest"}, "a table [time]"},
    {equilibrium, {"model.kind=fluid", "velocity.initial=rest"}, "a motion, without [equilibrium]"},
    {axisym, {"velocity.initial=rest"}, "model.kind = \"fluid\" or"},
    {axisym,
     {"model={kind=\"auto\", chosen=\"stokes\"}", "velocity={omega=1, initial=\"rotation\"}"},
     "model.chosen = \"fluid\""},
    {axisym, {"model={kind=\"auto\", chosen=\"stokes\"}", "velocity.initial=result"}, "model.chosen = \"fluid\""},
    {axisym, {"model.kind=fluid", "velocity.initial=result"}, "shape.kind = \"result\""},
    {axisym, {"velocity.omega=1"}, "model.kind = \"fluid\" or"},
    {axisym, {"model.kind=fluid", "velocity.omega=1"}, "velocity.initial = \"rotation\""},
    {surface, {"accuracy.relative_to=energy"}, "a table [time]"},
    {equilibrium, {"accuracy.relative_to=energy"}, "a motion, without [equilibrium]"},
    {surface, {"accuracy.r_min=0.1"}, "a table [time]"},
    {axisym, {"accuracy.estimate=false"}, "a surface in motion"},
    {equilibrium, {"time.end=1"}, "a motion, without [equilibrium]"},
    {equilibrium, {"time.output=[]"}, "a motion, without [equilibrium]"},
    {equilibrium, {"time.stationary=0.1"}, "a motion, without [equilibrium]"},
    {moving, {"time.integrator=ida"}, "tier = \"axisym\""},
    {equilibrium, {"time.integrator=ida"}, "a motion, without [equilibrium]"},
    {axisym, {"model.kind=stokes", "time.integrator=rosenbrock"}, "a graph r(z): "},
    {axisym, {"energy.alpha=1", "time.integrator=rosenbrock"}, "an energy without energy.alpha"},
    {moving, {"time.max_order=2"}, "tier = \"axisym\""},
    {equilibrium, {"time.max_order=2"}, "a motion, without [equilibrium]"},
    {axisym, {"time.integrator=rosenbrock", "time.max_order=2"}, "time.integrator = \"ida\""},
    {axisym, {"model.kind=fluid", "discretisation.parametrisation=graph"}, "a graph r(z): "},
    {axisym, {"energy.alpha=1", "discretisation.parametrisation=graph"}, "an energy without energy.alpha"},
    {axisym, {H0_of_area, "discretisation.parametrisation=even"}, "a number energy.H0"},
    {axisym, {"discretisation.parametrisation=material"}, "a flow along the membrane"},
    {moving, {"discretisation.recovery=patch"}, "a single surface"},
    {moving, {"discretisation.smoothing=0.1"}, "scheme = \"paper\""},
    {surface, {"discretisation.scheme=bdf"}, "a table [time]"},
    {surface, {"discretisation.step=0.1"}, "a table [time]"},
    {surface, {"discretisation.time_tolerance=1e-3"}, "a table [time]"},
    {surface, {"discretisation.relaxation=0.1"}, "a table [time]"},
    {surface, {"discretisation.follow_curvature=true"}, "a table [time]"},
    {surface, {"discretisation.coarsen=true"}, "a table [time]"},
    {moving, {H0_of_z, "discretisation.relaxation=0.1"}, "a number energy.H0"},
    {moving, {H0_of_z, "discretisation.follow_curvature=true"}, "a number energy.H0"},
    {automatic, {"discretisation.scheme=paper"}, "tier = \"axisym\" or"},
    {moving, {"model.kind=overdamped", "discretisation.scheme=paper"}, "discretisation.step"},
    {moving, {"model.kind=fluid", "discretisation.scheme=bdf"}, "a model without inertia"},
    {automatic, {H0_of_area}, "tier = \"axisym\" or"},
    {surface, {H0_of_z}, "a table [time]"},
    {axisym, {"model={area=\"fixed\", period=\"free\"}", H0_of_area}, "model.period = \"fixed\""},
    {equilibrium, {"equilibrium.modes=2", H0_of_area}, "a case without equilibrium.modes"},
    {equilibrium,
     {"equilibrium.branch={vary=\"energy.H0\", to=1, step=0.1}", H0_of_area},
     "a branch that does not vary it"},
    {equilibrium, {H0_of_z}, "variable area alone"},
    {surface_equilibrium, {"energy.kg=1"}, "tier = \"axisym\" where [equilibrium] is"},
    {axisym,
     {"shape={kind=\"capsule\", radius=1, length=3}", "energy.kg=1"},
     "an initial shape whose curvature does not jump"},
    {axisym, {"discretisation.smoothness=1", "energy.kg=1"}, "discretisation.smoothness of 2"},
    {axisym, {"shape={kind=\"patch\", radius=1}", "energy.kg=1"}, "a closed surface or a tube"},
    {axisym, {units, "units.viscosity=3e-9 Pa s m"}, "model.kind = \"stokes\" or"},
    {axisym, {units, "units.density=5 mg/m^2"}, "model.kind = \"fluid\" or"},
    {surface, {units, "units.friction=2e4 Pa s/m"}, "a table [time]"},
    {axisym, {"energy.M0=-20"}, "energy.alpha"},
    {surface, {wall}, "a table [time]"},
    {axisym, {wall}, "a closed surface"},
    {axisym,
     {"model={area=\"fixed\", period=\"free\"}", "energy.potential=[{kind=\"formula\", formula=\"r\"}]"},
     "model.period = \"fixed\""},
    {equilibrium, {"equilibrium.family=prolate", wall}, "a case without equilibrium.family"},
    {equilibrium, {"model.kind=stokes", wall}, "inertia or friction"},
};
const std::vector<std::string> by_paper{"model.kind=overdamped", "discretisation.step=0.1"};
const std::vector<Refused> refused_by_paper{
    {moving, {"discretisation.time_tolerance=1e-3"}, "a scheme that adapts its step"},
    {moving, {"discretisation.relaxation=0.1"}, "a scheme that controls its mesh"},
    {moving, {"discretisation.follow_curvature=true"}, "a scheme that controls its mesh"},
    {moving, {"discretisation.coarsen=true"}, "a scheme that controls its mesh"},
    {moving, {"model.kind=gradient-flow", "discretisation.scheme=paper"}, "model.kind = \"overdamped\" or"},
    {moving, {"model.kind=stokes", "discretisation.scheme=paper"}, "inertia or friction"},
    {moving, {"model.area=reservoir", "discretisation.scheme=paper"}, "fixed area and period"},
    {moving, {H0_of_z, "discretisation.scheme=paper"}, "a number energy.H0"},
    {moving, {"energy.term=[{modulus=1, H=6}]", "discretisation.scheme=paper"}, "the terms k20, k40 and k42 alone"},
    {moving, {"model={kind=\"overdamped\"}", wall, "discretisation.scheme=paper"}, "a case without energy.potential"},
    {moving, {"energy.alpha=1", "discretisation.scheme=paper"}, "an energy without energy.alpha"},
};

std::string refusal(const std::string& text, const std::vector<std::string>& sets) {
    return test::message_of<CaseError>([&] { parse_case(text, sets, "case.toml"); });
}

TEST(Requirements, EachMissingPropertyIsNamed) {
    std::set<std::string> named;
    const auto expect_refused = [&](const Refused& one, const std::vector<std::string>& before) {
        std::vector<std::string> sets = before;
        sets.insert(sets.end(), one.sets.begin(), one.sets.end());
        const std::string last = one.sets.back().substr(0, one.sets.back().find('=')), what = refusal(one.text, sets);
        bool found = false;
        for (const Requirement& row : requirements())
            for (const Property& need : row.needs)
                if ((row.key.starts_with(last) || last.starts_with(row.key)) && need.words.starts_with(one.words) &&
                    what.find(": " + row.key + " must " + row.instead.substr(0, row.instead.find('{'))) != what.npos &&
                    what.find("only valid with " + need.words) != what.npos)
                    found = true, named.insert(row.key + row.instead + row.reason + need.words);
        EXPECT_TRUE(found) << sets.back() << " | " << one.words << "\n" << what;
    };
    for (const Refused& one : refused) expect_refused(one, {});
    for (const Refused& one : refused_by_paper) {
        std::vector<std::string> before = by_paper;
        before.push_back("discretisation.scheme=paper");
        expect_refused(one, before);
    }
    for (const Requirement& row : requirements())
        for (const Property& need : row.needs)
            EXPECT_TRUE(named.contains(row.key + row.instead + row.reason + need.words)) << row.key << need.words;
}

}  // namespace tubule::requirements_test
