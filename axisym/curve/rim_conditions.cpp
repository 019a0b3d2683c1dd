#include "axisym/curve/rim_conditions.hpp"

#include <cmath>

namespace tubule::axisym {

std::vector<Ring> rings_of(const Curve& curve, Rim rim) {
    std::vector<Ring> out;
    const int count = curve.topology == Topology::cap ? 1 : curve.topology == Topology::strip ? 2 : 0;
    for (int i = 0; i < count; ++i) {
        const auto [r, r1, z, z1] = curve.at(rim_parameter(i));
        const double g = std::hypot(r1, z1);
        out.push_back({r, z, {}});
        if (rim == Rim::clamped) out.back().tangent = {r1 / g, z1 / g};
    }
    return out;
}

std::vector<Ring> rings_of(const CurveSpace& space, const Eigen::VectorXd& x, Rim rim) {
    const auto at = [&](double s) {
        const CurveSample p = space.evaluate(x, s);
        return std::array{p.r, p.r1, p.z, p.z1};
    };
    return rings_of(Curve{space.topology(), 0, at}, rim);
}

Eigen::MatrixXd rim_functionals(const CurveSpace& space, const std::vector<Ring>& rings) {
    Eigen::MatrixXd out = Eigen::MatrixXd::Zero(space.size(), condition_count(rings));
    Eigen::Index column = 0;
    for (std::size_t i = 0; i < rings.size(); ++i) {
        const double s = rim_parameter(i);
        const int e = space.splines().element_at(s), width = space.splines().width();
        double values[3 * SplineSpace::max_width];
        space.splines().splines(e, s, 1, values);
        for (int a = 0; a < width; ++a) {
            const int r = space.dof(e, 0, a), z = space.dof(e, 1, a);
            out(r, column) += space.r().signs(e)[a] * values[a];
            out(z, column + 1) += space.z().signs(e)[a] * values[a];
            if (!rings[i].tangent) continue;
            const auto [t_r, t_z] = *rings[i].tangent;
            out(r, column + 2) += t_z * space.r().signs(e)[a] * values[width + a];
            out(z, column + 2) -= t_r * space.z().signs(e)[a] * values[width + a];
        }
        column += rings[i].conditions();
    }
    return out;
}

Eigen::VectorXd rim_values(const std::vector<Ring>& rings) {
    Eigen::VectorXd out = Eigen::VectorXd::Zero(condition_count(rings));
    Eigen::Index at = 0;
    for (const Ring& ring : rings) {
        out.segment<2>(at) << ring.r, ring.z;
        at += ring.conditions();
    }
    return out;
}

int condition_of_height(const std::vector<Ring>& rings) {
    return condition_count(rings) - rings.back().conditions() + 1;
}

}  // namespace tubule::axisym
