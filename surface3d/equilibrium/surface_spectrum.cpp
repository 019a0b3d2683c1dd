#include "surface3d/equilibrium/surface_spectrum.hpp"

#include <Spectra/SymGEigsShiftSolver.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "common/solve/bordered_ldlt.hpp"
#include "common/solve/dense.hpp"
#include "common/solve/pause.hpp"

namespace tubule::surface3d {
namespace {

// Factors of [A - shift M, C, L; C^T, 0, 0; L^T, 0, -1/weights], and how many eigenvalues lie below the shift.
class Shifted {
public:
    Shifted(const ConstrainedForm& A, const Ordering& ordering, double shift)
        : size_(A.form.rows()),
          factors_(ordering, static_cast<int>(A.constraints.cols() + A.low_rank.cols()),
                   BorderedLdlt::Otherwise::fail) {
        factors_.factor(bordered(A, shift));
        negative_ = factors_.negative() - static_cast<int>(A.constraints.cols());
        if (factors_.complement().size() == 0) return;
        negative_ += static_cast<int>((eigenpairs(factors_.complement(), false).values.array() < 0).count());
        // Each positive weight brings a negative eigenvalue of its own.
        negative_ -= static_cast<int>((A.weights.array() > 0).count());
    }

    int negative() const { return negative_; }

    Eigen::VectorXd solve(const Eigen::VectorXd& b) const {
        Eigen::VectorXd all = Eigen::VectorXd::Zero(size_ + factors_.complement().rows());
        all.head(size_) = b;
        return factors_.solve(all).head(size_);
    }

private:
    static Eigen::SparseMatrix<double> bordered(const ConstrainedForm& A, double shift) {
        const Eigen::SparseMatrix<double> form = A.form - shift * A.mass;
        const int n = static_cast<int>(form.rows()), c = static_cast<int>(A.constraints.cols()),
                  l = static_cast<int>(A.low_rank.cols());
        Eigen::SparseMatrix<double> out(n + c + l, n + c + l);
        out.reserve(form.nonZeros() + 2 * n * (c + l) + l);
        for (int j = 0; j < n + c + l; ++j) {
            out.startVec(j);
            if (j < n) {
                for (Eigen::SparseMatrix<double>::InnerIterator it(form, j); it; ++it)
                    out.insertBack(it.row(), j) = it.value();
                for (int i = 0; i < c; ++i) out.insertBack(n + i, j) = A.constraints(j, i);
                for (int i = 0; i < l; ++i) out.insertBack(n + c + i, j) = A.low_rank(j, i);
                continue;
            }
            for (int i = 0; i < n; ++i)
                out.insertBack(i, j) = j < n + c ? A.constraints(i, j - n) : A.low_rank(i, j - n - c);
            if (j >= n + c) out.insertBack(j, j) = -1 / A.weights[j - n - c];
        }
        out.finalize();
        return out;
    }

