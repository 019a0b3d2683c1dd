// What fits into memory, asked before it is allocated: a system that promises more than it has kills the program later.
#pragma once

#include <cstddef>
#include <string>

#include "common/solve/sparse.hpp"

namespace tubule {

// Says what is too large, how much memory it would take, how much there is, and what to try.
struct TooLarge : SolveError {
    using SolveError::SolveError;
};

// Bytes that this process may still have: of the machine, of its control group, of its own limit (ulimit -v).
double free_memory();

// Throws TooLarge if this much is not free; `what` takes it, such as "a surface of 1000000 triangles".
void require_memory(double bytes, const std::string& what);

// Whether this process has a limit of its own (ulimit -v).
bool limited_memory();

// Whether as much can be had at once. Asked before libraries that do not live on without it: HDF5 crashes, OpenBLAS
// asks again, forever.
bool can_allocate(std::size_t bytes);

// The factors of a matrix of this size: their memory, and the time of the multiplications, during which nothing can be
// interrupted: also throws Paused if that would go far beyond the time limit (check_pause).
void require_factors(double bytes, double multiplications, Eigen::Index size);

}  // namespace tubule
