#include "axisym/graph/graph_derivatives.hpp"

#include "axisym/graph/graph_mesh.hpp"
#include "axisym/splines/breaks.hpp"

namespace tubule::axisym {

std::vector<TermCheck> check_terms(const Forms& forms, const Eigen::VectorXd& x) {
    std::vector<TermCheck> checks;
    const Bending& all = forms.bending();
    const std::vector<std::string> names = term_names(all);
    const auto add = [&](const std::string& key, const Bending& alone) {
        const Forms single(forms.space(), alone);
        checks.push_back(
            {key, check_derivatives([&](const Eigen::VectorXd& y) { return single.free_energy(y); },
                                    [&](const Eigen::VectorXd& y) { return single.gradient(y); },
                                    [&](const Eigen::VectorXd& y, const Eigen::VectorXd& w) -> Eigen::VectorXd {
                                        return single.hessian(y) * w;
                                    },
                                    x)});
    };
    for (std::size_t i = 0; i < count_terms(all); ++i) {
        if (modulus(all, i) == 0) continue;
        Bending alone = all;
        alone.kg = 0;
        for (std::size_t j = 0; j < count_terms(all); ++j)
            if (j != i) modulus(alone, j) = 0;
        add((i < n_bending_terms || !all.terms[i - n_bending_terms].formula ? "k" : "") + names[i], alone);
    }
    if (all.kg != 0) add("kg", Bending{.kg = all.kg});
    return checks;
}

std::vector<TermCheck> check_terms(const Problem& c) {
    const Tube& tube = std::get<Tube>(c.shape);
    const Cell cell = cell_of(tube, c.discretisation.symmetry);
    const int order = c.discretisation.order;
    const SplineSpace space(cell, equal_breaks(12, cell), order, c.discretisation.smoothness.value_or(order - 1));
    const Forms forms(space, c.energy);
    return check_terms(forms, space.project([&](double z) { return radius_at(tube, z); }));
}

}  // namespace tubule::axisym
