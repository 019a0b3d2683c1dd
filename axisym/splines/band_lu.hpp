// LU factors of the small banded matrices of profiles. A sparse solver spends more on its bookkeeping than on them.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <vector>

namespace tubule::axisym {

class BandLu {
public:
    // Matrices with this pattern, which must outlive this and is symmetric. A cell without planes of symmetry couples
    // its ends: the unknowns are then taken from both ends in turn, which doubles the band.
    explicit BandLu(const Eigen::SparseMatrix<double>& pattern);

    // Gauss elimination with row pivots, of the values of a matrix with the pattern. Throws SolveError where a pivot
    // vanishes or is not finite.
    void factor(const double* values);
    // Overwrites a right-hand side by the solution.
    void solve(double* b) const;
    Eigen::VectorXd solved(Eigen::VectorXd b) const {
        solve(b.data());
        return b;
    }

private:
    template <class Width>
    void eliminate(Width width);
    template <int W>
    void solve_straight(double* x) const;
    double& at(int i, int j) { return band_[static_cast<std::size_t>(j) * stride_ + above_ + i - j]; }

    const Eigen::SparseMatrix<double>& pattern_;
    int n_, width_ = 0, above_ = 0,
            stride_ = 0;      // entries of the matrix beside the diagonal, and of the factors above it
    std::vector<int> place_;  // of each unknown in the order of elimination
    std::vector<double> band_, inverse_pivot_;
    std::vector<int> pivot_;
    bool pivots_ = false;               // whether rows were exchanged
    mutable std::vector<double> work_;  // with room beside the unknowns
};

}  // namespace tubule::axisym
