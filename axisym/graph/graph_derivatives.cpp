#include "axisym/graph/graph_derivatives.hpp"

#include "axisym/graph/graph_start.hpp"

namespace tubule::axisym {

std::vector<TermCheck> check_terms(const Forms& forms, const Eigen::VectorXd& x) {
    std::vector<TermCheck> checks;
    for_each_bending_term([&](std::size_t i, const auto& term) {
        if (forms.bending().k[i] == 0) return;
        Bending alone{.k = {}, .H0 = forms.bending().H0};
        alone.k[i] = forms.bending().k[i];
        const Forms single(forms.space(), alone);
        checks.push_back(
            {term.key, check_derivatives([&](const Eigen::VectorXd& y) { return single.free_energy(y); },
                                         [&](const Eigen::VectorXd& y) { return single.gradient(y); },
                                         [&](const Eigen::VectorXd& y, const Eigen::VectorXd& w) -> Eigen::VectorXd {
                                             return single.hessian(y) * w;
                                         },
                                         x)});
    });
    return checks;
}

std::vector<TermCheck> check_terms(const Case& c) {
    const Tube& tube = std::get<Tube>(c.shape);
    const Cell cell = cell_of(tube, c.discretisation.symmetry);
    const int order = c.discretisation.order;
    const ProfileSpace space(cell, uniform_breaks(cell, 12), order, c.discretisation.smoothness.value_or(order - 1));
    const Forms forms(space, c.energy);
    return check_terms(forms, space.project([&](double z) { return radius_at(tube, z); }));
}

}  // namespace tubule::axisym
