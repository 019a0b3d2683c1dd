// The interface for comparing two shapes: the nearest point of one, and samples of the other.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <vector>

namespace tubule::compare {

// The nearest point of a surface.
struct Foot {
    Eigen::Vector3d point, normal;
    double distance = std::numeric_limits<double>::infinity();
};

// Coordinates on a piece of a surface, as the surface has them.
struct Place {
    int piece = 0;
    Eigen::Vector2d at = Eigen::Vector2d::Zero();
};

// A quadrature point (weight: area) or, with weight 0, an additional sample; `reach` is the distance, in
// coordinates, of the next samples.
struct Sample {
    Place place;
    Eigen::Vector2d reach;
    Eigen::Vector3d x;
    double weight = 0;
};

// A closed surface, or one period of a tube that stands for all of it.
class Surface {
public:
    virtual ~Surface() = default;

    virtual double period() const = 0;  // in z; 0: closed
    // The length over which the distance from a smooth surface may oscillate: that of an element. 0: axisymmetric
    // about z.
    virtual double grain() const = 0;

    virtual Foot foot(const Eigen::Vector3d& x) const = 0;
    virtual Eigen::Vector3d at(const Place& place) const = 0;
    virtual void confine(Place& place) const = 0;  // moves it back to the boundary of its piece if it is outside

    // Over the whole surface, dense enough to resolve its own grain and this one, of another surface; where both are
    // axisymmetric, on one meridian that represents all.
    virtual std::vector<Sample> samples(double grain) const = 0;
};

}  // namespace tubule::compare
