#include "axisym/splines/band_lu.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numeric>

#include "common/solve/memory.hpp"
#include "common/solve/sparse.hpp"

namespace tubule::axisym {
namespace {

int bandwidth(const Eigen::SparseMatrix<double>& pattern, const std::vector<int>& place) {
    int width = 0;
    for (int j = 0; j < pattern.cols(); ++j)
        for (int k = pattern.outerIndexPtr()[j]; k < pattern.outerIndexPtr()[j + 1]; ++k)
            width = std::max(width, std::abs(place[pattern.innerIndexPtr()[k]] - place[j]));
    return width;
}

}  // namespace

BandLu::BandLu(const Eigen::SparseMatrix<double>& pattern)
    : pattern_(pattern), n_(static_cast<int>(pattern.cols())), place_(n_) {
    std::iota(place_.begin(), place_.end(), 0);
    std::vector<int> in_turn(n_);
    for (int i = 0; i < n_; ++i) in_turn[i] = 2 * i < n_ ? 2 * i : 2 * (n_ - 1 - i) + 1;
    const int straight = bandwidth(pattern, place_), folded = bandwidth(pattern, in_turn);
    width_ = std::min(straight, folded);
    if (folded < straight) place_ = in_turn;
    above_ = 2 * width_;  // row pivots fill as much again
    stride_ = 3 * width_ + 1;
    require_memory(8.0 * n_ * stride_, fmt::format("factors of {} unknowns", n_));
    band_.resize(static_cast<std::size_t>(n_) * stride_);
    inverse_pivot_.resize(n_);
    pivot_.resize(n_);
    work_.resize(n_);
}

void BandLu::factor(const double* values) {
    std::fill(band_.begin(), band_.end(), 0.0);
    for (int j = 0; j < n_; ++j)
        for (int k = pattern_.outerIndexPtr()[j]; k < pattern_.outerIndexPtr()[j + 1]; ++k)
            at(place_[pattern_.innerIndexPtr()[k]], place_[j]) = values[k];
    int last = 0;  // column that the rows eliminated so far reach
    for (int k = 0; k < n_; ++k) {
        const int below = std::min(width_, n_ - 1 - k);
        double* column = &at(k, k);
        int p = 0;
        for (int i = 1; i <= below; ++i)
            if (std::abs(column[i]) > std::abs(column[p])) p = i;
        pivot_[k] = p;
        if (!(std::abs(column[p]) > 0) || !std::isfinite(column[p]))
            throw SolveError(fmt::format("matrix of size {} is singular: pivot {} is {}", n_, k, column[p]));
        last = std::max(last, std::min(k + width_ + p, n_ - 1));
        if (p > 0)
            for (int j = k; j <= last; ++j) std::swap(at(k, j), at(k + p, j));
        const double inverse = inverse_pivot_[k] = 1 / column[0];
        for (int i = 1; i <= below; ++i) column[i] *= inverse;
        for (int j = k + 1; j <= last; ++j) {
            double* target = &at(k, j);
            const double factor = target[0];
            for (int i = 1; i <= below; ++i) target[i] -= column[i] * factor;
        }
    }
}

void BandLu::solve(double* b) const {
    double* x = work_.data();
    for (int i = 0; i < n_; ++i) x[place_[i]] = b[i];
    for (int k = 0; k < n_; ++k) {
        std::swap(x[k], x[k + pivot_[k]]);
        const double* column = &band_[static_cast<std::size_t>(k) * stride_ + above_];
        const int below = std::min(width_, n_ - 1 - k);
        for (int i = 1; i <= below; ++i) x[k + i] -= column[i] * x[k];
    }
    for (int k = n_ - 1; k >= 0; --k) {
        x[k] *= inverse_pivot_[k];
        const double* column = &band_[static_cast<std::size_t>(k) * stride_ + above_];
        const int above = std::min(above_, k);
        for (int i = 1; i <= above; ++i) x[k - i] -= column[-i] * x[k];
    }
    for (int i = 0; i < n_; ++i) b[i] = x[place_[i]];
}

}  // namespace tubule::axisym
