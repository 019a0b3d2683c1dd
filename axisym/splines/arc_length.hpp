// Exact curves and splines: one from the other, in proportion to arc length.
#pragma once

#include <array>
#include <vector>

#include "axisym/splines/curve_space.hpp"
#include "common/shapes/curve.hpp"

namespace tubule::axisym {

// The curve times a factor.
Curve scaled(const Curve& meridian, double factor);
// An existing curve, which is copied.
Curve meridian(const CurveSpace& space, const Eigen::VectorXd& x);
// The first half of a mirror-symmetric meridian: from the pole to the equator, or half a period from its z = 0.
// Throws std::invalid_argument if the halves differ by more than 1e-6 of the size.
Curve half(const Curve& whole);

// The arc length of a meridian, tabulated.
class ArcLength {
public:
    // Keeps the meridian.
    explicit ArcLength(Curve meridian);
    // From one end to the other, in units of the case.
    double total() const { return sum_.back(); }
    double parameter(double fraction) const;  // t at which this fraction of the length is reached
    // The fraction of the length, 0 to 1, up to the parameter t.
    double fraction(double t) const;
    const Curve& meridian() const { return meridian_; }
    std::array<double, 2> point(double fraction) const;  // r, z
    std::vector<double> seams() const;                   // as fractions

private:
    double speed(double t) const;
    double integral(double from, double to) const;

    Curve meridian_;
    std::vector<double> t_, sum_;
};

// The spline nearest to the meridian, parametrised in proportion to arc length.
Eigen::VectorXd fit(const CurveSpace& space, const ArcLength& curve);
Eigen::VectorXd fit(const CurveSpace& space, const Curve& meridian);

}  // namespace tubule::axisym
