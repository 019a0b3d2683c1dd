// The scheme of the paper (its appendix on the numerical method), as printed but for the misprints: the baseline that
// the default schemes are compared with. Semi-implicit Euler on the surface of the last step, one system for
// (u, Y, H, p), where the displacement Y is that of Barrett, Garcke and Nuernberg and H is implicit; K is explicit.
#pragma once

#include "common/solve/sparse.hpp"
#include "surface3d/fem/field_unknowns.hpp"
#include "surface3d/motion/schemes/time_scheme.hpp"

namespace tubule::surface3d {

// Three components of P_k for u and Y each, H of P_k, p of P_{k-1}.
struct PaperUnknowns : FieldUnknowns {
    explicit PaperUnknowns(const CurvedMesh& mesh)
        : FieldUnknowns(mesh, 7, mesh.order - 1), Y(3 * nodes()), H(6 * nodes()), p(7 * nodes()) {}

    int Y, H, p;  // first number of each; the velocity begins at 0
};

// The moduli that the paper has a force for.
struct PaperModuli {
    double k20 = 0, k40 = 0, k42 = 0, H0 = 0;
};

// Nodal values on the surface of the last step. The normal is the averaged one, to which B and K belong; H is the
// weak Laplacian of the position, as the scheme's own. All but the normal are smoothed.
struct PaperFields {
    VectorField normal, grad_K;
    Eigen::VectorXd H, K;
};

class Paper : public TimeScheme {
public:
    // control.smoothing: the eps >= 0 of the paper's a - eps Lap a = a_h for K, grad K and the explicit H. The paper
    // chose it by experiment and gives no value; 0 leaves an L2 projection. The velocity has three components in all
    // models, the overdamped one, too. std::invalid_argument for eps < 0 and for what the scheme has no equations for:
    // a gradient flow, other terms of the energy, and Stokes without friction, whose rigid motions are undetermined.
    Paper(const CurvedMesh& mesh, const SurfaceLaw& law, const Bending& bending, const MotionControl& control);

    // Leaves `error` and `correction` of the answer 0: nothing is estimated, and area and volume drift.
    MotionStep step(const MotionState& from, double tau) override;

    // What is explicit in a step from this surface.
    PaperFields fields(const CurvedMesh& mesh);

private:
    void assemble(const MotionState& from, double tau);

    PaperModuli moduli_;
    PaperUnknowns unknowns_;
    Tabulation pressure_;
    Eigen::SparseMatrix<double> A_;
    Eigen::VectorXd b_, flux_;  // (u.nu, 1) = flux . unknowns: the column and the row of lambda
    SparseLuLarge solver_;
};

}  // namespace tubule::surface3d
