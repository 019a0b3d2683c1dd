// Energy terms that a case adds: their density, names, keys and what is refused or warned of.
#include <gtest/gtest.h>

#include <memory>

#include "common/case/read.hpp"
#include "common/energy/bending.hpp"
#include "common/energy/principal_symbol.hpp"
#include "common/theory/dispersion.hpp"
#include "tests/support/message_of.hpp"

namespace tubule::energy_terms_test {

using test::message_of;

EnergyTerm powers(double modulus, int H, int K) {
    return {.modulus = modulus, .H = H, .K = K};
}
EnergyTerm formula(double modulus, const std::string& text) {
    return {.modulus = modulus, .formula = std::make_shared<const Formula>(parse_formula(text, EnergyTerm::variables))};
}

TEST(EnergyTerms, DensityIsThatOfHand) {
    // f = .7 h^3 + .2 h K^2 + .1 H^2 K with h = H - H0, derivatives by hand.
    const double H = -1.2, K = 0.4, H0 = 0.5, h = H - H0;
    for (const EnergyTerm& last : {formula(0.1, "H^2*K"), formula(0.05, "2*K*H*H")}) {
        const Bending energy{.k = {}, .H0 = H0, .terms = {powers(0.7, 3, 0), powers(0.2, 1, 2), last}};
        const auto f = density(energy, H, K);
        EXPECT_NEAR(f.f, 0.7 * h * h * h + 0.2 * h * K * K + 0.1 * H * H * K, 1e-14);
        EXPECT_NEAR(f.H, 2.1 * h * h + 0.2 * K * K + 0.2 * H * K, 1e-14);
        EXPECT_NEAR(f.K, 0.4 * h * K + 0.1 * H * H, 1e-14);
        EXPECT_NEAR(f.HH, 4.2 * h + 0.2 * K, 1e-14);
        EXPECT_NEAR(f.HK, 0.4 * K + 0.2 * H, 1e-14);
        EXPECT_NEAR(f.KK, 0.4 * h, 1e-14);
        double sum = 0;
        for_each_value(energy, H, K, [&](std::size_t, double value) { sum += value; });
        EXPECT_NEAR(sum, f.f, 1e-14);
    }
    const auto with_H0 = density(Bending{.k = {}, .H0 = H0, .terms = {formula(1, "(H - H0)^2")}}, H, K);
    EXPECT_NEAR(with_H0.f, h * h, 1e-14);
    EXPECT_NEAR(with_H0.H, 2 * h, 1e-14);
}

TEST(EnergyTerms, MagnitudesBoundTheirValues) {
    // (|H| + |H0|)^a |K|^b: 1.7^3 and 1.7 * .16.
    const Bending energy{.k = {}, .H0 = 0.5, .terms = {powers(-0.7, 3, 0), powers(0.2, 1, 2)}};
    EXPECT_NEAR(magnitude(energy, -1.2, 0.4), 0.7 * 4.913 + 0.2 * 1.7 * 0.16, 1e-14);
    EXPECT_GT(magnitude(Bending{.k = {}, .H0 = -1, .terms = {formula(1, "(H - H0)^2")}}, -1, 0), 1);  // f = 0 there
}

TEST(EnergyTerms, NamesFollowFromPowers) {
    EXPECT_EQ(term_name(powers(1, 3, 0)), "30");
    EXPECT_EQ(term_name(powers(1, 2, 1)), "41");
    EXPECT_EQ(term_name(powers(1, 8, 2)), "12_2");
    EXPECT_EQ(term_name(formula(1, "H")), "formula");
    EXPECT_EQ(term_label(powers(1, 2, 1)), "k_{41}(H-H_0)^{2}K");
    EXPECT_EQ(term_label(powers(1, 8, 2)), "k_{12,2}(H-H_0)^{8}K^{2}");
    EXPECT_EQ(listed_as(powers(1, 0, 2)), term_number("k42"));
    EXPECT_EQ(listed_as(powers(1, 1, 1)), n_bending_terms);
}

TEST(EnergyTerms, UnboundedDensitiesAreKnown) {
    const auto unbounded = [](decltype(Bending::k) k, std::vector<EnergyTerm> terms, double H0 = -1) {
        return !unbounded_below(Bending{.k = k, .H0 = H0, .terms = std::move(terms)}).empty();
    };
    EXPECT_FALSE(unbounded({1, 0, 0}, {}));
    EXPECT_FALSE(unbounded({0.2, 0, 0.06}, {}));
    EXPECT_TRUE(unbounded({1, 0, -0.1}, {}));
    EXPECT_TRUE(unbounded({1, 0, 0}, {powers(0.01, 3, 0)}));  // odd
    EXPECT_FALSE(unbounded({1, 0.1, 0}, {powers(0.01, 3, 0)}));
    EXPECT_TRUE(unbounded({1, 0, 0}, {powers(0.01, 2, 1)}));      // K may be negative
    EXPECT_FALSE(unbounded({1, 0.1, 0.1}, {powers(0.1, 2, 1)}));  // 4 * .1 * .1 > .1^2
    EXPECT_TRUE(unbounded({1, 0.1, 0.001}, {powers(0.1, 2, 1)}));
    EXPECT_FALSE(unbounded({1, 0, 0}, {powers(-9, 0, 1)}));  // INT K is the same for all shapes
    EXPECT_FALSE(unbounded({1, 0, 0}, {formula(-3, "tanh(H^2)")}));
    EXPECT_TRUE(unbounded({0, 0, 0}, {formula(-3, "log(1 + H^2)")}));
}

TEST(EnergyTerms, ThinTubesAndSmallSpheresHaveNoGradients) {
    const auto words = [](double k20, double k40, double k42) {
        return unbounded_below(Bending{.k = {k20, k40, k42}, .H0 = -1, .kg = 0.3});
    };
    EXPECT_CONTAINS(words(-1, 0, 0), "ever smaller spheres");  // f = -H^2 is 4 times that of tubes
    EXPECT_CONTAINS(words(1, 0, -2), "ever smaller spheres");
    EXPECT_CONTAINS(unbounded_below(Bending{.k = {-1, 0, 1}, .H0 = 0, .kg = 0.3}), "thinner straight tubes");
    EXPECT_EQ(words(-1, 1, 0), "");
    EXPECT_EQ(words(0, 1, -3), "");  // saddles have no bound of f, but they have gradients
    EXPECT_NE(unbounded_below(Bending{.k = {0, 1, -3}, .H0 = -1}), "");
}

TEST(EnergyTerms, TheSymbolOfSumsOfSquaresKeepsItsSign) {
    const auto may_vanish = [](std::vector<EnergyTerm> terms) {
        return symbol_may_vanish(Bending{.k = {1, 0, 0}, .H0 = 0, .terms = std::move(terms)});
    };
    EXPECT_FALSE(may_vanish({powers(1, 6, 0), powers(1, 0, 4), powers(-1, 0, 1), powers(2, 1, 0)}));
    EXPECT_TRUE(may_vanish({powers(-1, 6, 0)}));
    EXPECT_TRUE(may_vanish({powers(1, 3, 0)}));
    EXPECT_TRUE(may_vanish({powers(1, 2, 1)}));
    EXPECT_TRUE(may_vanish({formula(1, "H^2")}));
}

const std::string start = R"(tier = "axisym"
[energy]
k20 = 0.5
H0 = -1.0
)";
const std::string rest = R"([shape]
kind = "tube"
radius = 1.0
length = 2.0
[time]
end = 1.0
)";

