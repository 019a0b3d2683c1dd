// The bending energy density f(H,K) as a list of terms. This is the one place that knows its form:
// partial derivatives, case keys, series names and picture labels are derived from the list below, and from the further
// terms that a case has.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "common/energy/potential.hpp"
#include "common/formula/formula.hpp"

namespace tubule {

// Value and partial derivatives up to second order in (H, K) of a quantity, propagated by + - *.
template <class T>
struct CurvatureJet {
    T f{}, H{}, K{}, HH{}, HK{}, KK{};

    friend CurvatureJet operator+(const CurvatureJet& a, const CurvatureJet& b) {
        return {a.f + b.f, a.H + b.H, a.K + b.K, a.HH + b.HH, a.HK + b.HK, a.KK + b.KK};
    }
    friend CurvatureJet operator-(const CurvatureJet& a, const CurvatureJet& b) {
        return {a.f - b.f, a.H - b.H, a.K - b.K, a.HH - b.HH, a.HK - b.HK, a.KK - b.KK};
    }
    friend CurvatureJet operator*(const CurvatureJet& a, const CurvatureJet& b) {
        return {a.f * b.f,
                a.f * b.H + a.H * b.f,
                a.f * b.K + a.K * b.f,
                a.f * b.HH + a.HH * b.f + (a.H * b.H + a.H * b.H),
                a.f * b.HK + a.HK * b.f + (a.H * b.K + a.K * b.H),
                a.f * b.KK + a.KK * b.f + (a.K * b.K + a.K * b.K)};
    }
    friend CurvatureJet operator*(double c, const CurvatureJet& a) {
        return {c * a.f, c * a.H, c * a.K, c * a.HH, c * a.HK, c * a.KK};
    }
    friend CurvatureJet operator+(const CurvatureJet& a, double c) { return {a.f + c, a.H, a.K, a.HH, a.HK, a.KK}; }
    friend CurvatureJet operator-(const CurvatureJet& a, double c) { return {a.f - c, a.H, a.K, a.HH, a.HK, a.KK}; }
    friend CurvatureJet operator-(const CurvatureJet& a, const T& c) requires(!std::is_same_v<T, double>) {
        return {a.f - c, a.H, a.K, a.HH, a.HK, a.KK};
    }
};

// One term k * value(H, K, H0), all of which may be jets. `name` gives the series energy_<name>, `key` the case key of
// its modulus, `label` the formula in pictures (mathtext). `magnitude` scales the asked accuracy, theory.md (11.1). It
// does not bound |value|: that of k20 is half of it where H = -H0, but does not vanish where H = H0, as the value does.
template <class Value, class Magnitude>
struct BendingTerm {
    const char* name;
    const char* key;
    const char* label;
    Value value;
    Magnitude magnitude;
};

inline constexpr auto bending_terms =
    std::make_tuple(BendingTerm{"20", "k20", "k_{20}(H-H_0)^2",  //
                                [](auto H, auto, auto H0) { return (H - H0) * (H - H0); },
                                [](auto H, auto, double H0) { return H * H + H0 * H0; }},
                    BendingTerm{"40", "k40", "k_{40}(H-H_0)^4",  //
                                [](auto H, auto, auto H0) { return (H - H0) * (H - H0) * ((H - H0) * (H - H0)); },
                                [](auto H, auto, double H0) { return (H - H0) * (H - H0) * ((H - H0) * (H - H0)); }},
                    BendingTerm{"42", "k42", "k_{42}K^2",                  //
                                [](auto, auto K, auto) { return K * K; },  //
                                [](auto, auto K, double) { return K * K; }});

inline constexpr std::size_t n_bending_terms = std::tuple_size_v<decltype(bending_terms)>;

// Calls visit(index, term) for every term, in order.
template <class Visit>
constexpr void for_each_bending_term(Visit&& visit) {
    [&]<std::size_t... i>(std::index_sequence<i...>) {
        (visit(i, std::get<i>(bending_terms)), ...);
    }
    (std::make_index_sequence<n_bending_terms>{});
}

// The number of the term with this case key; does not compile if there is none.
consteval std::size_t term_number(std::string_view key) {
    std::size_t found = n_bending_terms;
    for_each_bending_term([&](std::size_t i, const auto& term) {
        if (key == term.key) found = i;
    });
    return found < n_bending_terms ? found : throw "no term has this key";
}

// A term of a case beyond the list: modulus (H-H0)^H K^K, or the modulus times a formula of H, K and H0.
struct EnergyTerm {
    double modulus = 0;
    int H = 0, K = 0;                             // powers of H - H0 and of K
    std::shared_ptr<const Formula> formula = {};  // instead of powers
    std::size_t entry = 0;                        // which entry of the case file it is, from 0

