#include "surface3d/equilibrium/surface_spectrum.hpp"

#include <Spectra/SymGEigsShiftSolver.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <functional>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "common/solve/bordered_ldlt.hpp"
#include "common/solve/dense.hpp"
#include "common/solve/pause.hpp"

namespace tubule::surface3d {
namespace {

// Factors of [A - shift M, C, L S; C^T, 0, 0; S L^T, 0, -signs], S^2 = |weights|, and how many eigenvalues lie below
// the shift. Weights may be tiny, as those of beads that hardly pull.
class Shifted {
public:
    Shifted(const ConstrainedForm& A, const Ordering& ordering, double shift,
            BorderedLdlt::Otherwise otherwise = BorderedLdlt::Otherwise::fail)
        : size_(A.form.rows()),
          roots_(A.weights.cwiseAbs().cwiseSqrt()),
          factors_(ordering, static_cast<int>(A.constraints.cols() + A.low_rank.cols()), otherwise) {
        factors_.factor(bordered(A, shift));
        if (factors_.pivoted()) return;
        negative_ = factors_.negative() - static_cast<int>(A.constraints.cols());
        if (factors_.complement().size() == 0) return;
        negative_ += static_cast<int>((eigenpairs(factors_.complement(), false).values.array() < 0).count());
        // Each positive weight brings a negative eigenvalue of its own.
        negative_ -= static_cast<int>((A.weights.array() > 0).count());
    }

    int negative() const { return negative_; }

    Eigen::VectorXd solve(const Eigen::VectorXd& b) const { return solve_all(b).head(size_); }
    // With the multipliers of the constraints and of the parts of low rank after it.
    Eigen::VectorXd solve_all(const Eigen::VectorXd& b) const {
        Eigen::VectorXd all = Eigen::VectorXd::Zero(factors_.size());
        all.head(size_) = b;
        all = factors_.solve(all);
        all.tail(roots_.size()).array() *= roots_.array();
        return all;
    }
    bool pivoted() const { return factors_.pivoted(); }

private:
    Eigen::SparseMatrix<double> bordered(const ConstrainedForm& A, double shift) const {
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
                for (int i = 0; i < l; ++i) out.insertBack(n + c + i, j) = A.low_rank(j, i) * roots_[i];
                continue;
            }
            for (int i = 0; i < n; ++i)
                out.insertBack(i, j) =
                    j < n + c ? A.constraints(i, j - n) : A.low_rank(i, j - n - c) * roots_[j - n - c];
            if (j >= n + c) out.insertBack(j, j) = A.weights[j - n - c] > 0 ? -1 : 1;
        }
        out.finalize();
        return out;
    }

    Eigen::Index size_;
    Eigen::VectorXd roots_;
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

// Columns w, and M w of each.
struct Pairs {
    Eigen::MatrixXd w, f;

    void append(const Pairs& more) {
        w.conservativeResize(more.w.rows(), w.cols() + more.w.cols()), w.rightCols(more.w.cols()) = more.w;
        f.conservativeResize(more.f.rows(), f.cols() + more.f.cols()), f.rightCols(more.f.cols()) = more.f;
    }
    Pairs times(const Eigen::MatrixXd& c) const { return {w * c, f * c}; }
    void leave_out(const Pairs& others) {
        const Eigen::MatrixXd parts = others.f.transpose() * w;
        w -= others.w * parts, f -= others.f * parts;
    }
};

// Pairs of norm 1, orthogonal to the others and to each other; fewer where some depend on the others. Times `factor`
// they are what was given, but for what the others hold.
std::pair<Pairs, Eigen::MatrixXd> orthonormal(Pairs of, const std::vector<const Pairs*>& others) {
    const double before = of.w.cwiseProduct(of.f).colwise().sum().maxCoeff();
    for (int k = 0; k < 2; ++k)
        for (const Pairs* other : others)
            if (other->w.cols() > 0) of.leave_out(*other);
    Eigen::MatrixXd factor = Eigen::MatrixXd::Identity(of.w.cols(), of.w.cols());
    for (int k = 0; k < 2; ++k) {
        const Eigen::MatrixXd products = of.w.transpose() * of.f;
        const Eigenpairs gram = eigenpairs((products + products.transpose()) / 2, true);
        const Eigen::Index some = (gram.values.array() > (k == 0 ? 1e-14 * before : 0)).count();
        if (some == 0) return {of.times(gram.vectors.leftCols(0)), factor.topRows(0)};
        const Eigen::MatrixXd vectors = gram.vectors.rightCols(some);
        const Eigen::VectorXd norms = gram.values.tail(some).cwiseSqrt();
        of = of.times(vectors * norms.cwiseInverse().asDiagonal());
        factor = (norms.asDiagonal() * vectors.transpose() * factor).eval();
    }
    return {of, factor};
}

// (A - shift M)^-1 M for pairs.
struct InvertedFlow {
    const FlowForm& flow;
    const Shifted& factors;
    double shift;

