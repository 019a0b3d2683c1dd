// What a case requires of the profile it begins with.
#pragma once

#include "common/case/problem.hpp"
#include "common/shapes/curve.hpp"

namespace tubule::axisym {

// Whether the profile, a patch, is flat.
bool is_flat(const Curve& shape);
// The distance of the beads of a case on this shape. CaseError where they do not suit it.
double bead_distance(const Problem& c, const Curve& shape);
// CaseError where a case asks of a patch what it has not.
void require_patch(const Problem& c, const Curve& shape);
// CaseError where the potentials of places of a case do not suit this shape.
void require_place(const Problem& c, const Curve& shape);

}  // namespace tubule::axisym
