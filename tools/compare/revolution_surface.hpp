// A surface of revolution as a frame of tier axisym holds it.
#pragma once

#include "common/shapes/perturbed_curve.hpp"
#include "surface3d/mesh/box_tree.hpp"
#include "tools/compare/surface.hpp"

namespace tubule::compare {

// Points are sought in the half plane (r, z), by Newton's method from the pieces of the profile that can be nearest. A
// Place is (s, theta): s from 0 to 1 along the profile, theta the angle around the axis; there is only one piece.
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

}  // namespace tubule::compare