    static constexpr std::array<std::string_view, 3> variables{"H", "K", "H0"};
};
inline constexpr int most_power = 20;

// Moduli of the listed terms in their order, the spontaneous curvature, and what a case adds; dimensionless. Where H0
// varies over the membrane, the number is 0 and of no use: what evaluates the density says which H0 a point has.
struct Bending {
    std::array<double, n_bending_terms> k{};
    double H0 = 0;
    std::vector<EnergyTerm> terms = {};
    double kg = 0;                                   // of kg |grad H|^2 beside f, theory.md (2.25): >= 0
    std::shared_ptr<const Formula> H0_formula = {};  // of the place on the initial shape: see H0_variables.hpp
    // Area-difference elasticity, theory.md (2.19): alpha/2 (M - M0)^2 beside INT f dS, where M = INT H dS. Absent:
    // none.
    std::optional<double> alpha = {};
    double M0 = 0;
    std::vector<Potential> potentials = {};  // of places: INT W dS beside INT f dS
    double mu = 0;  // densities are f + mu H: see with_M(); but not in kernels that are made for fewer terms

    bool H0_varies() const { return H0_formula != nullptr; }
    // From points of a profile instead of the case: a formula of the area alone, in both tiers.
    bool H0_from_points() const { return H0_varies() && H0_formula->text.empty(); }
};

// alpha/2 (M - M0)^2 and its derivatives in M.
inline double area_difference_energy(const Bending& bending, double M) {
    return bending.alpha.value_or(0) / 2 * (M - bending.M0) * (M - bending.M0);
}
inline double area_difference_force(const Bending& bending, double M) {
    return bending.alpha.value_or(0) * (M - bending.M0);
}
// The energy whose densities exert the forces of the whole on a shape with this M: f + alpha (M - M0) H.
inline Bending with_M(Bending bending, double M) {
    bending.mu = area_difference_force(bending, M);
    return bending;
}

// The terms together are counted: first those of the list, then those of the case.
inline std::size_t count_terms(const Bending& bending) {
    return n_bending_terms + bending.terms.size();
}
inline double& modulus(Bending& bending, std::size_t term) {
    return term < n_bending_terms ? bending.k[term] : bending.terms[term - n_bending_terms].modulus;
}
inline double modulus(const Bending& bending, std::size_t term) {
    return term < n_bending_terms ? bending.k[term] : bending.terms[term - n_bending_terms].modulus;
}

// What follows energy_ in the series of a term: 41 for (H-H0)^2 K, of geometric order 4 with K to the power 1.
std::string term_name(const EnergyTerm& term);
// In mathtext for pictures, as BendingTerm::label; also by what follows energy_ in the name of its series.
std::string term_label(const EnergyTerm& term);
std::string term_label(std::string_view name);
// The names of all terms, in order.
std::vector<std::string> term_names(const Bending& bending);
// The modulus of a term in case files: energy.k20, energy.term.0.modulus.
std::string term_key(const Bending& bending, std::size_t term);
// The number of the listed term that is the same; n_bending_terms if there is none.
std::size_t listed_as(const EnergyTerm& term);
// Moves terms of the case to those of the list that are the same.
void merge_listed_terms(Bending& bending);

// Where the formula of a density is defined: see FormulaDomain.
class DensityDomain {
public:
    explicit DensityDomain(const Bending& bending) {
        for (const EnergyTerm& term : bending.terms)
            if (term.formula && term.modulus != 0) domain_.emplace(*term.formula);
    }
    bool restricted() const { return domain_ && domain_->restricted(); }
    void look(double H0, double H, double K, double place) {
        const double variables[]{H, K, H0};
        domain_->look(variables, place);
    }
    FormulaDomain::Margin margin() const { return domain_ ? domain_->margin() : FormulaDomain::Margin(); }

private:
    std::optional<FormulaDomain> domain_;
};

// Whether the principal symbol, theory.md (2.14), may change its sign and short waves then grow without end: not if it
// is a sum of squares, nor with kg > 0.
bool symbol_may_vanish(const Bending& bending);
// Words if the density has no lower bound, so that a membrane may gain energy without end; else empty.
std::string unbounded_below(const Bending& bending);

// x^n for whole n >= 0
template <class T>
T raised(const T& x, int n) {
    return n == 0 ? T(1.0) : whole_power(x, n);
}

template <class T>
const T& inner(const CurvatureJet<T>& x) {
    return x.f;
}
// F(a) given F, F', F'' at a.f.
template <class T>
CurvatureJet<T> chain(const CurvatureJet<T>& a, const T& f, const T& f1, const T& f2) {
    return {f, f1 * a.H, f1 * a.K, f1 * a.HH + f2 * a.H * a.H, f1 * a.HK + f2 * a.H * a.K, f1 * a.KK + f2 * a.K * a.K};
}

// The density of a term with modulus 1. T is a number, a pack of numbers, or what formulas are evaluated on.
template <class T, class T0>
T value_of(const EnergyTerm& term, const T& H, const T& K, const T0& H0) {
    if (!term.formula) return raised(T(H - T(H0)), term.H) * raised(K, term.K);
    const T variables[]{H, K, T(H0)};
    return evaluate(*term.formula, variables);
}
// The sum of the sizes of what a formula adds up, (|H|+|H0|)^H |K|^K of powers: see BendingTerm.
inline double magnitude_of(const EnergyTerm& term, double H, double K, double H0) {
    return value_of(term, Sized(H), Sized(K), H0).size;
}

// Which terms of a case a kernel is made for. A call that is not taken costs as much as the rest of a residual: it
// empties all vector registers.
enum class Added { none, powers, any };
inline Added added_to(const Bending& bending) {
    const auto has_formula = [](const EnergyTerm& term) { return term.formula != nullptr; };
    if (bending.terms.empty()) return Added::none;
    return std::ranges::any_of(bending.terms, has_formula) ? Added::any : Added::powers;
}

template <class T, class T0>
[[gnu::noinline]] T formula_value(const EnergyTerm& term, const T& H, const T& K, const T0& H0) {
    return value_of(term, H, K, H0);
}
template <class T, class T0>
[[gnu::noinline]] CurvatureJet<T> formula_density(const EnergyTerm& term, const T& H, const T& K, const T0& H0) {
    const CurvatureJet<T> variables[]{{H, T(1.0)}, {K, T(0.0), T(1.0)}, {T(H0)}};
    return term.modulus * evaluate(*term.formula, variables);
}

// Adds a term of powers, c x^a K^b with x = H - H0, and its derivatives.
template <class T>
void add_powers(const EnergyTerm& term, const T& x, const T& K, CurvatureJet<T>& sum) {
    const double a = term.H, b = term.K;
    const T p2 = term.H > 1 ? raised(x, term.H - 2) : T(0.0), q2 = term.K > 1 ? raised(K, term.K - 2) : T(0.0);
    const T p1 = term.H > 1 ? p2 * x : T(a), q1 = term.K > 1 ? q2 * K : T(b);  // of the powers 1 and 0: 1 and 0
    const T p = a > 0 ? p1 * x : T(1.0), q = term.modulus * (b > 0 ? q1 * K : T(1.0)), slope = (term.modulus * b) * q1;
    sum.f += p * q;
    sum.H += a * (p1 * q);
    sum.K += p * slope;
    sum.HH += (a * (a - 1)) * (p2 * q);
    sum.HK += a * (p1 * slope);
    sum.KK += (term.modulus * b * (b - 1)) * (p * q2);
}

// The density and its derivatives in H and K, summed over the terms in use and mu H, at a point with this H0: a number,
// or as many as H.
template <class T, Added added = Added::any, class T0>
CurvatureJet<T> density_at(const Bending& bending, const T0& H0, const T& H, const T& K) {
    CurvatureJet<T> h, k, sum;
    h.f = H, h.H = T(1.0);
    k.f = K, k.K = T(1.0);
    for_each_bending_term([&](std::size_t i, const auto& term) {
        if (bending.k[i] != 0) sum = sum + bending.k[i] * term.value(h, k, H0);
    });
    if constexpr (added == Added::none) return sum;
    if constexpr (added == Added::any) sum.f += bending.mu * H, sum.H += T(bending.mu);
    for (const EnergyTerm& term : bending.terms) {
        if (term.modulus == 0) continue;
        if constexpr (added == Added::any)
            if (term.formula) {
                sum = sum + formula_density(term, H, K, H0);
                continue;
            }
        add_powers(term, T(H - H0), K, sum);
    }
    return sum;
}
// The same where H0 is one number.
template <class T, Added added = Added::any>
CurvatureJet<T> density(const Bending& bending, const T& H, const T& K) {
    return density_at<T, added>(bending, bending.H0, H, K);
}

// df/dH0 of the density, and its derivatives in H, K and H0: theory.md (2.17).
template <class T>
struct SlopeInH0 {
    T f{}, H{}, K{}, H0{};
};
template <class T>
SlopeInH0<T> slope_in_H0(const Bending& bending, const T& H0, const T& H, const T& K) {
    // The first variable of the jet is H, then K; the second one is H0.
    const auto sum = [&](const T& along_H, const T& along_K) {
        using J = CurvatureJet<T>;
        const J h{H, along_H}, k{K, along_K}, h0{H0, T(0.0), T(1.0)};
        J out;
        for_each_bending_term([&](std::size_t i, const auto& term) {
            if (bending.k[i] != 0) out = out + bending.k[i] * term.value(h, k, h0);
        });
        for (const EnergyTerm& term : bending.terms) {
            if (term.modulus == 0) continue;
            const J variables[]{h, k, h0};
            out = out + term.modulus * (term.formula ? evaluate(*term.formula, variables)
                                                     : raised(h - h0, term.H) * raised(k, term.K));
        }
        return out;
    };
    const CurvatureJet<T> by_H = sum(T(1.0), T(0.0)), by_K = sum(T(0.0), T(1.0));
    return {by_H.K, by_H.HK, by_K.HK, by_H.KK};
}

// Calls visit(number, modulus times value) for each term in use.
template <class T, Added added = Added::any, class T0, class Visit>
void for_each_value_at(const Bending& bending, const T0& H0, const T& H, const T& K, Visit&& visit) {
    for_each_bending_term([&](std::size_t i, const auto& term) {
        if (bending.k[i] != 0) visit(i, T(bending.k[i] * term.value(H, K, H0)));
    });
    if constexpr (added == Added::none) return;
    for (std::size_t i = 0; i < bending.terms.size(); ++i) {
        const EnergyTerm& term = bending.terms[i];
        if (term.modulus == 0) continue;
        T value;
        if (added == Added::any && term.formula)
            value = formula_value(term, H, K, H0);
        else
            value = raised(T(H - H0), term.H) * raised(K, term.K);
        visit(n_bending_terms + i, T(term.modulus * value));
    }
}
template <class T, Added added = Added::any, class Visit>
void for_each_value(const Bending& bending, const T& H, const T& K, Visit&& visit) {
    for_each_value_at<T, added>(bending, bending.H0, H, K, visit);
}

// SUM |modulus| magnitude, which E_ref is made of.
inline double magnitude(const Bending& bending, double H0, double H, double K) {
    double sum = 0;
    for_each_bending_term(
        [&](std::size_t i, const auto& term) { sum += std::abs(bending.k[i]) * term.magnitude(H, K, H0); });
    for (const EnergyTerm& term : bending.terms)
        if (term.modulus != 0) sum += std::abs(term.modulus) * magnitude_of(term, H, K, H0);
    return sum;
}
inline double magnitude(const Bending& bending, double H, double K) {
    return magnitude(bending, bending.H0, H, K);
}

}  // namespace tubule
