// OpenBLAS, which UMFPACK, CHOLMOD and the fronts of SparseLdlt use.
#pragma once

namespace tubule {

// Call before a thread uses the BLAS, in loops of `threads`. OpenBLAS itself gets one: a second gains nothing in
// factors as small as ours, and its threads wait by spinning, on the core that the next assembly wants
// (docs/decisions/linear_algebra.md); a value of OPENBLAS_NUM_THREADS takes precedence. Where memory is limited,
// OpenBLAS takes what these loops will need, and keeps it: once there is none it would ask again and again, forever.
// Throws std::bad_alloc.
void prepare_blas(int threads);

}  // namespace tubule