    Eigen::Index size_;
    BorderedLdlt factors_;
    int negative_ = 0;
};

// At `shift` or below, where the form can be factored: A alone may be singular, for what is held makes it regular.
std::pair<Shifted, double> factored_near(const ConstrainedForm& A, const Ordering& ordering, double shift,
                                         double scale) {
    for (int k = 0;; ++k) try {
            const double at = k == 0 ? shift : shift - scale * std::pow(10, k - 5);
            return {Shifted(A, ordering, at), at};
        } catch (const SolveError&) {
            if (k == 5) throw;
        }
}

// What Spectra asks for.
struct InvertedForm {
    using Scalar = double;
    const Shifted& factors;
    Eigen::Index size;
    Eigen::Index rows() const { return size; }
    Eigen::Index cols() const { return size; }
    void set_shift(double) {}
    void perform_op(const double* x, double* y) const {
        Eigen::Map<Eigen::VectorXd>(y, size) = factors.solve(Eigen::Map<const Eigen::VectorXd>(x, size));
    }
};
struct Mass {
    using Scalar = double;
    const Eigen::SparseMatrix<double>& M;
    Eigen::Index rows() const { return M.rows(); }
    Eigen::Index cols() const { return M.cols(); }
    void perform_op(const double* x, double* y) const {
        Eigen::Map<Eigen::VectorXd>(y, M.rows()) = M * Eigen::Map<const Eigen::VectorXd>(x, M.rows());
    }
};

}  // namespace

Eigen::VectorXd errors_between(const Eigen::VectorXd& coarse, int coarse_triangles, const Eigen::VectorXd& fine,
                               int fine_triangles, int order) {
    const double fall = std::pow(static_cast<double>(coarse_triangles) / fine_triangles, (order - 1) / 2.0);
    return (coarse - fine).cwiseAbs() * fall / (1 - std::min(fall, 0.5));
}

int count_below(const ConstrainedForm& A, const Ordering& ordering, double shift) {
    return Shifted(A, ordering, shift).negative();
}

int count_negative(const ConstrainedForm& A, const Ordering& ordering, double scale) {
    return factored_near(A, ordering, 0, 1e-4 * scale).first.negative();
}

SurfaceSpectrum lowest_eigenvalues(const ConstrainedForm& A, const Ordering& ordering, int count, double scale) {
    const Eigen::Index n = A.form.rows();
    if (count == 0) try {
            SurfaceSpectrum out;
            out.negative = count_negative(A, ordering, scale);
            return out;
        } catch (const SolveError&) {
            count = 1;
        }
    count = static_cast<int>(std::min<Eigen::Index>(count, n - 1 - A.constraints.cols()));
    double shift = -scale;
    std::optional<std::pair<Shifted, double>> low;
    for (int k = 0;; ++k, shift *= 4) {
        check_pause();
        low.emplace(factored_near(A, ordering, shift, scale));
        if (low->first.negative() == 0) break;
        if (k == 20) throw SolveError("the form has no lower bound that could be found");
    }
    InvertedForm inverse{low->first, n};
    Mass mass{A.mass};
    const Eigen::Index basis = std::min<Eigen::Index>(n - A.constraints.cols(), std::max(2 * count + 1, 20));
    Spectra::SymGEigsShiftSolver<InvertedForm, Mass, Spectra::GEigsMode::ShiftInvert> lanczos(inverse, mass, count,
                                                                                              basis, low->second);
    const Eigen::VectorXd begin = low->first.solve(A.mass * Eigen::VectorXd::LinSpaced(n, 1, 2).array().sin().matrix());
    lanczos.init(begin.data());
    lanczos.compute(Spectra::SortRule::LargestMagn, 300, 1e-11, Spectra::SortRule::SmallestAlge);
    if (lanczos.info() != Spectra::CompInfo::Successful)
        throw SolveError("Lanczos' method for the lowest eigenvalues does not converge");
    SurfaceSpectrum out;
    out.values = lanczos.eigenvalues(), out.vectors = lanczos.eigenvectors();
    // The inertia between the last two values that are apart tells whether one is missing.
    const double spread = out.values.cwiseAbs().maxCoeff();
    int last = count - 1;
    while (last > 0 && out.values[last] - out.values[last - 1] < 1e-6 * spread) --last;
    try {
        out.negative = count_negative(A, ordering, scale);
        if (last > 0) {
            const double between = (out.values[last] + out.values[last - 1]) / 2;
            const int below = count_below(A, ordering, between);
            if (below != last)
                out.doubt = fmt::format("{} eigenvalues are below {:.6g} by the inertia, {} by Lanczos' method", below,
                                        between, last);
        }
    } catch (const SolveError& error) {
        out.doubt = fmt::format("the number of eigenvalues could not be counted: {}", error.what());
        out.negative = static_cast<int>((out.values.array() < 0).count());
    }
    return out;
}

}  // namespace tubule::surface3d
