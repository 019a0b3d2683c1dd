#include "common/solve/sparse_front.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "common/solve/parallel.hpp"

// <cblas.h> is another library's on some systems.
extern "C" {
void sgemm_(const char*, const char*, const int* m, const int* n, const int* k, const float* alpha, const float* a,
            const int* lda, const float* b, const int* ldb, const float* beta, float* c, const int* ldc);
void dgemm_(const char*, const char*, const int* m, const int* n, const int* k, const double* alpha, const double* a,
            const int* lda, const double* b, const int* ldb, const double* beta, double* c, const int* ldc);
void strsm_(const char*, const char*, const char*, const char*, const int* m, const int* n, const float* alpha,
            const float* a, const int* lda, float* b, const int* ldb);
void dtrsm_(const char*, const char*, const char*, const char*, const int* m, const int* n, const double* alpha,
            const double* a, const int* lda, double* b, const int* ldb);
}

namespace tubule {
namespace {

constexpr int block_columns = 64, tile_columns = 96, tile_rows = 256;

#ifndef FRONT_EIGEN
// C (m x n) -= A (m x k) B^T (n x k)
void subtract_product(int m, int n, int k, const float* A, int lda, const float* B, int ldb, float* C, int ldc) {
    const float minus = -1, one = 1;
    sgemm_("N", "T", &m, &n, &k, &minus, A, &lda, B, &ldb, &one, C, &ldc);
}
void subtract_product(int m, int n, int k, const double* A, int lda, const double* B, int ldb, double* C, int ldc) {
    const double minus = -1, one = 1;
    dgemm_("N", "T", &m, &n, &k, &minus, A, &lda, B, &ldb, &one, C, &ldc);
}
#else
template <class S>
void subtract_product(int m, int n, int k, const S* A, int lda, const S* B, int ldb, S* C, int ldc) {
    using M = Eigen::Matrix<S, -1, -1>;
    using St = Eigen::OuterStride<>;
    Eigen::Map<M, 0, St>(C, m, n, St(ldc)).noalias() -=
        Eigen::Map<const M, 0, St>(A, m, k, St(lda)) * Eigen::Map<const M, 0, St>(B, n, k, St(ldb)).transpose();
}
#endif

// B (m x n) := B L^-T for unit lower triangular L (n x n)
void divide_by_transposed(int m, int n, const float* L, int ldl, float* B, int ldb) {
    const float one = 1;
    strsm_("R", "L", "T", "U", &m, &n, &one, L, &ldl, B, &ldb);
}
void divide_by_transposed(int m, int n, const double* L, int ldl, double* B, int ldb) {
    const double one = 1;
    dtrsm_("R", "L", "T", "U", &m, &n, &one, L, &ldl, B, &ldb);
}

// The lower triangle of C (rows x columns) -= A (rows x k) B^T (columns x k), in tiles of columns.
template <class Scalar>
void subtract_below(int rows, int columns, int k, const Scalar* A, int lda, const Scalar* B, int ldb, Scalar* C,
                    std::ptrdiff_t ldc, bool parallel) {
    const auto tile = [&](std::size_t t) {
        const auto j = static_cast<int>(t) * tile_columns;
        subtract_product(rows - j, std::min(tile_columns, columns - j), k, A + j, lda, B + j, ldb, C + j + j * ldc,
                         static_cast<int>(ldc));
    };
    parallel_for(static_cast<std::size_t>((columns + tile_columns - 1) / tile_columns), tile, parallel);
}

// Replaces the lower triangle of A (n x n) by its factors, column by column.
template <class Scalar>
void eliminate_block(int n, Scalar* A, std::ptrdiff_t lda, double smallest_pivot, Elimination& found) {
    for (int j = 0; j < n; ++j) {
        Scalar* const column = A + j * lda;
        const Scalar pivot = column[j];
        const double size = std::abs(double(pivot));
        if (!(size >= smallest_pivot && size <= std::numeric_limits<Scalar>::max())) {
            found.failed = j;
            found.failed_pivot = pivot;
            return;
        }
        found.negative += pivot < 0;
        found.smallest = std::min(found.smallest, size);
        for (int k = j + 1; k < n; ++k) {
            const Scalar l = column[k] / pivot;
            found.growth = std::max(found.growth, std::abs(double(l * column[k])));
            Scalar* const other = A + k * lda;
            for (int i = k; i < n; ++i) other[i] -= l * column[i];
        }
        for (int k = j + 1; k < n; ++k) column[k] /= pivot;
    }
}

// Rows below a block that is eliminated: W := B L^-T = L21 D, kept in `scratch`, and B := L21.
template <class Scalar>
void eliminate_rows(int rows, int n, const Scalar* L, Scalar* B, Scalar* W, int ld, double& growth) {
    using Column = Eigen::Map<Eigen::Array<Scalar, Eigen::Dynamic, 1>>;
    divide_by_transposed(rows, n, L, ld, B, ld);
    Scalar largest = 0;
    for (std::ptrdiff_t j = 0; j < n; ++j) {
        Column l(B + j * ld, rows), w(W + j * ld, rows);
        w = l;
        l *= 1 / L[j + j * ld];
        largest = std::max(largest, (l * w).abs().maxCoeff());
    }
    growth = std::max(growth, double(largest));
}

}  // namespace

template <class Scalar>
Elimination eliminate(const Front<Scalar>& f, Scalar* scratch, double smallest_pivot, bool parallel) {
    Elimination found;
    const int m = f.rows, n = f.columns;
    const std::ptrdiff_t ld = m;
    for (int k = 0; k < n; k += block_columns) {
        const int width = std::min(block_columns, n - k), next = k + width;
        Scalar *const columns = f.panel + k * ld, *const products = scratch + k * ld, *const block = columns + k;
        eliminate_block(width, block, ld, smallest_pivot, found);
        if (found.failed >= 0) {
            found.failed += k;
            return found;
        }
        std::vector<double> growth(static_cast<std::size_t>((m - next + tile_rows - 1) / tile_rows), found.growth);
        const auto tile = [&](std::size_t t) {
            const int i = next + static_cast<int>(t) * tile_rows;
            eliminate_rows(std::min(tile_rows, m - i), width, block, columns + i, products + i, m, growth[t]);
        };
        parallel_for(growth.size(), tile, parallel);
        for (const double g : growth) found.growth = std::max(found.growth, g);
        if (next < n)
            subtract_below(m - next, n - next, width, columns + next, m, products + next, m, f.panel + next * ld + next,
                           ld, parallel);
    }
    if (m > n) subtract_below(m - n, m - n, n, f.panel + n, m, scratch + n, m, f.update, m - n, parallel);
    return found;
}

template Elimination eliminate(const Front<float>&, float*, double, bool);
template Elimination eliminate(const Front<double>&, double*, double, bool);

}  // namespace tubule
