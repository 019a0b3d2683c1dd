// The interface for comparing two shapes: the nearest point of one, and samples of the other.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/shapes/perturbed_curve.hpp"
#include "surface3d/mesh/box_tree.hpp"
#include "surface3d/mesh/closest_point.hpp"

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

// Throws std::invalid_argument unless both are closed, or tubes of one period.
inline void require_same_kind(const Surface& a, const Surface& b) {
    const auto words = [](const Surface& s) {
        return s.period() > 0 ? "a tube of period " + std::to_string(s.period()) : std::string("a closed surface");
    };
    if (std::abs(a.period() - b.period()) > 1e-9 * a.period())
        throw std::invalid_argument("one is " + words(a) + ", the other is " + words(b));
}

// A surface of revolution as a frame of tier axisym holds it. Points are sought in the half plane (r, z), by Newton's
// method from the pieces of the profile that can be nearest. A Place is (s, theta): s from 0 to 1 along the profile,
// theta the angle around the axis; there is only one piece.
class RevolutionSurface final : public Surface {
public:
    explicit RevolutionSurface(PerturbedCurve curve);

    double period() const override { return curve_.length; }
    double grain() const override { return 0; }
    Foot foot(const Eigen::Vector3d& x) const override;
    Eigen::Vector3d at(const Place& place) const override;
    void confine(Place& place) const override;
    std::vector<Sample> samples(double grain) const override;

private:
    struct Nearest;

    CurveSample evaluate(double s) const;
    void add_part(double from, double to, int depth, std::vector<surface3d::BoxTree<2>::Box>& boxes);
    void look_at(double from, double to, const Eigen::Vector2d& x, Nearest& nearest) const;
    std::vector<double> panels(double width) const;

    PerturbedCurve curve_;
    std::vector<double> breaks_;  // of the parts, ascending
    std::vector<double> bulge_;   // how far each part is off its chord, at most
    surface3d::BoxTree<2> tree_;
};

// A surface of curved triangles P_k as a frame of tier surface3d holds it. Nearest points are exact up to rounding. A
// Place is a triangle and (xi, eta).
class TriangleSurface final : public Surface {
public:
    // Throws std::invalid_argument for an order other than 1 ... 4 and lengths that do not fit.
    explicit TriangleSurface(const surface3d::CurvedMesh& mesh);

    double period() const override { return period_; }
    double grain() const override { return grain_; }
    Foot foot(const Eigen::Vector3d& x) const override;
    Eigen::Vector3d at(const Place& place) const override;
    void confine(Place& place) const override;
    std::vector<Sample> samples(double grain) const override;

private:
    int order_, triangles_;
    double period_, grain_ = 0;
    surface3d::ClosestPoint nearest_;
};

}  // namespace tubule::compare
