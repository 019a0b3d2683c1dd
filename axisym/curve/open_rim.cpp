#include "axisym/curve/open_rim.hpp"

#include <cmath>

#include "common/geometry/profile_point.hpp"

namespace tubule::axisym {

OpenRim::OpenRim(const CurveSpace& space, int end, Rim rim) : space_(space), outward_(end == 0 ? -1 : 1) {
    const int e = space.splines().element_at(end), width = space.splines().width();
    double values[3 * SplineSpace::max_width];
    space.splines().splines(e, end, 2, values);
    for (int field = 0; field < 2; ++field)
        for (int a = 0; a < width; ++a) {
            const double sign = space.field(field).signs(e)[a];
            if (sign == 0) continue;
            Dof dof{space.dof(e, field, a), {}};
            for (int d = 0; d < 3; ++d) dof.at_end[d] = sign * values[d * width + a];
            dofs_[field].push_back(dof);
        }
    // n.u = z' u_r - r' u_z, and its derivative in s: of products of derivatives of the curve and of the velocity.
    std::vector<std::vector<std::array<int, 2>>> products{{{1, 0}}};
    if (rim == Rim::clamped) products.push_back({{1, 1}, {2, 0}});
    for (const auto& sum : products) {
        std::vector<Eigen::Triplet<double>> entries;
        for (const auto& [of_curve, of_velocity] : sum)
            for (int field = 0; field < 2; ++field)
                for (const Dof& x : dofs_[1 - field])
                    for (const Dof& u : dofs_[field])
                        entries.emplace_back(x.number, u.number,
                                             (field == 0 ? 1 : -1) * x.at_end[of_curve] * u.at_end[of_velocity]);
        conditions_.emplace_back(space.size(), space.size()).setFromTriplets(entries.begin(), entries.end());
    }
}

OpenRim::Pull OpenRim::pull(const Bending& bending, double tension, const double* x) const {
    using J = Jet<double, 6, 1>;
    double at[2][3] = {};
    for (int field = 0; field < 2; ++field)
        for (const Dof& dof : dofs_[field])
            for (int d = 0; d < 3; ++d) at[field][d] += x[dof.number] * dof.at_end[d];
    const J r = J::variable(at[0][0], 0), r1 = J::variable(at[0][1], 1), z1 = J::variable(at[1][1], 3);
    const auto p = profile_point(r, r1, J::variable(at[0][2], 2), z1, J::variable(at[1][2], 4));
    const auto f = density(bending, p.H.v, p.K.v);
    J sum = chain(p.H, p.K, f.f, f.H, f.K, 0.0, 0.0, 0.0);
    sum.v += tension;
    if (const std::optional<Formula> W = potential_density(bending.potentials)) {
        const J place[]{r, J::variable(at[1][0], 5)};
        sum += evaluate(*W, place);
    }
    const J along = (-outward_ * 2 * pi) * (r * sum * p.inverse_speed);
    const std::array<J, 2> force{along * r1, along * z1};

    Pull out;
    for (int field = 0; field < 2; ++field) {
        // At an open end one spline alone does not vanish: the first or the last.
        const Dof& last = outward_ < 0 ? dofs_[field].front() : dofs_[field].back();
        out.rows[field] = last.number, out.values[field] = force[field].v;
        for (const Dof& dof : dofs_[field]) out.columns.push_back(dof.number);
    }
    out.slopes.resize(2, static_cast<Eigen::Index>(out.columns.size()));
    Eigen::Index column = 0;
    for (int field = 0; field < 2; ++field)
        for (const Dof& dof : dofs_[field]) {
            const std::array<double, 3>& v = dof.at_end;
            for (int row = 0; row < 2; ++row) {
                const auto& d = force[row].d;
                out.slopes(row, column) =
                    field == 0 ? d[0] * v[0] + d[1] * v[1] + d[2] * v[2] : d[5] * v[0] + d[3] * v[1] + d[4] * v[2];
            }
            ++column;
        }
    return out;
}

OpenRim::VolumeAtEnd OpenRim::volume_at_end(const double* x) const {
    const auto last = [&](int field) { return (outward_ < 0 ? dofs_[field].front() : dofs_[field].back()).number; };
    const double r = x[last(0)];
    return {last(0), last(1), outward_ * pi * r * r, outward_ * 2 * pi * r};
}

std::array<double, 2> OpenRim::outflow(const double* x, const double* u) const {
    double r = 0, slope[2] = {}, velocity[2] = {};
    for (int field = 0; field < 2; ++field)
        for (const Dof& dof : dofs_[field]) {
            if (field == 0) r += x[dof.number] * dof.at_end[0];
            slope[field] += x[dof.number] * dof.at_end[1], velocity[field] += u[dof.number] * dof.at_end[0];
        }
    const double along = (slope[0] * velocity[0] + slope[1] * velocity[1]) / std::hypot(slope[0], slope[1]);
    return {outward_ * 2 * pi * r * along, velocity[0] * velocity[0] + velocity[1] * velocity[1]};
}

}  // namespace tubule::axisym