    // What M w = f leads to.
    Pairs operator()(const Eigen::MatrixXd& f) const {
        const ConstrainedForm& A = flow.form;
        const Eigen::Index all = A.form.rows(), stretch = flow.size - flow.nodes;
        Pairs out{Eigen::MatrixXd(flow.size, f.cols()), Eigen::MatrixXd(flow.size, f.cols())};
        for (Eigen::Index j = 0; j < f.cols(); ++j) {
            Eigen::VectorXd b = Eigen::VectorXd::Zero(all);
            b.head(flow.nodes) = f.col(j).head(flow.nodes), b.tail(stretch) = f.col(j).tail(stretch);
            const Eigen::VectorXd x = factors.solve_all(b);
            const Eigen::VectorXd drag = A.form * x.head(all) +
                                         A.constraints.leftCols(flow.held) * x.segment(all, flow.held) +
                                         A.low_rank * x.tail(A.low_rank.cols()) - b;
            out.w.col(j) << x.head(flow.nodes), x.head(all).tail(stretch);
            out.f.col(j) << drag.head(flow.nodes) / shift, drag.tail(stretch) / shift;
        }
        out.f -= flow.none * (flow.none.transpose() * out.f);
        return out;
    }
};

// The largest eigenvalues of the inverse, descending, on pairs orthogonal to those `found`, by a block of Lanczos'
// method that grows until `count` of them are exact, or the first is below `least`; or until rounding might count. Then
// `first` is where to go on.
std::pair<Eigen::VectorXd, Pairs> largest_of(const InvertedFlow& inverse, const Pairs& found, int count, double least,
                                             Eigen::MatrixXd& first) {
    constexpr int most = 12;
    Pairs basis, next = orthonormal(inverse(inverse(first).f), {&found}).first;
    Eigen::MatrixXd T;
    for (int step = 1;; ++step) {
        check_pause();
        const Eigen::Index before = T.rows(), more = next.w.cols();
        basis.append(next);
        Pairs image = inverse(next.f);
        Eigen::MatrixXd factor;
        T.conservativeResize(before + more, before + more);
        T.rightCols(more) = basis.f.transpose() * image.w;
        T.bottomRows(more) = T.rightCols(more).transpose().eval();
        std::tie(next, factor) = orthonormal(std::move(image), {&found, &basis});
        const Eigenpairs ritz = eigenpairs((T + T.transpose()) / 2, true);
        const Eigen::VectorXd residuals = (factor * ritz.vectors.bottomRows(more)).colwise().norm();
        const Eigen::VectorXd values = ritz.values.reverse();
        const bool none = values[0] < (1 + 1e-6) * least && residuals.tail(1)[0] < 1e-3 * values[0];
        Eigen::Index exact = 0;
        while (exact < std::min<Eigen::Index>(count, values.size()) && !none &&
               residuals.reverse()[exact] <= 1e-5 * std::abs(values[exact]))
            ++exact;
        if (!none && exact < count && step < most && next.w.cols() > 0) continue;
        const Eigen::Index rest = std::min(values.size() - exact, first.cols());
        first =
            none || rest == 0 ? Eigen::MatrixXd() : basis.f * ritz.vectors.rowwise().reverse().middleCols(exact, rest);
        return {values.head(exact), basis.times(ritz.vectors.rowwise().reverse().leftCols(exact))};
    }
}

// (B - shift)^-1 for the flow of a fluid in (w, u), w' = u.nu and inertia u' = -A w - mass u as B has it: theory.md
// (8.14). Columns are shift w over u, zeros for pressures.
class InvertedFluid {
public:
    InvertedFluid(const FlowForm& flow, const Shifted& factors, double shift)
        : flow_(flow), factors_(factors), shift_(shift), all_(flow.form.form.rows()) {}

