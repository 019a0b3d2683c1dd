#include "common/formula/formula.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <numbers>
#include <utility>

namespace tubule {
namespace {

using Op = Formula::Op;
using Step = Formula::Step;

constexpr std::array<std::pair<std::string_view, Op>, 9> functions{{{"sqrt", Op::sqrt},
                                                                    {"exp", Op::exp},
                                                                    {"log", Op::log},
                                                                    {"sin", Op::sin},
                                                                    {"cos", Op::cos},
                                                                    {"sinh", Op::sinh},
                                                                    {"cosh", Op::cosh},
                                                                    {"tanh", Op::tanh},
                                                                    {"atan", Op::atan}}};
constexpr std::array<std::string_view, 11> kinked{"abs",   "min",  "max",   "if",   "sign", "sgn",
                                                  "floor", "ceil", "round", "step", "mod"};
constexpr std::array<std::pair<std::string_view, std::string_view>, 9> other_names{{{"tan", "sin(x)/cos(x)"},
                                                                                    {"ln", "log(x)"},
                                                                                    {"pow", "x^2"},
                                                                                    {"log10", "log(x)/log(10)"},
                                                                                    {"log2", "log(x)/log(2)"},
                                                                                    {"cbrt", "x^(1/3)"},
                                                                                    {"arctan", "atan(x)"},
                                                                                    {"acos", "atan"},
                                                                                    {"asin", "atan"}}};

// Characters of other keyboards, in UTF-8, and what to write for them.
constexpr std::array<std::pair<std::string_view, std::string_view>, 10> other_characters{{{"\u00b2", "^2"},
                                                                                          {"\u00b3", "^3"},
                                                                                          {"\u2074", "^4"},
                                                                                          {"\u00b7", "*"},
                                                                                          {"\u22c5", "*"},
                                                                                          {"\u00d7", "*"},
                                                                                          {"\u2212", "-"},
                                                                                          {"\u2013", "-"},
                                                                                          {"\u221a", "sqrt(x)"},
                                                                                          {"\u03c0", "pi"}}};

bool continues_character(char c) {
    return (static_cast<unsigned char>(c) & 0xc0) == 0x80;
}

template <class List>
bool is_in(const List& list, std::string_view name) {
    return std::find(list.begin(), list.end(), name) != list.end();
}

template <class Pairs>
const typename Pairs::value_type* named(const Pairs& pairs, std::string_view name) {
    const auto found = std::find_if(pairs.begin(), pairs.end(), [&](const auto& p) { return p.first == name; });
    return found == pairs.end() ? nullptr : &*found;
}

// Recursive descent. Operations on constants are carried out at once.
class Parser {
public:
    Parser(const std::string& text, std::span<const std::string_view> variables) : text_(text), variables_(variables) {}

    Formula parse() {
        sum();
        if (!at_end()) fail(at_, "expected an operator, not " + character());
        out_.text = text_;
        if (out_.depth > formula_depth)
            fail(0, fmt::format("the formula nests {} values; at most {} are read", out_.depth, formula_depth));
        return std::move(out_);
    }

private:
    [[noreturn]] void fail(std::size_t at, const std::string& what) const {
        const auto before = static_cast<std::size_t>(
            std::ranges::count_if(text_.substr(0, at), [](char c) { return !continues_character(c); }));
        throw FormulaError(before + 1, what);
    }
    // The next one, in quotes, and what to write instead, if that is known.
    std::string character() const {
        std::size_t end = at_ + 1;
        while (end < text_.size() && continues_character(text_[end])) ++end;
        const std::string_view one = std::string_view(text_).substr(at_, end - at_);
        const auto code = static_cast<unsigned char>(one.front());
        if (code < 0x20 || code == 0x7f) return fmt::format("the control character U+{:04X}", code);
        const auto* other = named(other_characters, one);
        return fmt::format("'{}'{}", one, other ? fmt::format("; write {}", other->second) : "");
    }

