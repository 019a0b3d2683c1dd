// Shared by all uses of CHOLMOD. Private to common/solve.
#pragma once

#include <cholmod.h>

#include <Eigen/SparseCore>

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

// The lower triangle of A as CHOLMOD sees it, without a copy.
cholmod_sparse lower_triangle(const Eigen::SparseMatrix<double>& A);

}  // namespace tubule
