#include "axisym/splines/spline_space.hpp"

#include <fmt/format.h>
#include <gsl/gsl_integration.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "axisym/splines/band_lu.hpp"
#include "axisym/splines/pack.hpp"
#include "common/solve/memory.hpp"
#include "common/solve/pause.hpp"

namespace tubule::axisym {
namespace {

int floor_div(int a, int b) {
    return a >= 0 ? a / b : -((-a + b - 1) / b);
}

}  // namespace

GaussRule gauss_rule(int n) {
    GaussRule rule{std::vector<double>(n), std::vector<double>(n)};
    gsl_integration_glfixed_table* table = gsl_integration_glfixed_table_alloc(n);
    for (int i = 0; i < n; ++i) gsl_integration_glfixed_point(0, 1, i, &rule.nodes[i], &rule.weights[i], table);
    gsl_integration_glfixed_table_free(table);
    return rule;
}

SplineSpace::SplineSpace(Cell cell, std::vector<double> breaks, int degree, int smoothness, Parity parity)
    : parity_(parity) {
    if (degree < 2 || degree >= max_width) throw std::invalid_argument("spline degree must be 2 ... 7");
    if (smoothness < 1 || smoothness >= degree) throw std::invalid_argument("smoothness must be 1 ... degree - 1");
    if (breaks.size() < 3 || !std::is_sorted(breaks.begin(), breaks.end(), std::less_equal<>{}))
        throw std::invalid_argument("breaks must increase and define at least two elements");
    const auto shared =
        std::make_shared<Shared>(Shared{cell, std::move(breaks), degree, smoothness, degree - smoothness, {}, {}});
    shared_ = shared;
    shared->tabulate(groups());
    number();
}

SplineSpace::SplineSpace(const SplineSpace& other, Parity parity) : shared_(other.shared_), parity_(parity) {
    number();
}

double SplineSpace::bernoulli_norm() const {
    return degree() == 3 ? 1.0 / 720 : degree() == 5 ? 1.0 / 1209600 : 691.0 / 2730 / 479001600;
}

double SplineSpace::bernoulli_norm_of_third() const {
    return degree() == 3 ? 1.0 / 12 : degree() == 5 ? 1.0 / 30240 : 5.0 / 66 / 3628800;
}

double SplineSpace::Shared::knot(int index) const {
    const int n = static_cast<int>(breaks.size()) - 1, j = floor_div(index, multiplicity), L = cell.mirror ? 2 * n : n;
    if (cell.open_start && j < 0) return breaks.front();
    if (cell.open_end && j > n) return breaks.back();
    const int turn = floor_div(j, L), k = j - turn * L;
    const double base = (cell.mirror && k > n) ? 2 * breaks[n] - breaks[2 * n - k] : breaks[k];
    return base + turn * (cell.mirror ? 2 : 1) * cell.length();
}

// Translation by a period and reflection at the two ends of a mirrored cell map raw splines to raw splines that carry
// the same coefficient, reflection with the sign of the parity.
SplineSpace::Folded SplineSpace::folded(int raw) const {
    const int m = shared_->multiplicity, n = elements();
    if (!cell().mirror) return {raw - floor_div(raw, n * m) * n * m, 1};
    const int low = m - 2 - degree(), high = low + 2 * n * m;  // i <-> low - i at z0, i <-> high - i at z1
    int i = raw;
    double sign = 1;
    while ((2 * i < low && !cell().open_start) || (2 * i > high && !cell().open_end)) {
        const bool below = 2 * i < low;
        i = (below ? low : high) - i;
        sign *= below ? parity_.start : parity_.end;
    }
    if (i < first_ || i >= first_ + size_) return {0, 0};
    return {i - first_, sign};
}

void SplineSpace::number() {
    const int m = shared_->multiplicity, n = elements(), low = m - 2 - degree(), high = low + 2 * n * m;
    if (cell().mirror) {  // a spline that is its own mirror image is absent from odd spaces
        first_ =
            cell().open_start ? shared_->first_raw(0) : ((low + 1) >> 1) + (low % 2 == 0 && parity_.start < 0 ? 1 : 0);
        const int last = cell().open_end ? shared_->first_raw(n - 1) + degree()
                                         : (high >> 1) - (high % 2 == 0 && parity_.end < 0 ? 1 : 0);
        size_ = last - first_ + 1;
    } else {
        size_ = n * m;
    }
    for (int e = 0; e < n; ++e)
        for (int a = 0; a < width(); ++a) {
            const auto [dof, sign] = folded(shared_->first_raw(e) + a);
            dofs_.push_back(dof), signs_.push_back(sign);
        }
}

SplineSpace::Active::Active(const Shared& splines, int first) : p(splines.degree) {
    for (int i = 0; i <= 2 * p + 1; ++i) knots[i] = splines.knot(first + i);
    for (int d = 1; d <= p; ++d)
        for (int i = 0; i + d <= 2 * p + 1; ++i) {
            const double span = knots[i + d] - knots[i];
            inverse_span[d][i] = span > 0 ? 1 / span : 0;
        }
    for (int a = 0; a <= p; ++a) {
        double c[max_width] = {};
        c[a] = 1;
        for (int k = 0; k <= p; ++k) {
            if (k <= 3) std::copy_n(c, max_width, combo[k][a]);
            if (k == p) top[a] = c[p];
            const int d = p - k;
            if (d > 0)
                for (int b = p; b >= 0; --b) c[b] = d * (c[b] - (b > 0 ? c[b - 1] : 0)) * inverse_span[d][b];
        }
    }
}

// T is a number, or a pack of points.
template <class T>
void SplineSpace::Active::operator()(const T& z, int derivatives, T* out) const {
    T low[4][max_width];  // values of the splines of degree p - k
    T v[max_width + 1];
    std::fill_n(v, max_width + 1, T(0.0));
    v[p] = T(1.0);
    for (int d = 0;; ++d) {
        if (p - d <= derivatives) std::copy_n(v, max_width, low[p - d]);
        if (d == p) break;
        for (int a = p - d - 1; a <= p; ++a)
            v[a] = (z - knots[a]) * (inverse_span[d + 1][a] * v[a]) +
                   (knots[a + d + 2] - z) * (inverse_span[d + 1][a + 1] * v[a + 1]);
    }
    std::copy_n(low[0], p + 1, out);
    for (int k = 1; k <= derivatives; ++k)
        for (int a = 0; a <= p; ++a) {
            T value(0.0);
            for (int b = std::max(a, k); b <= std::min(a + k, p); ++b) value += combo[k][a][b] * low[k][b];
            out[k * (p + 1) + a] = value;
        }
}

void SplineSpace::Shared::tabulate(int groups) {
    const int n = static_cast<int>(breaks.size()) - 1, w = degree + 1;
    const GaussRule rule = gauss_rule(lanes * groups);
    require_memory(static_cast<double>(n) * (sizeof(Active) + groups * sizeof(Basis)),
                   fmt::format("a profile of {} elements", n));
    basis.assign(n * groups, Basis{});
    active.reserve(n);
    Pack values[3 * max_width];
    for (int e = 0; e < n; ++e) {
        if (e % 1024 == 0) check_pause();
        const Active& splines = active.emplace_back(*this, first_raw(e));
        const double h = breaks[e + 1] - breaks[e];
        for (int g = 0; g < groups; ++g) {
            Basis& b = basis[e * groups + g];
            for (int q = 0; q < lanes; ++q) {
                b.weight[q] = h * rule.weights[g * lanes + q];
                b.z[q] = breaks[e] + h * rule.nodes[g * lanes + q];
            }
            splines(Pack([&](int q) { return b.z[q]; }), 2, values);
            for (int d = 0; d < 3; ++d)
                for (int a = 0; a < w; ++a)
                    for (int q = 0; q < lanes; ++q) b.by_point[d][a][q] = b.by_spline[q][d][a] = values[d * w + a][q];
        }
    }
}

int SplineSpace::element_at(double z) const {
    const auto it = std::upper_bound(breaks().begin() + 1, breaks().end() - 1, z);
    return static_cast<int>(it - breaks().begin()) - 1;
}

void SplineSpace::splines(int element, double z, int derivatives, double* out) const {
    shared_->active[element](z, derivatives, out);
}

std::array<double, 3> SplineSpace::evaluate(const double* c, int element, double z) const {
    // De Boor's triangle. Its last three coefficients, and then two, give the derivatives.
    const Active& at = shared_->active[element];
    const int p = at.p, *dof = dofs(element);
    const double* sign = signs(element);
    const double* t = at.knots;
    double d[max_width];
    for (int a = 0; a <= p; ++a) d[a] = sign[a] * c[dof[a]];
    const auto slope = [&](int a, int span) { return (d[a] - d[a - 1]) * at.inverse_span[span][a]; };
    std::array<double, 3> out{};
    for (int span = p; span > 0; --span) {
        if (span == 2) out[2] = p * (p - 1) * (slope(p, 2) - slope(p - 1, 2)) * at.inverse_span[1][p];
        if (span == 1) out[1] = p * slope(p, 1);
        for (int a = p; a > p - span; --a) d[a] = d[a - 1] + (z - t[a]) * slope(a, span);
    }
    out[0] = d[p];
    return out;
}

double SplineSpace::value(const double* c, int element, double z) const {
    double values[max_width], sum = 0;
    splines(element, z, 0, values);
    for (int a = 0; a < width(); ++a) sum += values[a] * signs(element)[a] * c[dofs(element)[a]];
    return sum;
}

double SplineSpace::extremum_near(const double* c, double z) const {
    for (int iteration = 0; iteration < 4; ++iteration) {
        const int e = element_at(z);
        const auto [r, r1, r2] = evaluate(c, e, z);
        const double reach = breaks()[e + 1] - breaks()[e], before = z;
        if (r2 != 0) z = std::clamp(z - std::clamp(r1 / r2, -reach, reach), cell().z0, cell().z1);
        if (std::abs(z - before) < 0.02 * reach)
            break;  // the next step would be smaller than 1e-3, r exact to 1e-6 of it
    }
    return z;
}

double SplineSpace::top_derivative(const double* c, int element) const {
    double sum = 0;
    for (int a = 0; a < width(); ++a) sum += top_derivatives(element)[a] * signs(element)[a] * c[dofs(element)[a]];
    return sum;
}

// The derivative, of odd order, is odd under reflection where the spline is even, and the reverse.
std::vector<double> SplineSpace::top_jumps(const double* c) const {
    const int n = elements();
    const Cell& in = cell();
    const auto size = [&](int e) { return breaks()[e + 1] - breaks()[e]; };
    std::vector<double> out(n + 1, 0.0);
    for (int e = in.open_start ? 1 : 0; e <= (in.open_end ? n - 1 : n); ++e) {
        const int left = e > 0 ? e - 1 : in.mirror ? 0 : n - 1, right = e < n ? e : in.mirror ? n - 1 : 0;
        const double before = top_derivative(c, left) * (in.mirror && e == 0 ? -parity_.start : 1),
                     after = top_derivative(c, right) * (in.mirror && e == n ? -parity_.end : 1);
        out[e] = 2 * (after - before) / (size(left) + size(right));
    }
    return out;
}

Eigen::VectorXd SplineSpace::mean() const {
    Eigen::VectorXd out = Eigen::VectorXd::Zero(size_);
    for (int e = 0; e < elements(); ++e)
        for (int g = 0; g < groups(); ++g)
            for (int q = 0; q < lanes; ++q)
                for (int a = 0; a < width(); ++a)
                    out[dofs(e)[a]] += signs(e)[a] * basis(e, g).weight[q] * basis(e, g).by_spline[q][0][a];
    return out;
}

Eigen::SparseMatrix<double> SplineSpace::mass() const {
    std::vector<Eigen::Triplet<double>> entries;
    entries.reserve(elements() * width() * width());
    for (int e = 0; e < elements(); ++e)
        for (int a = 0; a < width(); ++a)
            for (int b = 0; b < width(); ++b) {
                const double sign = signs(e)[a] * signs(e)[b];
                if (sign == 0) continue;
                double sum = 0;
                for (int g = 0; g < groups(); ++g)
                    for (int q = 0; q < lanes; ++q)
                        sum += basis(e, g).weight[q] * basis(e, g).by_spline[q][0][a] * basis(e, g).by_spline[q][0][b];
                entries.emplace_back(dofs(e)[a], dofs(e)[b], sign * sum);
            }
    Eigen::SparseMatrix<double> out(size_, size_);
    out.setFromTriplets(entries.begin(), entries.end());
    return out;
}

Eigen::VectorXd SplineSpace::solve_mass(const Eigen::VectorXd& load) const {
    const Eigen::SparseMatrix<double> matrix = mass();
    BandLu lu(matrix);
    lu.factor(matrix.valuePtr());
    return lu.solved(load);
}

Eigen::VectorXd SplineSpace::prolong(const SplineSpace& other, const Eigen::VectorXd& c) const {
    return project([&](double z) { return other.value(c.data(), other.element_at(z), z); });
}

Eigen::SparseMatrix<double> SplineSpace::prolongation(const SplineSpace& coarse) const {
    const int p = degree();
    std::vector<Eigen::Triplet<double>> entries;
    std::vector<char> done(size_, 0);
    for (int e = 0; e < elements(); ++e) {
        const int from = coarse.element_at((breaks()[e] + breaks()[e + 1]) / 2);
        const double* t = coarse.shared_->active[from].knots;
        for (int a = 0; a <= p; ++a) {
            const int dof = dofs(e)[a];
            if (done[dof]) continue;
            done[dof] = 1;
            // Coefficient a is the blossom of the coarse polynomial of this element at the p inner knots of spline a;
            // de Boor's triangle with one of them a level, for all coarse splines at once.
            double d[max_width][max_width] = {};
            for (int b = 0; b <= p; ++b) d[b][b] = 1;
            for (int level = 1; level <= p; ++level) {
                const double u = shared_->active[e].knots[a + level];
                for (int b = p; b >= level; --b) {
                    const double s = (u - t[b]) / (t[b + p + 1 - level] - t[b]);
                    for (int k = 0; k <= p; ++k) d[b][k] = (1 - s) * d[b - 1][k] + s * d[b][k];
                }
            }
            for (int k = 0; k <= p; ++k)
                if (d[p][k] != 0) entries.emplace_back(dof, coarse.dofs(from)[k], d[p][k]);
        }
    }
    Eigen::SparseMatrix<double> out(size_, coarse.size_);
    out.setFromTriplets(entries.begin(), entries.end());
    return out;
}

SplineSpace::Unfolded SplineSpace::unfold(const Eigen::VectorXd& c, double start) const {
    // Knots around [start, start + period], from the first whole element that reaches into it.
    const double period = cell().period();
    const int m = shared_->multiplicity;
    const auto knot = [&](int index) { return shared_->knot(index); };
    int first = static_cast<int>(std::floor((start - cell().z0) / cell().length())) * elements() * m - m;
    while (knot(first + m) <= start) first += m;  // knot(first .. first + m - 1) <= start < knot(first + m)
    int last = first + m;
    while (knot(last) < start + period) last += m;
    Unfolded out;
    const int from = first + m - 1 - degree(), to = last - 1;  // raw splines that reach into the period
    for (int i = from; i <= to + degree() + 1; ++i) out.knots.push_back(knot(i));
    for (int i = from; i <= to; ++i) out.coefficients.push_back(folded(i).sign * c[folded(i).dof]);
    return out;
}

}  // namespace tubule::axisym
