// Splines over one cell of a profile: degree p, any knots, any smoothness at the knots, even or odd at planes of
// symmetry, without conditions at open ends. Cubic and quintic Hermite elements are the special cases (3, 1) and (5,
// 2) of (degree, smoothness).
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <array>
#include <memory>
#include <vector>

#include "common/solve/pause.hpp"

namespace tubule::axisym {

// The part [z0, z1] of the axis that is solved for; the rest of the tube follows by translation, or
// with `mirror` by reflection at both ends, or nothing beyond an open end of a mirrored cell: there the first or the
// last coefficient is the value.
struct Cell {
    double z0 = 0, z1 = 1;
    bool mirror = false;
    int copies = 1;  // translational copies in the period of the case
    bool open_start = false, open_end = false;
    double length() const { return z1 - z0; }
    int images() const { return copies * (mirror ? 2 : 1); }
    double period() const { return length() * images(); }
};

// Under reflection at the start and at the end of a mirrored cell: +1 even, -1 odd. Without meaning on a periodic cell.
struct Parity {
    int start = 1, end = 1;
};

class SplineSpace {
public:
    static constexpr int lanes = 4;      // quadrature points evaluated at once
    static constexpr int max_width = 8;  // active splines per element, degree 7 at most

    // `breaks` ascends from cell.z0 to cell.z1 (at least 2 elements); degree 2 ... 7;
    // 1 <= smoothness < degree. Throws std::invalid_argument.
    SplineSpace(Cell cell, std::vector<double> breaks, int degree, int smoothness, Parity parity = {});
    // The splines of another space with this parity.
    SplineSpace(const SplineSpace& other, Parity parity);

    // Values, first and second derivatives of the active splines at `lanes` Gauss points, in two
    // layouts: by_point to gather coefficients into points, by_spline to scatter points into coefficients.
    struct Basis {
        alignas(32) double by_point[3][max_width][lanes];
        alignas(32) double by_spline[lanes][3][max_width];
        alignas(32) double weight[lanes];
        alignas(32) double z[lanes];
    };

    int size() const { return size_; }
    int elements() const { return static_cast<int>(breaks().size()) - 1; }
    int degree() const { return shared_->degree; }
    int smoothness() const { return shared_->smoothness; }
    int width() const { return degree() + 1; }
    // Groups of Gauss points per element: 4 points integrate the energy of quintics to the order
    // (8) at which it converges, septics take 8.
    int groups() const { return degree() <= 5 ? 1 : 2; }
    const Cell& cell() const { return shared_->cell; }
    const std::vector<double>& breaks() const { return shared_->breaks; }
    Parity parity() const { return parity_; }
    // Squared norm |B_2n|/(2n)!, n = degree - 1, of the Bernoulli spline that is left of a polynomial of degree + 1
    // when its second derivative is approximated by splines of degree - 2; of degree 3, 5 or 7.
    double bernoulli_norm() const;
    // Likewise of its third derivative by splines of degree - 3.
    double bernoulli_norm_of_third() const;
    const Basis& basis(int element, int group) const { return shared_->basis[element * groups() + group]; }
    // The coefficient of each active spline of an element, and its sign: all +1 where the parity is even; 0 where a
    // spline is absent from an odd space (its dof is then 0).
    const int* dofs(int element) const { return &dofs_[element * width()]; }
    const double* signs(int element) const { return &signs_[element * width()]; }

    // Adds what each active spline of an element contributes to `out`, of size() numbers.
    void add(int element, const double* local, double* out) const {
        const int* to = dofs(element);
        const double* sign = signs(element);
        for (int a = 0; a < width(); ++a) out[to[a]] += sign[a] * local[a];
    }

    int element_at(double z) const;
    // Value, first and second derivative of the spline at z inside `element` (or its ends).
    std::array<double, 3> evaluate(const double* coefficients, int element, double z) const;
    std::array<double, 3> evaluate(const double* coefficients, double z) const {
        return evaluate(coefficients, element_at(z), z);
    }
    double value(const double* coefficients, int element, double z) const;
    // out[k * width() + a] = derivative k = 0 ... derivatives (at most 3) of the active spline a at z inside `element`.
    void splines(int element, double z, int derivatives, double* out) const;
    // The derivative of order `degree`, constant on each element; and that of each active spline.
    double top_derivative(const double* coefficients, int element) const;
    // The difference quotients of that derivative across the knots 0 ... elements(); 0 at open ends.
    std::vector<double> top_jumps(const double* coefficients) const;
    const double* top_derivatives(int element) const { return shared_->active[element].top; }
    // A zero of r' near z, by Newton from z and staying in its neighbourhood: the place of a neck or a belly.
    double extremum_near(const double* coefficients, double z) const;