    // Velocities that forces along the normal lead to, and w as if they had lasted since 1/shift.
    Eigen::MatrixXd pushed(int count) const {
        Eigen::MatrixXd out(flow_.size + all_, count);
        for (int j = 0; j < count; ++j) {
            const double turns = 1 + j * static_cast<double>(flow_.nodes);
            Eigen::VectorXd f = Eigen::VectorXd::Zero(all_);
            f.head(flow_.nodes) = Eigen::VectorXd::LinSpaced(flow_.nodes, 1, 1 + turns).array().sin();
            f = flow_.inertia * velocities(f);
            out.col(j).tail(all_) = velocities(f);
            out.col(j).head(flow_.size) = without_motions(normal_part(out.col(j).tail(all_)));
        }
        return out;
    }
    Eigen::MatrixXd operator()(const Eigen::MatrixXd& z) const {
        Eigen::MatrixXd out(z.rows(), z.cols());
        for (Eigen::Index j = 0; j < z.cols(); ++j) {
            const Eigen::VectorXd w = z.col(j).head(flow_.size) / shift_, u = z.col(j).tail(all_);
            out.col(j).tail(all_) = velocities(of_form(w) - shift_ * (flow_.inertia * u));
            out.col(j).head(flow_.size) = without_motions(normal_part(out.col(j).tail(all_)) - w);
        }
        return out;
    }
    // Whether elastic energy, which equals the kinetic one of what oscillates, drives z; else a velocity dies out.
    bool is_shape(const Eigen::VectorXcd& z) const {
        double elastic = 0, kinetic = 0;
        for (const Eigen::VectorXd& part : {Eigen::VectorXd(z.real()), Eigen::VectorXd(z.imag())}) {
            const Eigen::VectorXd w = part.head(flow_.size) / shift_, u = part.tail(all_);
            elastic += placed(w).dot(of_form(w)), kinetic += u.dot(flow_.inertia * u);
        }
        return std::abs(elastic) > (1 - 1e-2) * kinetic;
    }
    // Rates on what the columns z span, which are left eigenvectors, too, once w is multiplied by A and u by -inertia:
    // their errors are of second order in those of z. Vectors are coefficients of the columns.
    ComplexEigenpairs rates_on(const Eigen::MatrixXd& z) const {
        const Eigen::Index n = z.cols();
        Eigen::MatrixXd w(all_, n), Aw(all_, n);
        for (Eigen::Index j = 0; j < n; ++j) {
            const Eigen::VectorXd one = z.col(j).head(flow_.size) / shift_;
            w.col(j) = placed(one), Aw.col(j) = of_form(one);
        }
        const Eigen::MatrixXd u = z.bottomRows(all_), cross = Aw.transpose() * u;
        const Eigen::MatrixXd products = w.transpose() * Aw - u.transpose() * (flow_.inertia * u),
                              rates = cross + cross.transpose() + u.transpose() * (flow_.form.mass * u);
        auto found = general_eigenpairs(solve_dense(products, rates));
        if (!found) throw SolveError("the rates on a space of velocities were not found");
        return std::move(*found);
    }

private:
    Eigen::VectorXd velocities(const Eigen::VectorXd& f) const {
        Eigen::VectorXd x = factors_.solve(f);
        const Eigen::Index pressures = flow_.multipliers + 1, stretch = flow_.size - flow_.nodes;
        x.segment(all_ - stretch - pressures, pressures).setZero();
        return x;
    }
    Eigen::VectorXd placed(const Eigen::VectorXd& w) const {
        Eigen::VectorXd x = Eigen::VectorXd::Zero(all_);
        const Eigen::Index stretch = flow_.size - flow_.nodes;
        x.head(flow_.nodes) = w.head(flow_.nodes), x.tail(stretch) = w.tail(stretch);
        return x;
    }
    Eigen::VectorXd of_form(const Eigen::VectorXd& w) const {
        const Eigen::VectorXd x = placed(w);
        const ConstrainedForm& A = flow_.form;
        return A.form * x + A.low_rank * A.weights.cwiseProduct(A.low_rank.transpose() * x);
    }
    Eigen::VectorXd normal_part(const Eigen::VectorXd& u) const {
        Eigen::VectorXd out(flow_.size);
        out << u.head(flow_.nodes), u.tail(flow_.size - flow_.nodes);
        return out;
    }
    Eigen::VectorXd without_motions(const Eigen::VectorXd& w) const {
        return w - flow_.none * (flow_.none.transpose() * w);
    }

