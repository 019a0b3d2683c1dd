// First guesses for the families of vesicles.
#pragma once

#include "common/shapes/curve.hpp"

namespace tubule::axisym {

// A spheroid of this reduced volume (0 < v < 1) and the area 4 pi, prolate or oblate; two spheres (1/sqrt 2 < v < 1)
// joined by a round neck, the smaller one above; and a bowl, the shell between spheres of the radii 1 and
// 1 - thickness, open above the polar angle `opening` from its bottom, with a round rim.
Curve spheroid(double reduced_volume, bool prolate);
Curve pear(double reduced_volume);
Curve bowl(double thickness, double opening);

}  // namespace tubule::axisym
