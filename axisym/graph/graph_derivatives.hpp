// Checks that the discrete gradient is the derivative of the discrete energy, term by term.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "axisym/graph/graph_forms.hpp"
#include "common/case/problem.hpp"
#include "common/solve/derivative_check.hpp"

namespace tubule::axisym {

struct TermCheck {
    std::string key;  // of the term's modulus
    DerivativeCheck check;
};

// Taylor slopes of value, gradient and Hessian of each term in use, alone, at the state x.
std::vector<TermCheck> check_terms(const Forms& forms, const Eigen::VectorXd& x);

// The same at the initial shape of a case, on a mesh of moderate size.
std::vector<TermCheck> check_terms(const Problem& c);

}  // namespace tubule::axisym
