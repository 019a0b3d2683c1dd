// A formula given as text, such as "0.1*log(1 + (H - H0)^2)": parsed once, evaluated on any differentiable scalar, so
// that its derivatives are exact.
#pragma once

#include <cmath>
#include <limits>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "common/geometry/jet.hpp"

namespace tubule {

// What cannot be read: why and what to write instead, and at which character of the text, from 1.
class FormulaError : public std::invalid_argument {
public:
    FormulaError(std::size_t column, const std::string& what) : std::invalid_argument(what), column(column) {}
    std::size_t column;
};

// Operations in the order in which a stack machine runs them.
struct Formula {
    enum class Op {
        constant,
        variable,
        add,
        subtract,
        multiply,
        inverse,
        negate,
        power,
        real_power,  //
        sqrt,
        exp,
        log,
        sin,
        cos,
        sinh,
        cosh,
        tanh,
        atan,
        polynomial,  // of texts none; see Step::coefficients
        waves
    };
    struct Step {
        Op op;
        double value = 0;  // of a constant, an exponent
        int number = 0;    // of a variable, a whole exponent >= 2
        std::size_t column = 1;
        // A fit on [0, 1]: a polynomial, in Chebyshev's T_k(1 - 2 x), k = 0, 1, ...; or waves, in 1, cos(2 pi x),
        // sin(2 pi x), cos(4 pi x), ...
        std::shared_ptr<const std::vector<double>> coefficients = {};
    };
    std::string text;  // empty: made from numbers, not from a text
    std::vector<Step> steps;
    std::size_t depth = 0;  // of the stack
};

// Variables have distinct names. Allowed: numbers, pi, + - * / ^ and parentheses, sqrt exp log sin cos sinh
// cosh tanh atan. Exponents are constants. Throws FormulaError.
Formula parse_formula(const std::string& text, std::span<const std::string_view> variables);

// A fit as a formula of its first variable: Op::polynomial or Op::waves.
Formula fitted_formula(Formula::Op op, std::vector<double> coefficients);

// Whether it depends on the variable of this number.
bool uses(const Formula& formula, int variable);

// Which arguments the operations had that are not defined for all.
class FormulaDomain {
public:
    explicit FormulaDomain(const Formula& formula);
    bool restricted() const { return !limits_.empty(); }

    // The arguments at a point; `place` identifies the point.
    void look(std::span<const double> variables, double place);

    // How far the arguments stayed from where the formula is not defined, relative to what they are sums of, and where
    // that was. Not positive if one was there, or if a divisor was positive at some points and negative at others.
    struct Margin {
        double value = std::numeric_limits<double>::infinity(), place = 0, argument = 0;
        const Formula::Step* step = nullptr;

        bool is_small() const { return value < 1e-3; }  // too near to continue
    };
    Margin margin() const;

private:
    struct Limit {
        const Formula::Step* step;
        Formula argument;
        Margin low, high{.value = -std::numeric_limits<double>::infinity()};
    };
    std::vector<Limit> limits_;
};
// "the argument of log at character 5 of the formula is -0.1"
std::string words(const FormulaDomain::Margin& margin);

// F, F' and F'' of an operation with one argument.
struct FunctionValues {
    double f, f1, f2;
};
FunctionValues function_values(const Formula::Step& step, double x);

// What a scalar holds at its lowest order: a number or a pack of them, which are themselves; and the function of a
// scalar from its values there.
template <class T>
const T& inner(const T& x) {
    return x;
}
template <class T>
T chain(const T&, const T& f, const T&, const T&) {
    return f;
}
template <class T, int N, int Order>
const T& inner(const Jet<T, N, Order>& x) {
    return x.v;
}

// Value and size of a quantity: terms that cancel each other add up in its size.
struct Sized {
    double value = 0, size = 0;
    Sized() = default;
    explicit Sized(double constant) : value(constant), size(std::abs(constant)) {}
    Sized(double value, double size) : value(value), size(size) {}
    friend Sized operator+(const Sized& a, const Sized& b) { return {a.value + b.value, a.size + b.size}; }
    friend Sized operator-(const Sized& a, const Sized& b) { return {a.value - b.value, a.size + b.size}; }
    friend Sized operator*(const Sized& a, const Sized& b) { return {a.value * b.value, a.size * b.size}; }
    friend Sized operator*(double c, const Sized& a) { return {c * a.value, std::abs(c) * a.size}; }
};
inline const double& inner(const Sized& x) {
    return x.value;
}
inline Sized chain(const Sized&, double f, double, double) {
    return {f, std::abs(f)};
}

template <class S>
S apply(const Formula::Step& step, const S& x) {
    const auto& at = inner(x);
    using T = std::remove_cvref_t<decltype(at)>;
    if constexpr (std::is_same_v<T, double>) {
        const FunctionValues v = function_values(step, at);
        return chain(x, v.f, v.f1, v.f2);
    } else {
        T f, f1, f2;
        for (std::size_t i = 0; i < T::size(); ++i) {
            const FunctionValues v = function_values(step, at[i]);
            f[i] = v.f, f1[i] = v.f1, f2[i] = v.f2;
        }
        return chain(x, f, f1, f2);
    }
}

template <class S>
S whole_power(S base, int exponent) {
    while (exponent % 2 == 0) base = base * base, exponent /= 2;
    S out = base;
    while (exponent /= 2) {
        base = base * base;
        if (exponent % 2 == 1) out = out * base;
    }
    return out;
}

template <std::size_t most, class S>
S run_formula(const Formula& formula, const S* variables) {
    S stack[most];
    std::size_t n = 0;  // values on it
    for (const Formula::Step& step : formula.steps) switch (step.op) {
            case Formula::Op::constant:
                stack[n++] = S(step.value);
                break;
            case Formula::Op::variable:
                stack[n++] = variables[step.number];
                break;
            case Formula::Op::add:
                --n, stack[n - 1] = stack[n - 1] + stack[n];
                break;
            case Formula::Op::subtract:
                --n, stack[n - 1] = stack[n - 1] - stack[n];
                break;
            case Formula::Op::multiply:
                --n, stack[n - 1] = stack[n - 1] * stack[n];
                break;
            case Formula::Op::negate:
                stack[n - 1] = -1.0 * stack[n - 1];
                break;
            case Formula::Op::power:
                stack[n - 1] = whole_power(stack[n - 1], step.number);
                break;
            default:
                stack[n - 1] = apply(step, stack[n - 1]);
        }
    return stack[0];
}

// The value where the variables have these values, in the order of their names. S is a number or a jet. Not finite
// where the formula is not defined.
inline constexpr std::size_t formula_depth = 32;  // more is refused
template <class S>
S evaluate(const Formula& formula, const S* variables) {
    constexpr std::size_t common = 5;  // a small stack is cleared faster
    return formula.depth <= common ? run_formula<common>(formula, variables)
                                   : run_formula<formula_depth>(formula, variables);
}

}  // namespace tubule
