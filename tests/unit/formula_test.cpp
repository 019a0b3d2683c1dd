// Formulas as text: what they read, their values and derivatives, where they are defined.
#include "common/formula/formula.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "common/geometry/jet.hpp"

namespace tubule::formula_test {

constexpr std::array<std::string_view, 2> names{"x", "y"};

double value(const std::string& text, double x = 0, double y = 0) {
    const double variables[]{x, y};
    return evaluate(parse_formula(text, names), variables);
}

TEST(Formula, ReadsWhatItShould) {
    // Expected: the same expression in C++.
    const double x = 0.7, y = -1.3;
    EXPECT_DOUBLE_EQ(value("1 + 2*3 - 4/8"), 6.5);
    EXPECT_DOUBLE_EQ(value("2 - 3 - 4"), -5);
    EXPECT_DOUBLE_EQ(value("2^3^2"), 512);
    EXPECT_DOUBLE_EQ(value("-x^2", x), -x * x);
    EXPECT_DOUBLE_EQ(value("2^-2"), 0.25);
    EXPECT_DOUBLE_EQ(value("8/2/2"), 2);
    EXPECT_DOUBLE_EQ(value("(x + y)*(x - y)", x, y), x * x - y * y);
    EXPECT_DOUBLE_EQ(value("x^7", x), std::pow(x, 7));
    EXPECT_DOUBLE_EQ(value("x^(-3)", x), 1 / (x * x * x));
    EXPECT_DOUBLE_EQ(value("x^(5/2)", x), std::pow(x, 2.5));
    EXPECT_DOUBLE_EQ(value(" 1.5e1 * pi "), 15 * std::numbers::pi);
    EXPECT_DOUBLE_EQ(value("sqrt(x) + exp(y) + log(x) + sin(x) + cos(y)", x, y),
                     std::sqrt(x) + std::exp(y) + std::log(x) + std::sin(x) + std::cos(y));
    EXPECT_NEAR(value("sinh(x) + cosh(x) + tanh(y) + atan(y)", x, y),
                std::sinh(x) + std::cosh(x) + std::tanh(y) + std::atan(y), 1e-14);
    EXPECT_DOUBLE_EQ(value("+x - -y", x, y), x + y);
}

// Value, gradient and Hessian of a jet against central differences: order 2 in the step.
TEST(Formula, DerivativesHaveTheirTaylorSlopes) {
    using J = Jet<double, 2, 2>;
    for (const char* part :
         {"x^3*y^2", "sqrt(2 + x*y)", "exp(x - y)", "log(3 + x*x + y)", "sin(x*y)", "cos(x + 2*y)", "sinh(x*y)",
          "cosh(x - y)", "tanh(x + y^2)", "atan(x*y - 1)", "1/(2 + x + y)", "(2 + x*y)^1.7", "(2 + x)^(-4)"}) {
        const Formula formula = parse_formula(std::string(part) + " + 0.3*x", names);
        const double x = 0.4, y = 0.6, direction[2]{0.6, -0.8};
        const J variables[]{J::variable(x, 0), J::variable(y, 1)};
        const J f = evaluate(formula, variables);
        const double slope = f.d[0] * direction[0] + f.d[1] * direction[1];
        const double bend = f.dd[0] * direction[0] * direction[0] + 2 * f.dd[1] * direction[0] * direction[1] +
                            f.dd[2] * direction[1] * direction[1];
        double rest[2];  // of the expansion of second order, for two steps
        for (int i = 0; i < 2; ++i) {
            const double h = 0.02 / (1 << i), at[]{x + h * direction[0], y + h * direction[1]};
            rest[i] = std::abs(evaluate(formula, at) - f.v - h * slope - h * h / 2 * bend);
        }
        EXPECT_NEAR(std::log2(rest[0] / rest[1]), 3, 0.1) << part;
    }
}

void expect_refusal(const std::string& text, std::size_t column, const std::string& words) {
    try {
        parse_formula(text, names);
        ADD_FAILURE() << text << " is accepted";
    } catch (const FormulaError& error) {
        EXPECT_EQ(error.column, column) << text << ": " << error.what();
        EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << text << ": " << error.what();
    }
}

TEST(Formula, RefusesWithPlaceAndRemedy) {
    expect_refusal("", 1, "ends where");
    expect_refusal("x + ", 5, "ends where");
    expect_refusal("x + abs(y)", 5, "kinks");
    expect_refusal("min(x, y)", 1, "kinks");
    expect_refusal("if(x, y)", 1, "kinks");
    expect_refusal("(x + y", 1, "not closed");
    expect_refusal("x y", 3, "expected an operator");
    expect_refusal("x ** 2", 3, "x^2");
    expect_refusal("z", 1, "there is no 'z'; allowed are x, y, pi, sqrt");
    expect_refusal("x^y", 3, "exp(y*log(x))");
    expect_refusal("x^0", 3, "write 1");
    expect_refusal("x^200", 3, "at most 100");
    expect_refusal("sqrt x", 1, "parentheses");
    expect_refusal("tan(x)", 1, "sin(x)/cos(x)");
    expect_refusal("ln(x)", 1, "log(x)");
    expect_refusal("x + 1/0", 6, "no finite value");
    expect_refusal("1e308*1e308*x", 6, "no finite value");
    expect_refusal("x + #", 5, "'#'");
    expect_refusal("x\u00b2 + y", 2, "not '\u00b2'; write ^2");  // characters are whole, and counted as such
    expect_refusal("(x\u00b2)", 1, "not '\u00b2'; write ^2");
    expect_refusal("x + \u03b2", 5, "not '\u03b2'");
    expect_refusal("x \u00b7 \u00b7 y", 3, "write *");
    expect_refusal(std::string("x + y") + '\0', 6, "not the control character U+0000");
    expect_refusal("1e999", 1, "no number");
    std::string deep(300, '(');
    deep.append("x").append(300, ')');
    expect_refusal(deep, 201, "too deeply");
    std::string nested = "x";
    for (int i = 0; i < 40; ++i) nested.insert(0, "x - (").append(")");
    expect_refusal(nested, 1, "nests 41 values");
}

FormulaDomain::Margin margin(const std::string& text, std::initializer_list<std::array<double, 2>> points) {
    const Formula formula = parse_formula(text, names);
    FormulaDomain domain(formula);
    double place = 0;
    for (const auto& point : points) domain.look(point, place++);
    FormulaDomain::Margin out = domain.margin();
    out.step = nullptr;  // of a formula that is gone
    return out;
}

TEST(Formula, KnowsWhereItIsDefined) {
    EXPECT_TRUE(std::isnan(value("log(x)", -1)));
    EXPECT_TRUE(std::isnan(value("sqrt(x)", 0)));  // no derivative
    EXPECT_FALSE(FormulaDomain(parse_formula("x^2*exp(y)", names)).restricted());
    // 1 - 0.9 is a tenth, of terms that add up to 1.9.
    EXPECT_NEAR(margin("log(1 - x)", {{0.5, 0}, {0.9, 0}, {0.2, 0}}).value, 0.1 / 1.9, 1e-15);
    EXPECT_EQ(margin("log(1 - x)", {{0.5, 0}, {0.9, 0}, {0.2, 0}}).place, 1);
    EXPECT_LT(margin("y + sqrt(x - 2)", {{3, 0}, {1, 0}}).value, 0);
    EXPECT_GT(margin("1/x", {{-3, 0}, {-1, 0}}).value, 0);  // a divisor may be negative
    EXPECT_LT(margin("1/x", {{-3, 0}, {1, 0}}).value, 0);   // but not change its sign
    const Formula formula = parse_formula("2*y + log(x - 1)", names);
    FormulaDomain domain(formula);
    domain.look(std::array{0.5, 0.0}, 7);
    EXPECT_EQ(words(domain.margin()), "the argument of log at character 7 of the formula is -0.5");
}

TEST(Formula, SizesAddUp) {
    const Formula formula = parse_formula("(x - y)^2 + 3*x", names);
    const Sized variables[]{Sized(2), Sized(3)};
    const Sized f = evaluate(formula, variables);
    EXPECT_DOUBLE_EQ(f.value, 7);
    EXPECT_DOUBLE_EQ(f.size, 31);
}

}  // namespace tubule::formula_test
