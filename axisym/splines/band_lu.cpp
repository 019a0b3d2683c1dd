#include "axisym/splines/band_lu.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <numeric>
#include <type_traits>

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
    work_.resize(n_ + 2 * width_);
}

void BandLu::factor(const double* values) {
    std::fill(band_.begin(), band_.end(), 0.0);
    for (int j = 0; j < n_; ++j)
        for (int k = pattern_.outerIndexPtr()[j]; k < pattern_.outerIndexPtr()[j + 1]; ++k)
            at(place_[pattern_.innerIndexPtr()[k]], place_[j]) = values[k];
    // Loops of known length for the splines in use, of one cell and between planes of symmetry.
    if (width_ == 5)
        eliminate(std::integral_constant<int, 5>());
    else if (width_ == 10)
        eliminate(std::integral_constant<int, 10>());
    else
        eliminate(width_);
}

// Beyond the last row the band is zero.
template <class Width>
void BandLu::eliminate(const Width width) {
    constexpr double small = 1e-3;  // of a column: a smaller pivot is exchanged, as in KLU
    pivots_ = false;
    int last = 0;  // column that the rows eliminated so far reach
    for (int k = 0; k < n_; ++k) {
        double* column = &at(k, k);
        int p = 0;
        for (int i = 1; i <= width; ++i)
            if (std::abs(column[i]) > std::abs(column[p])) p = i;
        if (std::abs(column[0]) >= small * std::abs(column[p])) p = 0;
        pivot_[k] = p;
        if (!(std::abs(column[p]) > 0) || !std::isfinite(column[p]))
            throw SolveError(fmt::format("matrix of size {} is singular: pivot {} is {}", n_, k, column[p]));
        last = std::max(last, std::min(k + width + p, n_ - 1));
        if (p > 0) {
            pivots_ = true;
            for (int j = k; j <= last; ++j) std::swap(at(k, j), at(k + p, j));
        }
        const double inverse = inverse_pivot_[k] = 1 / column[0];
        for (int i = 1; i <= width; ++i) column[i] *= inverse;
        for (int j = k + 1; j <= last; ++j) {
            double* target = &at(k, j);
            const double factor = target[0];
            for (int i = 1; i <= width; ++i) target[i] -= column[i] * factor;
        }
    }
}

// Without exchanged rows W unknowns wait in registers for the next ones. Beyond the ends the band is zero.
template <int W>
void BandLu::solve_straight(double* x) const {
    std::array<double, W + 1> waiting;
    const double* column = &band_[above_];
    std::copy_n(x, W, waiting.begin());
    for (int k = 0; k < n_; ++k, column += stride_) {
        const double here = x[k] = waiting[0];
        waiting[W] = x[k + W];
        for (int i = 1; i <= W; ++i) waiting[i - 1] = waiting[i] - column[i] * here;
    }
    std::copy_n(std::make_reverse_iterator(x + n_), W, waiting.begin());
    for (int k = n_ - 1; k >= 0; --k) {
        column -= stride_;
        const double here = x[k] = waiting[0] * inverse_pivot_[k];
        waiting[W] = x[k - W];
        for (int i = 1; i <= W; ++i) waiting[i - 1] = waiting[i] - column[-i] * here;
    }
}

void BandLu::solve(double* b) const {
    double* x = work_.data() + width_;
    for (int i = 0; i < n_; ++i) x[place_[i]] = b[i];
    if (!pivots_ && (width_ == 5 || width_ == 10)) {
        width_ == 5 ? solve_straight<5>(x) : solve_straight<10>(x);
        for (int i = 0; i < n_; ++i) b[i] = x[place_[i]];
        return;
    }
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
