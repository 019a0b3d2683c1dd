// The dense work of a sparse factorisation: eliminates the first columns of a symmetric block. Private to common/solve.
#pragma once

namespace tubule {

// A front: the lower triangle of a symmetric matrix of this many rows, of which the first `columns` are `panel` (rows x
// columns) and the rest is `update`, (rows - columns) squared; all by columns.
template <class Scalar>
struct Front {
    int rows, columns;
    Scalar *panel, *update;
};

// What elimination leaves. Of the pivots: `failed` is the first column whose pivot is not finite or too small, or -1.
struct Elimination {
    int failed = -1, negative = 0;
    double failed_pivot = 0, smallest = 1e300, growth = 0;
};

// Eliminates the columns of the panel: it receives the columns of unit lower triangular L below the diagonal and D on
// it, `update` loses L D L^T. `scratch` holds rows x columns. Works on all threads if `parallel`; the answer is the
// same to the last bit. After a failure the front is undefined.
template <class Scalar>
Elimination eliminate(const Front<Scalar>& front, Scalar* scratch, double smallest_pivot, bool parallel);

}  // namespace tubule