    bool at_end() {
        while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_]))) ++at_;
        return at_ == text_.size();
    }
    bool next_is(char c) { return !at_end() && text_[at_] == c; }
    bool take(char c) {
        if (!next_is(c)) return false;
        ++at_;
        return true;
    }

    void push(Step step) {
        out_.steps.push_back(step);
        out_.depth = std::max(out_.depth, ++height_);
    }
    bool constant_top(std::size_t below = 0) const {
        return out_.steps.size() > below && out_.steps[out_.steps.size() - 1 - below].op == Op::constant;
    }
    void binary(Op op, std::size_t column) {
        --height_;
        if (constant_top() && constant_top(1)) {
            const double b = out_.steps.back().value;
            out_.steps.pop_back();
            double& a = out_.steps.back().value;
            a = op == Op::add ? a + b : op == Op::subtract ? a - b : a * b;
            require_finite(a, column);
        } else {
            out_.steps.push_back({.op = op, .column = column});
        }
    }
    void unary(Step step) {
        if (!constant_top()) return out_.steps.push_back(step);
        double& a = out_.steps.back().value;
        a = step.op == Op::negate  ? -a
            : step.op == Op::power ? whole_power(a, step.number)
                                   : function_values(step, a).f;
        require_finite(a, step.column);
    }
    void require_finite(double value, std::size_t column) const {
        if (!std::isfinite(value)) fail(column - 1, "has no finite value here");
    }

    void sum() {
        product();
        while (next_is('+') || next_is('-')) {
            const std::size_t column = at_ + 1;
            const Op op = text_[at_++] == '+' ? Op::add : Op::subtract;
            product();
            binary(op, column);
        }
    }
    void product() {
        signed_factor();
        while (next_is('*') || next_is('/')) {
            const std::size_t column = at_ + 1;
            const bool divides = text_[at_++] == '/';
            if (!divides && next_is('*')) fail(column - 1, "powers are written x^2, not x**2");
            signed_factor();
            if (divides) unary({.op = Op::inverse, .column = column});
            binary(Op::multiply, column);
        }
    }
    void signed_factor() {
        if (++nested_ > 200) fail(at_, "nests too deeply");
        const std::size_t column = at_ + 1;
        if (take('-')) {
            signed_factor();
            unary({.op = Op::negate, .column = column});
        } else if (take('+')) {
            signed_factor();
        } else {
            power();
        }
        --nested_;
    }
    void power() {
        atom();
        if (!next_is('^')) return;
        const std::size_t column = ++at_;
        const std::size_t first = out_.steps.size();
        signed_factor();  // x^2^3 = x^(2^3)
        if (out_.steps.size() != first + 1 || !constant_top())
            fail(column, "exponents are constants; write exp(y*log(x)) for x^y");
        const double exponent = out_.steps.back().value;
        out_.steps.pop_back();
        --height_;
        raise(exponent, column);
    }
    void raise(double exponent, std::size_t column) {
        if (exponent == 0) fail(column, "a power of 0 is 1; write 1");
        if (exponent != std::floor(exponent)) return unary({.op = Op::real_power, .value = exponent, .column = column});
        if (std::abs(exponent) > 100) fail(column, "whole exponents are at most 100");
        const int whole = static_cast<int>(std::abs(exponent));
        if (whole >= 2) unary({.op = Op::power, .number = whole, .column = column});
        if (exponent < 0) unary({.op = Op::inverse, .column = column});
    }
    void atom() {
        if (at_end()) fail(at_, "ends where a number, a name or a parenthesis is expected");
        const char c = text_[at_];
        if (take('(')) return closed(at_ - 1);
        if (std::isdigit(static_cast<unsigned char>(c)) || c == '.') return number();
        if (std::isalpha(static_cast<unsigned char>(c)) || c == '_') return name();
        fail(at_, "expected a number, a name or a parenthesis, not " + character());
    }
    void closed(std::size_t opened) {
        sum();
        if (!take(')'))
            fail(opened,
                 at_end() ? "this parenthesis is not closed" : "expected an operator or ')', not " + character());
    }
    void number() {
        double value = 0;
        const auto [end, error] = std::from_chars(text_.data() + at_, text_.data() + text_.size(), value);
        if (error != std::errc{} || !std::isfinite(value)) fail(at_, "this is no number");
        push({.op = Op::constant, .value = value, .column = at_ + 1});
        at_ = static_cast<std::size_t>(end - text_.data());
    }
    void name() {
        const std::size_t first = at_;
        while (at_ < text_.size() && (std::isalnum(static_cast<unsigned char>(text_[at_])) || text_[at_] == '_')) ++at_;
        const std::string_view word = std::string_view(text_).substr(first, at_ - first);
        const auto variable = std::find(variables_.begin(), variables_.end(), word);
        if (variable != variables_.end()) {
            const int number = static_cast<int>(variable - variables_.begin());
            return push({.op = Op::variable, .number = number, .column = first + 1});
        }
        if (word == "pi") return push({.op = Op::constant, .value = std::numbers::pi, .column = first + 1});
        if (const auto* function = named(functions, word)) {
            if (!take('(')) fail(first, fmt::format("{} needs its argument in parentheses: {}(x)", word, word));
            closed(at_ - 1);
            return unary({.op = function->second, .column = first + 1});
        }
        unknown(word, first);
    }
    [[noreturn]] void unknown(std::string_view word, std::size_t at) const {
        if (is_in(kinked, word))
            fail(at,
                 fmt::format("{} has kinks or jumps, where derivatives are missing; write something smooth instead, "
                             "such as sqrt(x^2 + 0.01) for abs(x)",
                             word));
        if (const auto* other = named(other_names, word)) fail(at, fmt::format("write {} for {}", other->second, word));
        std::vector<std::string_view> names(variables_.begin(), variables_.end());
        names.emplace_back("pi");
        for (const auto& [function, op] : functions) names.push_back(function);
        fail(at, fmt::format("there is no '{}'; allowed are {}", word, fmt::join(names, ", ")));
    }

    const std::string& text_;
    std::span<const std::string_view> variables_;
    Formula out_;
    std::size_t at_ = 0, height_ = 0;
    int nested_ = 0;
};