Case with_terms(const std::string& terms, const std::vector<std::string>& sets = {}) {
    return parse_case(start + terms + rest, sets, "case.toml");
}

TEST(EnergyTerms, CasesHaveThem) {
    const Case c = with_terms(
        "[[energy.term]]\nmodulus = 0.1\nH = 1\nK = 1\n[[energy.term]]\nmodulus = 2\nformula = "
        "\"log(1 + H^2)\"\n",
        {"energy.term.0.modulus=0.3"});
    ASSERT_EQ(c.energy.terms.size(), 2u);
    EXPECT_EQ(c.energy.terms[0].modulus, 0.3);
    EXPECT_EQ(term_names(c.energy), (std::vector<std::string>{"20", "40", "42", "31", "formula"}));
    // What is written reads back as the same.
    const Case again = parse_case(effective_toml(c), {}, "case.toml");
    EXPECT_EQ(effective_toml(again), effective_toml(c));
    EXPECT_EQ(density(again.energy, -0.3, 0.2).f, density(c.energy, -0.3, 0.2).f);
}

TEST(EnergyTerms, ThoseOfTheListAreTheListedOnes) {
    const Case c = with_terms("[[energy.term]]\nmodulus = 0.1\nK = 2\n[[energy.term]]\nmodulus = 0.2\nH = 3\n");
    EXPECT_EQ(c.energy.k[term_number("k42")], 0.1);
    ASSERT_EQ(c.energy.terms.size(), 1u);
    EXPECT_EQ(term_key(c.energy, n_bending_terms), "energy.term.1.modulus");
}