    const FlowForm& flow_;
    const Shifted& factors_;
    double shift_;
    Eigen::Index all_;
};

// Makes the columns orthonormal, and orthogonal to those of Q; fewer where some depend on others. Q times the first,
// and the columns times the second, are what was given.
std::pair<Eigen::MatrixXd, Eigen::MatrixXd> orthonormalise(Eigen::MatrixXd& z, const Eigen::MatrixXd& Q) {
    Eigen::MatrixXd parts = Eigen::MatrixXd::Zero(Q.cols(), z.cols()),
                    factor = Eigen::MatrixXd::Identity(z.cols(), z.cols());
    const double before = z.colwise().squaredNorm().maxCoeff();
    for (int k = 0; k < 2; ++k) {
        const Eigen::MatrixXd along = Q.transpose() * z;
        z -= Q * along, parts += along * factor;
        const Eigenpairs gram = eigenpairs(z.transpose() * z, true);
        const Eigen::Index some = (gram.values.array() > (k == 0 ? 1e-20 * before : 0)).count();
        const Eigen::MatrixXd vectors = gram.vectors.rightCols(some);
        const Eigen::VectorXd norms = gram.values.tail(some).cwiseSqrt();
        z = (z * vectors * norms.cwiseInverse().asDiagonal()).eval();
        factor = (norms.asDiagonal() * vectors.transpose() * factor).eval();
    }
    return {parts, factor};
}

// First those that grow, then by size.
double slowness(std::complex<double> s) {
    return s.imag() == 0 && s.real() > 0 ? -1 / s.real() : std::abs(s);
}

// Displacements and velocities that span those of slowest_of_fluid(), by a block of Arnoldi's method that grows until
// they are found to 2e-4.
Eigen::MatrixXd span_of_modes(const InvertedFluid& inverse, int count, double shift) {
    const int block = std::min(count + 2, 12), most = 200 + 10 * count;
    Eigen::MatrixXd next = inverse.pushed(block), Q(next.rows(), 0), H(0, 0), last;
    orthonormalise(next, Q);
    for (;;) {
        check_pause();
        const Eigen::Index before = Q.cols(), more = next.cols();
        Q.conservativeResize(Eigen::NoChange, before + more), Q.rightCols(more) = next;
        next = inverse(next);
        const auto [parts, factor] = orthonormalise(next, Q);
        H.conservativeResize(before + more, before + more);
        H.bottomRows(more).setZero(), H.rightCols(more) = parts;
        if (before > 0) H.block(before, before - last.cols(), more, last.cols()) = last;
        last = factor;
        const std::optional<ComplexEigenpairs> ritz = general_eigenpairs(H);
        if (!ritz) throw SolveError("the rates on a space of velocities were not found");
        std::vector<std::pair<double, Eigen::Index>> order;
        for (Eigen::Index j = 0; j < H.cols(); ++j)
            if (const std::complex<double> value = ritz->values[j];
                std::abs(value) * shift > 1e-10 && value.imag() <= 0)
                order.emplace_back(slowness(shift + 1.0 / value), j);
        std::sort(order.begin(), order.end());
        Eigen::MatrixXd found(Q.rows(), 0);
        int modes = 0;
        for (const auto& [place, j] : order) {
            const Eigen::VectorXcd y = ritz->vectors.col(j);
            const double residual = (factor * y.tail(more)).norm() / std::abs(ritz->values[j]);
            if (residual > 0.1) continue;  // nothing that is there
            const Eigen::VectorXcd z = Q * y;
            if (!inverse.is_shape(z)) continue;
            if (residual > 2e-4) break;
            const bool pair = ritz->values[j].imag() != 0;
            found.conservativeResize(Eigen::NoChange, found.cols() + 1 + pair);
            found.rightCols(1) = z.real();
            if (pair) found.col(found.cols() - 2) = z.imag();
            if (++modes == count) return found;
        }
        if (next.cols() == 0 || Q.cols() > most) throw SolveError("the slowest modes of the fluid were not found");
    }
}

// Empty, or why a value may be missing: the inertia between the last two that are apart counts them.
std::string why_incomplete(const ConstrainedForm& A, const Ordering& ordering, const Eigen::VectorXd& values) {
    const double spread = values.cwiseAbs().maxCoeff();
    Eigen::Index last = values.size() - 1;
    while (last > 0 && values[last] - values[last - 1] < 1e-6 * spread) --last;
    if (last == 0) return {};
    const double between = (values[last] + values[last - 1]) / 2;
    const int below = count_below(A, ordering, between);
    if (below == last) return {};
    return fmt::format("{} eigenvalues are below {:.6g} by the inertia, {} by Lanczos' method", below, between, last);
}

}  // namespace

