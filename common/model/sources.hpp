// Sources of a motion, theory.md (3.26): a body force per area, and a source of membrane, as formulas of place and
// time.
#pragma once

#include <algorithm>
#include <array>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "common/formula/formula.hpp"

namespace tubule {

struct Sources {
    static constexpr std::array<std::string_view, 3> variables{"r", "z", "t"};      // in tier axisym
    static constexpr std::array<std::string_view, 4> in_space{"x", "y", "z", "t"};  // in tier surface3d

    std::array<std::shared_ptr<const Formula>, 3> force{};  // along r, theta, z or x, y, z; null is 0
    std::shared_ptr<const Formula> mass{};                  // div u, area that enters per area and time

    bool push() const {
        return std::ranges::any_of(force, [](const auto& f) { return f != nullptr; });
    }
    bool act() const { return push() || mass; }

    // At a point, given by all variables. S is a number or a jet.
    template <class S>
    S force_at(int component, const S* at) const {
        return force[component] ? evaluate(*force[component], at) : S(0.0);
    }
    template <class S>
    S mass_at(const S* at) const {
        return mass ? evaluate(*mass, at) : S(0.0);
    }
};

// Which arguments the formulas of sources had: see FormulaDomain.
class SourceDomain {
public:
    explicit SourceDomain(const Sources& sources) {
        for (const auto& formula : {sources.force[0], sources.force[1], sources.force[2], sources.mass})
            if (formula) of_each_.emplace_back(*formula);
        std::erase_if(of_each_, [](const FormulaDomain& one) { return !one.restricted(); });
    }
    bool restricted() const { return !of_each_.empty(); }
    void look(std::span<const double> variables, double place) {
        for (FormulaDomain& one : of_each_) one.look(variables, place);
    }
    FormulaDomain::Margin margin() const {
        FormulaDomain::Margin out;
        for (const FormulaDomain& one : of_each_)
            if (const auto margin = one.margin(); !(margin.value >= out.value)) out = margin;
        return out;
    }

private:
    std::vector<FormulaDomain> of_each_;
};

}  // namespace tubule
