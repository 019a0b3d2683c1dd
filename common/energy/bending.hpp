// The bending energy density f(H,K) as a list of terms. This is the one place that knows its form:
// partial derivatives, case keys, series names and picture labels are derived from the list below.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>

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
};

// One term k * value(H, K, H0). `name` gives the series energy_<name>, `key` the case key of its
// modulus, `label` the formula in pictures (mathtext). `magnitude` >= |value| never vanishes on a
// curved membrane where value may; it scales the asked accuracy (E_ref).
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
                                [](auto H, auto, double H0) { return (H - H0) * (H - H0); },
                                [](auto H, auto, double H0) { return H * H + H0 * H0; }},
                    BendingTerm{"40", "k40", "k_{40}(H-H_0)^4",  //
                                [](auto H, auto, double H0) { return (H - H0) * (H - H0) * ((H - H0) * (H - H0)); },
                                [](auto H, auto, double H0) { return (H - H0) * (H - H0) * ((H - H0) * (H - H0)); }},
                    BendingTerm{"42", "k42", "k_{42}K^2",                    //
                                [](auto, auto K, double) { return K * K; },  //
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

// Moduli of the terms in their order, and the spontaneous curvature; dimensionless.
struct Bending {
    std::array<double, n_bending_terms> k{};
    double H0 = 0;
};

// The density and its derivatives in H and K, summed over the terms in use.
template <class T>
CurvatureJet<T> density(const Bending& bending, const T& H, const T& K) {
    CurvatureJet<T> h, k, sum;
    h.f = H, h.H = T(1.0);
    k.f = K, k.K = T(1.0);
    for_each_bending_term([&](std::size_t i, const auto& term) {
        if (bending.k[i] != 0) sum = sum + bending.k[i] * term.value(h, k, bending.H0);
    });
    return sum;
}

}  // namespace tubule
