#include "axisym/curve/potential_forms.hpp"

#include <algorithm>
#include <cmath>

#include "axisym/splines/pack.hpp"
#include "common/geometry/jet.hpp"
#include "common/geometry/profile_point.hpp"

namespace tubule::axisym {
namespace {

namespace stdx = std::experimental;
constexpr int lanes = SplineSpace::lanes;

// r, z and their slopes at a group of points.
struct Local {
    Pack v[2][2] = {{Pack(0.0), Pack(0.0)}, {Pack(0.0), Pack(0.0)}};  // [r, z][derivative]

    Local(const CurveSpace& space, int e, int g, const double* x) {
        const auto& b = space.splines().basis(e, g);
        for (int field = 0; field < 2; ++field) {
            const SplineSpace& of = space.field(field);
            for (int a = 0; a < of.width(); ++a)
                for (int d = 0; d < 2; ++d)
                    v[field][d] += of.signs(e)[a] * x[space.dof(e, field, a)] * load(b.by_point[d][a]);
        }
        v[1][0] += space.rise(x) * load(b.z), v[1][1] += space.rise(x);
    }
};

// W dS/ds of a whole turn in (r, r', z, z').
template <int Order>
Jet<Pack, 4, Order> density(const Formula& W, const Local& at, double p) {
    using J = Jet<Pack, 4, Order>;
    const J r = J::variable(at.v[0][0], 0), r1 = J::variable(at.v[0][1], 1), z = J::variable(at.v[1][0], 2),
            z1 = J::variable(at.v[1][1], 3), place[]{r, z, J(p)}, square = r1 * r1 + z1 * z1;
    return (2 * pi) * (evaluate(W, place) * r * square * inverse_sqrt(square));
}

template <class Visit>
void each_group(const CurveSpace& space, const double* x, const Visit& visit) {
    for (int e = 0; e < space.splines().elements(); ++e)
        for (int g = 0; g < space.splines().groups(); ++g) visit(e, space.splines().basis(e, g), Local(space, e, g, x));
}

}  // namespace

PotentialObservation observe_potential(const CurveSpace& space, const Formula& W, std::span<const Potential> potentials,
                                       const double* x, double p_at) {
    constexpr double near = 4;  // ranges: farther away a wall hardly acts
    PotentialObservation out;
    const std::vector<double>& breaks = space.splines().breaks();
    const bool mirrored = space.images() == 2;  // whose forces balance
    each_group(space, x, [&](int e, const auto& basis, const Local& at) {
        for (int q = 0; q < lanes; ++q) {
            using J = Jet<double, 2, 1>;
            const double r = at.v[0][0][q], z = at.v[1][0][q], speed = std::hypot(at.v[0][1][q], at.v[1][1][q]);
            const J place[]{J::variable(r, 0), J::variable(z, 1), J(p_at)}, value = evaluate(W, place);
            const double dS = space.images() * basis.weight[q] * 2 * pi * r * speed;
            out.energy += value.v * dS, out.magnitude += std::abs(value.v) * dS,
                out.force -= mirrored ? 0 : value.d[1] * dS;
            for (const Potential& p : potentials) {
                if (!p.is_wall()) continue;
                const double distance = p.distance(r, z), size = speed * (breaks[e + 1] - breaks[e]) / p.range;
                if (distance < out.distance) out.distance = distance, out.s_distance = basis.z[q];
                if (distance < near * p.range && size > out.coarse) out.coarse = size, out.s_coarse = basis.z[q];
            }
        }
    });
    return out;
}

FormulaDomain::Margin potential_domain(const CurveSpace& space, std::span<const Potential> potentials,
                                       const double* x) {
    FormulaDomain::Margin out;
    for (const Potential& p : potentials) {
        if (p.is_wall()) continue;
        FormulaDomain domain(*p.formula);
        if (!domain.restricted()) continue;
        each_group(space, x, [&](int, const auto& basis, const Local& at) {
            for (int q = 0; q < lanes; ++q) {
                const double place[]{at.v[0][0][q], at.v[1][0][q]};
                domain.look(place, basis.z[q]);
            }
        });
        if (const auto margin = domain.margin(); !(margin.value >= out.value)) out = margin;
    }
    return out;
}

int elements_for(std::span<const Potential> potentials, double length) {
    double out = 0;
    for (const Potential& p : potentials)
        if (p.is_wall()) out = std::max(out, std::ceil(2 * length / p.range));
    return static_cast<int>(std::min(out, 1e6));
}

double potential_stretch(const CurveSpace& space, const Formula& W, const double* x) {
    Pack sum{0.0};
    each_group(space, x, [&](int, const auto& basis, const Local& at) {
        sum += load(basis.weight) * density<1>(W, at, 0).d[3] * at.v[1][1];
    });
    return space.images() * stdx::reduce(sum);
}

void add_potential_gradient(const CurveSpace& space, const Formula& W, double weight, const double* x, double* out,
                            double p) {
    each_group(space, x, [&](int e, const auto& basis, const Local& at) {
        const Jet<Pack, 4, 1> f = density<1>(W, at, p);
        const Pack factor = weight * space.images() * load(basis.weight);
        for (int field = 0; field < 2; ++field) {
            double local[SplineSpace::max_width];
            for (int a = 0; a < space.splines().width(); ++a)
                local[a] = stdx::reduce(factor * (f.d[2 * field] * load(basis.by_point[0][a]) +
                                                  f.d[2 * field + 1] * load(basis.by_point[1][a])));
            space.add(e, field, local, out);
        }
    });
}

void add_potential_hessian(const CurveSpace& space, const Formula& W, double weight, const double* x,
                           const std::vector<int>& slots, double* values, double p) {
    const int w = space.splines().width();
    each_group(space, x, [&](int e, const auto& basis, const Local& at) {
        const Jet<Pack, 4, 2> f = density<2>(W, at, p);
        const Pack factor = weight * space.images() * load(basis.weight);
        const int* slot = &slots[static_cast<std::size_t>(e) * 4 * w * w];
        for (int b = 0; b < 2 * w; ++b) {
            Pack by[4];  // d(density derivative)/d(coefficient b)
            for (int i = 0; i < 4; ++i)
                by[i] = factor * (f.dd[packed<4>(i, 2 * (b / w))] * load(basis.by_point[0][b % w]) +
                                  f.dd[packed<4>(i, 2 * (b / w) + 1)] * load(basis.by_point[1][b % w]));
            for (int a = 0; a < 2 * w; ++a) {
                const int i = 2 * (a / w);
                values[slot[b * 2 * w + a]] +=
                    space.field(a / w).signs(e)[a % w] * space.field(b / w).signs(e)[b % w] *
                    stdx::reduce(by[i] * load(basis.by_point[0][a % w]) + by[i + 1] * load(basis.by_point[1][a % w]));
            }
        }
    });
}

}  // namespace tubule::axisym
