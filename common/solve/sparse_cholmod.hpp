// Shared by all uses of CHOLMOD. Private to common/solve.
#pragma once

#include <Eigen/CholmodSupport>

#include "common/solve/sparse.hpp"

namespace tubule {

// A CHOLMOD workspace that prints nothing and uses one ordering, to be filled in.
struct CholmodCommon : cholmod_common {
    CholmodCommon() {
        cholmod_start(this);
        print = 0;
        nmethods = 1;
    }
    CholmodCommon(const CholmodCommon&) = delete;
    CholmodCommon& operator=(const CholmodCommon&) = delete;
    ~CholmodCommon() { cholmod_finish(this); }
};

// std::invalid_argument unless the ordering is a permutation of this many unknowns.
void require_ordering(const Ordering& ordering, Eigen::Index size);

}  // namespace tubule
