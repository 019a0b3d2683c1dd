// The lowest eigenvalues of a sparse symmetric form under constraints, by Lanczos' method with a shift that is
// inverted.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <string>

#include "common/solve/sparse.hpp"

namespace tubule::surface3d {

// A w = value M w for w with C^T w = 0; A = `form` + SUM weight_j L_j L_j^T with few columns L.
struct ConstrainedForm {
    Eigen::SparseMatrix<double> form, mass;  // mass may vanish for a few unknowns
    Eigen::MatrixXd constraints;             // C; may have no columns
    Eigen::MatrixXd low_rank;                // L; may have no columns
    Eigen::VectorXd weights;
};

struct SurfaceSpectrum {
    Eigen::VectorXd values;   // ascending
    Eigen::MatrixXd vectors;  // one column each, of norm 1 in M
    Eigen::VectorXd errors;   // estimated, of the values; empty without a coarser mesh to compare with
    // With inertia: imaginary parts, not negative, of rates with the real parts -values, and their errors.
    Eigen::VectorXd frequencies, frequency_errors;
    int negative = 0;  // eigenvalues below 0, counted by the inertia of the form
    // Empty, or why eigenvalues and inertia do not agree: a value may be missing.
    std::string doubt;
};

// The `count` lowest. `scale`: a size of eigenvalues, from which the search for a lower bound begins. SolveError if no
// shift can be factored, or Lanczos' method does not converge.
SurfaceSpectrum lowest_eigenvalues(const ConstrainedForm& A, const Ordering& ordering, int count, double scale);

// The same for A w = value M w, where M w = f if x is w and what flows with it, mass x = f: theory.md (8.9). `form` is
// A for all of x.
struct FlowForm {
    ConstrainedForm form;
    Ordering ordering;
    Eigen::Index nodes, size;               // w is the first `nodes` of x, and a stretch that is the last
    Eigen::Index held;                      // constraints of w, the first of `form`
    int multipliers;                        // of the others of x: as many negative eigenvalues
    Eigen::MatrixXd none;                   // displacements that cost nothing, orthonormal columns
    Eigen::SparseMatrix<double> inertia{};  // of all of x; empty without
};
// `scale`: a size of the values that are asked for. SolveError if no shift can be factored below all values, or
// Lanczos' method does not converge.
SurfaceSpectrum lowest_of_flow(const FlowForm& flow, int count, double scale);

// The rates s of a law with inertia, (A + s mass + s^2 inertia) x = 0, theory.md (8.14): those that grow, then those of
// least |s|, a conjugate pair as one; sorted by their real parts. Velocities that die out, with less elastic energy
// than kinetic, are left out. `vectors`: w where its largest value is real. Throws as above.
SurfaceSpectrum slowest_of_fluid(const FlowForm& flow, int count, double scale);

// Estimates the errors of `fine`, from the same on a coarser mesh: errors_between() of those that are alike.
void set_errors(const SurfaceSpectrum& coarse, int coarse_triangles, SurfaceSpectrum& fine, int fine_triangles,
                int order);

// Estimated errors of quantities that converge as the energy of triangles of this order, of which these are the values
// on two meshes: half the order is counted on, since meshes are not alike.
Eigen::VectorXd errors_between(const Eigen::VectorXd& coarse, int coarse_triangles, const Eigen::VectorXd& fine,
                               int fine_triangles, int order);

// The number of eigenvalues below `shift`: Sylvester's law for the form with its constraints.
int count_below(const ConstrainedForm& A, const Ordering& ordering, double shift);
int count_negative(const ConstrainedForm& A, const Ordering& ordering, double scale);

}  // namespace tubule::surface3d