bool needs_positive(Op op) {
    return op == Op::log || op == Op::sqrt || op == Op::real_power;
}

int values_taken(Op op) {
    const bool none = op == Op::constant || op == Op::variable;
    return none ? 0 : op == Op::add || op == Op::subtract || op == Op::multiply ? 2 : 1;
}

std::string_view words_for(Op op) {
    switch (op) {
        case Op::log:
            return "the argument of log";
        case Op::sqrt:
            return "the argument of sqrt";
        case Op::inverse:
            return "the divisor";
        default:
            return "the base of the power";
    }
}

// Chebyshev's polynomials of y = 1 - 2 x, by their recursion and its derivatives.
FunctionValues polynomial_values(const std::vector<double>& c, double x) {
    const double y = 1 - 2 * x;
    FunctionValues before{0, 0, 0}, here{1, 0, 0}, sum{0, 0, 0};
    for (std::size_t k = 0; k < c.size(); ++k) {
        sum = {sum.f + c[k] * here.f, sum.f1 - 2 * c[k] * here.f1, sum.f2 + 4 * c[k] * here.f2};
        const double twice = k == 0 ? 1 : 2;
        const FunctionValues next{twice * y * here.f - before.f, twice * (here.f + y * here.f1) - before.f1,
                                  twice * (2 * here.f1 + y * here.f2) - before.f2};
        before = here, here = next;
    }
    return sum;
}

FunctionValues wave_values(const std::vector<double>& c, double x) {
    FunctionValues sum{c[0], 0, 0};
    for (std::size_t k = 1; k + 1 < c.size(); k += 2) {
        const double q = std::numbers::pi * static_cast<double>(k + 1), cosine = std::cos(q * x),
                     sine = std::sin(q * x), wave = c[k] * cosine + c[k + 1] * sine;
        sum = {sum.f + wave, sum.f1 + q * (c[k + 1] * cosine - c[k] * sine), sum.f2 - q * q * wave};
    }
    return sum;
}

}  // namespace

Formula fitted_formula(Op op, std::vector<double> coefficients) {
    Formula out;
    out.steps = {{.op = Op::variable},
                 {.op = op, .coefficients = std::make_shared<const std::vector<double>>(std::move(coefficients))}};
    out.depth = 1;
    return out;
}

Formula parse_formula(const std::string& text, std::span<const std::string_view> variables) {
    return Parser(text, variables).parse();
}