    // INT f(z) phi dz of each spline.
    template <class F>
    Eigen::VectorXd load(F&& f) const {
        Eigen::VectorXd out = Eigen::VectorXd::Zero(size_);
        for (int e = 0; e < elements(); ++e) {
            if (e % 64 == 0) check_pause();  // the function may take its time
            for (int g = 0; g < groups(); ++g) {
                const Basis& b = basis(e, g);
                for (int q = 0; q < lanes; ++q) {
                    const double value = b.weight[q] * f(b.z[q]);
                    for (int a = 0; a < width(); ++a) out[dofs(e)[a]] += signs(e)[a] * value * b.by_spline[q][0][a];
                }
            }
        }
        return out;
    }
    Eigen::SparseMatrix<double> mass() const;
    // Projection of f(z), least squares at the quadrature points: exact if f is in this space. Throws SolveError if
    // the mesh is degenerate.
    template <class F>
    Eigen::VectorXd project(F&& f) const {
        return solve_mass(load(f));
    }
    // INT phi dz of each spline: the functional of the mean.
    Eigen::VectorXd mean() const;
    // Projection of a spline on other knots; the same function if those knots are all here too.
    Eigen::VectorXd prolong(const SplineSpace& other, const Eigen::VectorXd& coefficients) const;
    // prolong() as a matrix between even spaces, for `coarse` with all its knots among these: each spline of it is a
    // combination of a few here, found from blossoms at the knots in between (Oslo algorithm).
    Eigen::SparseMatrix<double> prolongation(const SplineSpace& coarse) const;

    // The spline over [start, start + period] as (knots, coefficients) in the usual convention
    // (scipy BSpline), unfolded over all copies and mirror images.
    struct Unfolded {
        std::vector<double> knots, coefficients;
    };
    Unfolded unfold(const Eigen::VectorXd& coefficients, double start) const;

private:
    struct Shared;
    // The active splines of one element: everything that does not depend on the point, done once.
    struct Active {
        int p;
        double knots[2 * max_width];                    // of the active splines
        double inverse_span[max_width][2 * max_width];  // [d][i] = 1 / (knots[i + d] - knots[i]), 0 for a repeated knot
        double combo[4][max_width][max_width];          // derivative k of spline a in splines of degree p - k
        double top[max_width];                          // derivative p of spline a

        // The first active spline has the raw index `first`.
        Active(const Shared& splines, int first);
        // out[k * (p + 1) + a] = derivative k = 0 ... derivatives (at most 3) of spline a at z.
        template <class T>
        void operator()(const T& z, int derivatives, T* out) const;
    };

    // What does not depend on the parity. A raw spline i has the knots i ... i + degree + 1 of the whole line.
    struct Shared {
        Cell cell;
        std::vector<double> breaks;
        int degree, smoothness, multiplicity;
        std::vector<Basis> basis;
        std::vector<Active> active;

        double knot(int index) const;  // extended beyond the cell by translation or reflection; repeated at open ends
        int first_raw(int element) const { return element * multiplicity + multiplicity - 1 - degree; }
        void tabulate(int groups);
    };
    struct Folded {
        int dof;
        double sign;
    };
    Folded folded(int raw) const;
    void number();
    Eigen::VectorXd solve_mass(const Eigen::VectorXd& load) const;

    std::shared_ptr<const Shared> shared_;
    Parity parity_;
    int first_ = 0, size_ = 0;  // raw index of the first coefficient of a mirrored cell; number of coefficients
    std::vector<int> dofs_;
    std::vector<double> signs_;
};

// Gauss-Legendre rule with n points on [0, 1] (nodes, weights).
struct GaussRule {
    std::vector<double> nodes, weights;
};
GaussRule gauss_rule(int n);

}  // namespace tubule::axisym