void set_errors(const SurfaceSpectrum& coarse, int coarse_triangles, SurfaceSpectrum& fine, int fine_triangles,
                int order) {
    const Eigen::Index count = fine.values.size();
    if (coarse.values.size() != count) return;
    Eigen::VectorXd values = coarse.values, frequencies = coarse.frequencies;
    // Rates whose real parts are nearly the same may change places.
    for (Eigen::Index i = 0; i < frequencies.size(); ++i) {
        const auto apart = [&](Eigen::Index j) {
            return std::hypot(values[j] - fine.values[i], frequencies[j] - fine.frequencies[i]);
        };
        Eigen::Index nearest = i;
        for (Eigen::Index j = i + 1; j < count; ++j)
            if (apart(j) < apart(nearest)) nearest = j;
        std::swap(values[i], values[nearest]), std::swap(frequencies[i], frequencies[nearest]);
    }
    fine.errors = errors_between(values, coarse_triangles, fine.values, fine_triangles, order);
    if (frequencies.size() > 0)
        fine.frequency_errors = errors_between(frequencies, coarse_triangles, fine.frequencies, fine_triangles, order);
}

Eigen::VectorXd errors_between(const Eigen::VectorXd& coarse, int coarse_triangles, const Eigen::VectorXd& fine,
                               int fine_triangles, int order) {
    const double fall = std::pow(static_cast<double>(coarse_triangles) / fine_triangles, (order - 1) / 2.0);
    const Eigen::VectorXd errors = (coarse - fine).cwiseAbs() * fall / (1 - std::min(fall, 0.5));
    // Two meshes may agree on one value by chance, so each has the largest relative error of those known to a tenth.
    double relative = 0;
    for (Eigen::Index i = 0; i < errors.size(); ++i)
        if (errors[i] < 0.1 * std::abs(fine[i])) relative = std::max(relative, errors[i] / std::abs(fine[i]));
    return errors.cwiseMax(relative * fine.cwiseAbs());
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
    try {
        out.negative = count_negative(A, ordering, scale);
        out.doubt = why_incomplete(A, ordering, out.values);
        if (!out.doubt.empty() && basis < 60) {  // one of a multiple value: rounding finds it among more vectors
            SurfaceSpectrum more = lowest_eigenvalues(A, ordering, count + 20, scale);
            more.values.conservativeResize(count);
            more.vectors.conservativeResize(Eigen::NoChange, count);
            more.doubt = why_incomplete(A, ordering, more.values);
            return more;
        }
    } catch (const SolveError& error) {
        out.doubt = fmt::format("the number of eigenvalues could not be counted: {}", error.what());
        out.negative = static_cast<int>((out.values.array() < 0).count());
    }
    return out;
}

