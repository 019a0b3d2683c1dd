// From meridians of shapes, points and graphs to spline curves in proportion to arc length.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <vector>

#include "axisym/splines/curve_space.hpp"
#include "common/shapes/ellipsoid.hpp"
#include "common/shapes/meridian.hpp"
#include "common/shapes/revolution.hpp"

namespace tubule::axisym {

// Starts for the families of vesicles: a spheroid of this reduced volume (0 < v < 1) and the area 4 pi, prolate or
// oblate; and a bowl, the shell between spheres of the radii 1 and 1 - thickness, open above the polar angle `opening`
// from its bottom, with a round rim.
Meridian spheroid(double reduced_volume, bool prolate);
Meridian bowl(double thickness, double opening);
// The curve times a factor.
Meridian scaled(const Meridian& meridian, double factor);
// An existing curve, which is copied.
Meridian meridian(const CurveSpace& space, const Eigen::VectorXd& x);
// Through points (r, z) from end to end, by a quintic spline of the chord length. Closed cells begin and end with
// r = 0, half ones end with z = 0; of a period both ends are given. Throws std::invalid_argument.
Meridian meridian(const std::vector<std::array<double, 2>>& points, Topology topology, double length = 0);
// The first half of a mirror-symmetric meridian: from the pole to the equator, or half a period from its z = 0.
// Throws std::invalid_argument if the halves differ by more than 1e-6 of the size.
Meridian half(const Meridian& whole);

// The arc length of a meridian, tabulated.
class ArcLength {
public:
    // Keeps the meridian.
    explicit ArcLength(Meridian meridian);
    // From one end to the other, in units of the case.
    double total() const { return sum_.back(); }
    double parameter(double fraction) const;  // t at which this fraction of the length is reached
    // The fraction of the length, 0 to 1, up to the parameter t.
    double fraction(double t) const;
    const Meridian& meridian() const { return meridian_; }
    std::array<double, 2> point(double fraction) const;  // r, z
    std::vector<double> seams() const;                   // as fractions

private:
    double speed(double t) const;
    double integral(double from, double to) const;

    Meridian meridian_;
    std::vector<double> t_, sum_;
};

// The spline nearest to the meridian, parametrised in proportion to arc length.
Eigen::VectorXd fit(const CurveSpace& space, const ArcLength& curve);
Eigen::VectorXd fit(const CurveSpace& space, const Meridian& meridian);

// Breaks that include the seams (fractions, ascending), with elements of size `smallest` at a seam that grow by
// `growth` per distance up to `largest`.
std::vector<double> graded_breaks(const std::vector<double>& seams, double largest, double smallest,
                                  double growth = 0.4);

}  // namespace tubule::axisym