TEST(EnergyTerms, BranchesFollowThem) {
    const std::string terms = "[[energy.term]]\nmodulus = 0.1\nK = 2\n[[energy.term]]\nmodulus = 0.2\nH = 3\n";
    const auto varied = [&](int entry) {
        const Case c = parse_case(start + terms +
                                      "[shape]\nkind = \"sphere\"\nradius = 1.0\n[equilibrium.branch]\nvary = "
                                      "\"energy.term." +
                                      std::to_string(entry) + ".modulus\"\nto = 0.5\nstep = 0.1\n",
                                  {}, "case.toml");
        return static_cast<std::size_t>(*c.equilibrium->branch.parameter);
    };
    EXPECT_EQ(varied(0), term_number("k42"));
    EXPECT_EQ(varied(1), n_bending_terms);
}

TEST(EnergyTerms, BadOnesAreRefusedWithTheirPlace) {
    const auto message = [](const std::string& terms, const std::vector<std::string>& sets = {}) {
        return message_of<CaseError>([&] { with_terms(terms, sets); });
    };
    const auto has = [](const std::string& text, const std::string& part) { EXPECT_CONTAINS(text, part); };
    const std::string term = "[[energy.term]]\n";
    has(message(term + "H = 3\n"), "missing key energy.term.0.modulus");
    has(message(term + "modulus = 1\nH = -1\n"), "case.toml:7:5: energy.term.0.H must be an integer >= 0 and <= 20");
    has(message(term + "modulus = 1\nH = 1.5\n"), "case.toml:7:5: energy.term.0.H must be an integer");
    has(message(term + "modulus = 1\n"), "needs a power");
    has(message(term + "modulus = 1\nH = 2\n"), "energy.term.0 is the term of energy.k20");
    has(message(term + "modulus = 1\nH = 3\n" + term + "modulus = 1\nH = 3\n"), "has the powers of energy.term.0");
    has(message(term + "modulus = 1\nformula = \"H^3\"\nH = 1\n"), "energy.term.0.H must be absent");
    // The column is that of the character in the line.
    has(message(term + "modulus = 1\nformula = \"H + abs(K)\"\n"),
        "case.toml:7:16: energy.term.0.formula, character 5");
    has(message("", {"expect.energy_31={value = 1, rel = 0.1}"}), "has energy_31, but the energy has no such term");
    has(message("", {"expect.energy_25={value = 1, rel = 0.1}"}), "unknown key expect.energy_25");
    EXPECT_EQ(with_terms(term + "modulus = 1\nH = 1\nK = 1\n", {"expect.energy_31={value = 1, rel = 0.1}"})
                  .expect.values.front()
                  .series,
              "energy_31");
}

}  // namespace tubule::energy_terms_test
