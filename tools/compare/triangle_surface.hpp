// A surface of curved triangles P_k as a frame of tier surface3d holds it.
#pragma once

#include "surface3d/mesh/closest_point.hpp"
#include "tools/compare/surface.hpp"

namespace tubule::compare {

// Nearest points are exact up to rounding. A Place is a triangle and (xi, eta).
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
