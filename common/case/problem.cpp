#include "common/case/problem.hpp"

namespace tubule {
namespace {

constexpr double high_accuracy = 1e-4;  // from here on, without inertia, steps of higher order pay

Scheme scheme_of(const Case& c, bool inertia) {
    if (c.surface.scheme) return *c.surface.scheme;
    if (!inertia && c.accuracy.energy < high_accuracy) return scheme_named("bdf");
    return default_scheme(inertia);
}

}  // namespace

Problem::Problem(const Case& c)
    : Case(c),
      law(motion_law(c.model)),
      scheme(scheme_of(c, law.inertia != 0)),
      element_order(tubule::element_order(c)),
      begin_time(c.handover ? c.handover->time : 0) {}

}  // namespace tubule