SurfaceSpectrum lowest_of_flow(const FlowForm& flow, int count, double scale) {
    count = static_cast<int>(std::min<Eigen::Index>(count, flow.size / 4));
    std::optional<Shifted> factors;
    for (int k = 0;; ++k, scale *= 4) {
        check_pause();
        factors.emplace(flow.form, flow.ordering, -scale, BorderedLdlt::Otherwise::lu);
        if (factors->pivoted() || factors->negative() == flow.multipliers) break;
        if (k == 10) throw SolveError("the rates have no bound that could be found");
    }
    const InvertedFlow inverse{flow, *factors, -scale};
    SurfaceSpectrum out;
    if (factors->pivoted()) out.doubt = "the number of rates could not be counted";
    // One block may miss some of several equal values: others follow until they find none.
    constexpr int block = 4, most = 100;
    Pairs found;
    std::vector<std::pair<double, Eigen::Index>> order;
    Eigen::MatrixXd first;
    for (int round = 0;; ++round) {
        if (round == most) throw SolveError("Lanczos' method for the slowest modes does not converge");
        const bool enough = static_cast<int>(order.size()) >= count, fresh = first.cols() == 0;
        if (fresh) first.resize(flow.size, block);
        for (int j = 0; fresh && j < block; ++j)
            first.col(j) = Eigen::VectorXd::LinSpaced(flow.size, 1, 2 + block * round + j).array().sin();
        const auto [values, pairs] = largest_of(inverse, found, count, enough ? order[count - 1].first : 0, first);
        if (enough && fresh && values.size() == 0 && first.cols() == 0) break;
        for (Eigen::Index i = 0; i < values.size(); ++i) order.emplace_back(values[i], found.w.cols() + i);
        found.append(pairs);
        std::sort(order.begin(), order.end(), std::greater<>());
    }
    out.values.resize(count), out.vectors.resize(flow.size, count);
    for (int i = 0; i < count; ++i)
        out.values[i] = 1 / order[i].first - scale, out.vectors.col(i) = found.w.col(order[i].second);
    return out;
}

SurfaceSpectrum slowest_of_fluid(const FlowForm& flow, int count, double scale) {
    count = static_cast<int>(std::min<Eigen::Index>(count, flow.size / 4));
    std::optional<Shifted> factors;
    for (int k = 0;; ++k, scale *= 4) {
        check_pause();
        ConstrainedForm T = flow.form;
        T.form += scale * scale * flow.inertia;
        factors.emplace(T, flow.ordering, -scale, BorderedLdlt::Otherwise::lu);
        if (factors->pivoted() || factors->negative() == flow.multipliers) break;
        if (k == 10) throw SolveError("the rates have no bound that could be found");
    }
    const InvertedFluid inverse(flow, *factors, scale);
    const Eigen::MatrixXd z = span_of_modes(inverse, count, scale);
    ComplexEigenpairs found = inverse.rates_on(z);
    std::vector<Eigen::Index> order;
    for (Eigen::Index j = 0; j < z.cols(); ++j) {
        std::complex<double>& s = found.values[j];
        if (std::abs(s.imag()) < 1e-6 * std::abs(s)) {  // rounding makes a pair of a double value
            if (s.imag() < 0) found.vectors.col(j) *= std::complex<double>(0, 1);
            s = s.real();
        }
        if (s.imag() >= 0) order.push_back(j);
    }
    if (static_cast<int>(order.size()) < count) throw SolveError("the slowest modes of the fluid were not found");
    std::sort(order.begin(), order.end(), [&](Eigen::Index a, Eigen::Index b) {
        const std::complex<double> s = found.values[a], t = found.values[b];
        return std::pair(-s.real(), s.imag()) < std::pair(-t.real(), t.imag());
    });
    SurfaceSpectrum out;
    if (factors->pivoted()) out.doubt = "the number of rates could not be counted";
    out.values.resize(count), out.frequencies.resize(count), out.vectors.resize(flow.size, count);
    for (int i = 0; i < count; ++i) {
        const std::complex<double> s = found.values[order[i]];
        out.values[i] = -s.real(), out.frequencies[i] = s.imag();
        Eigen::VectorXcd w = z.topRows(flow.size) * found.vectors.col(order[i]);
        Eigen::Index largest = 0;
        w.cwiseAbs().maxCoeff(&largest);
        if (s.imag() > 0) w *= std::abs(w[largest]) / w[largest];
        out.vectors.col(i) = w.real();
    }
    return out;
}

}  // namespace tubule::surface3d