FunctionValues function_values(const Formula::Step& step, double x) {
    switch (step.op) {
        case Op::inverse: {
            const double f = 1 / x;
            return {f, -f * f, 2 * f * f * f};
        }
        case Op::real_power: {
            const double p = step.value;
            if (!(x > 0)) break;
            const double f = std::pow(x, p);
            return {f, p * f / x, p * (p - 1) * f / (x * x)};
        }
        case Op::sqrt: {
            if (!(x > 0)) break;
            const double f = std::sqrt(x);
            return {f, 0.5 / f, -0.25 / (f * x)};
        }
        case Op::exp: {
            const double f = std::exp(x);
            return {f, f, f};
        }
        case Op::log:
            if (!(x > 0)) break;
            return {std::log(x), 1 / x, -1 / (x * x)};
        case Op::sin:
            return {std::sin(x), std::cos(x), -std::sin(x)};
        case Op::cos:
            return {std::cos(x), -std::sin(x), -std::cos(x)};
        case Op::sinh:
            return {std::sinh(x), std::cosh(x), std::sinh(x)};
        case Op::cosh:
            return {std::cosh(x), std::sinh(x), std::cosh(x)};
        case Op::tanh: {
            const double f = std::tanh(x), f1 = 1 - f * f;
            return {f, f1, -2 * f * f1};
        }
        case Op::atan: {
            const double f1 = 1 / (1 + x * x);
            return {std::atan(x), f1, -2 * x * f1 * f1};
        }
        case Op::polynomial:
            return polynomial_values(*step.coefficients, x);
        case Op::waves:
            return wave_values(*step.coefficients, x);
        default:
            break;
    }
    const double none = std::numeric_limits<double>::quiet_NaN();
    return {none, none, none};
}

// The operations before one leave its argument on top of the stack.
bool uses(const Formula& formula, int variable) {
    return std::ranges::any_of(formula.steps, [variable](const Formula::Step& step) {
        return step.op == Op::variable && step.number == variable;
    });
}

FormulaDomain::FormulaDomain(const Formula& formula) {
    for (std::size_t i = 0; i < formula.steps.size(); ++i) {
        const Step& step = formula.steps[i];
        if (!needs_positive(step.op) && step.op != Op::inverse) continue;
        Limit limit;
        limit.step = &step;
        std::size_t first = i;  // of the operations that make the argument
        for (int open = 1; open > 0; open += values_taken(formula.steps[first].op) - 1) --first;
        limit.argument.steps.assign(formula.steps.begin() + static_cast<std::ptrdiff_t>(first),
                                    formula.steps.begin() + static_cast<std::ptrdiff_t>(i));
        limit.argument.depth = formula.depth;
        limits_.push_back(std::move(limit));
    }
}

void FormulaDomain::look(std::span<const double> variables, double place) {
    std::vector<Sized> sized;
    for (const double x : variables) sized.emplace_back(x);
    for (Limit& limit : limits_) {
        const Sized x = evaluate(limit.argument, sized.data());
        if (!std::isfinite(x.size)) continue;  // an operation before it is not defined
        const Margin here{x.size > 0 ? x.value / x.size : 0, place, x.value, limit.step};
        if (here.value < limit.low.value) limit.low = here;
        if (here.value > limit.high.value) limit.high = here;
    }
}

FormulaDomain::Margin FormulaDomain::margin() const {
    Margin out;
    for (const Limit& limit : limits_) {
        if (!limit.low.step) continue;
        Margin here = limit.low;
        if (!needs_positive(limit.step->op) && here.value <= 0) {  // a divisor may be negative everywhere
            here = limit.high;
            here.value = -here.value;
        }
        if (here.value < out.value) out = here;
    }
    return out;
}

std::string words(const FormulaDomain::Margin& margin) {
    constexpr double vanishing = 1e-6;
    const std::string out = fmt::format("{} at character {} of the formula is {:.4g}", words_for(margin.step->op),
                                        margin.step->column, margin.argument);
    if (margin.step->op != Op::inverse) return out;
    if (std::abs(margin.value) < vanishing) return out + ": it vanishes";
    return margin.value > 0 ? out : out + ", and has the other sign elsewhere: it vanishes in between";
}

}  // namespace tubule
