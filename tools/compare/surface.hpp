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

// A point of quadrature (weight: area) or, with weight 0, one more to look at; `reach` is how far, in coordinates, the
// next samples are.
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
    // A length over which the distance from a smooth surface may go up and down: of an element. 0: axisymmetric about
    // z.
    virtual double grain() const = 0;

    virtual Foot foot(const Eigen::Vector3d& x) const = 0;
    virtual Eigen::Vector3d at(const Place& place) const = 0;
    virtual void confine(Place& place) const = 0;  // moves it to where the piece ends if it is beyond

    // All over the surface, closely enough to see its own grain and this one, of another surface; where both are
    // axisymmetric, on one meridian that stands for all.
    virtual std::vector<Sample> samples(double grain) const = 0;
};

}  // namespace tubule::compare
