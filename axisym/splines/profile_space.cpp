#include "axisym/splines/profile_space.hpp"

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

ProfileSpace::ProfileSpace(Cell cell, std::vector<double> breaks, int degree, int smoothness)
    : cell_(cell),
      breaks_(std::move(breaks)),
      degree_(degree),
      smoothness_(smoothness),
      multiplicity_(degree - smoothness) {
    if (degree < 2 || degree >= max_width) throw std::invalid_argument("spline degree must be 2 ... 7");
    if (smoothness < 1 || smoothness >= degree) throw std::invalid_argument("smoothness must be 1 ... degree - 1");
    if (breaks_.size() < 3 || !std::is_sorted(breaks_.begin(), breaks_.end(), std::less_equal<>{}))
        throw std::invalid_argument("breaks must increase and define at least two elements");
    tabulate();
}

double ProfileSpace::bernoulli_norm() const {
    return degree_ == 3 ? 1.0 / 720 : degree_ == 5 ? 1.0 / 1209600 : 691.0 / 2730 / 479001600;
}

double ProfileSpace::knot(int index) const {
    const int n = elements(), j = floor_div(index, multiplicity_), L = cell_.mirror ? 2 * n : n;
    const int turn = floor_div(j, L), k = j - turn * L;
    const double base = (cell_.mirror && k > n) ? 2 * breaks_[n] - breaks_[2 * n - k] : breaks_[k];
    return base + turn * (cell_.mirror ? 2 : 1) * cell_.length();
}

int ProfileSpace::first_raw(int element) const {
    return element * multiplicity_ + multiplicity_ - 1 - degree_;
}

// Raw spline i has the knots i ... i + degree + 1. Translation by a period and reflection at the two
// ends of a mirrored cell map raw splines to raw splines that carry the same coefficient.
int ProfileSpace::dof_of(int raw) const {
    const int m = multiplicity_, n = elements();
    if (!cell_.mirror) return raw - floor_div(raw, n * m) * n * m;
    const int low = m - 2 - degree_, high = low + 2 * n * m;  // i <-> low - i at z0, i <-> high - i at z1
    const int period = high - low;
    int i = raw - floor_div(raw - low / 2, period) * period;
    for (bool again = true; again;) {
        again = false;
        if (2 * i < low) i = low - i, again = true;
        if (2 * i > high) i = high - i, again = true;
    }
    return i - floor_div(low + 1, 2);
}

ProfileSpace::Active::Active(const ProfileSpace& space, int element) : p(space.degree_) {
    const int base = space.first_raw(element);
    for (int i = 0; i <= 2 * p + 1; ++i) knots[i] = space.knot(base + i);
    for (int d = 1; d <= p; ++d)
        for (int i = 0; i + d <= 2 * p + 1; ++i) {
            const double span = knots[i + d] - knots[i];
            inverse_span[d][i] = span > 0 ? 1 / span : 0;
        }
    for (int a = 0; a <= p; ++a) {
        double c[max_width] = {};
        c[a] = 1;
        for (int k = 0; k <= p; ++k) {
            if (k <= 2) std::copy_n(c, max_width, combo[k][a]);
            if (k == p) top[a] = c[p];
            const int d = p - k;
            if (d > 0)
                for (int b = p; b >= 0; --b) c[b] = d * (c[b] - (b > 0 ? c[b - 1] : 0)) * inverse_span[d][b];
        }
    }
}

// T is a number, or a pack of points.
template <class T>
void ProfileSpace::Active::operator()(const T& z, int derivatives, T* out) const {
    T low[3][max_width];  // values of the splines of degree p - k, k = 0, 1, 2
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

void ProfileSpace::tabulate() {
    const int n = elements(), w = width();
    const GaussRule rule = gauss_rule(lanes * groups());
    require_memory(static_cast<double>(n) * (sizeof(Active) + groups() * sizeof(Basis)),
                   fmt::format("a profile of {} elements", n));
    basis_.assign(n * groups(), Basis{});
    dofs_.resize(n * w);
    active_.reserve(n);
    Pack values[3 * max_width];
    for (int e = 0; e < n; ++e) {
        if (e % 1024 == 0) check_pause();
        const Active& active = active_.emplace_back(*this, e);
        const double h = breaks_[e + 1] - breaks_[e];
        for (int a = 0; a < w; ++a) {
            dofs_[e * w + a] = dof_of(first_raw(e) + a);
            size_ = std::max(size_, dofs_[e * w + a] + 1);
        }
        for (int g = 0; g < groups(); ++g) {
            Basis& b = basis_[e * groups() + g];
            for (int q = 0; q < lanes; ++q) {
                b.weight[q] = h * rule.weights[g * lanes + q];
                b.z[q] = breaks_[e] + h * rule.nodes[g * lanes + q];
            }
            active(Pack([&](int q) { return b.z[q]; }), 2, values);
            for (int d = 0; d < 3; ++d)
                for (int a = 0; a < w; ++a)
                    for (int q = 0; q < lanes; ++q) b.by_point[d][a][q] = b.by_spline[q][d][a] = values[d * w + a][q];
        }
    }
}

int ProfileSpace::element_at(double z) const {
    const auto it = std::upper_bound(breaks_.begin() + 1, breaks_.end() - 1, z);
    return static_cast<int>(it - breaks_.begin()) - 1;
}

void ProfileSpace::splines(int element, double z, int derivatives, double* out) const {
    active_[element](z, derivatives, out);
}

std::array<double, 3> ProfileSpace::evaluate(const double* c, int element, double z) const {
    double values[3 * max_width];
    active_[element](z, 2, values);
    std::array<double, 3> out{};
    for (int d = 0; d < 3; ++d)
        for (int a = 0; a < width(); ++a) out[d] += values[d * width() + a] * c[dofs(element)[a]];
    return out;
}

double ProfileSpace::value(const double* c, int element, double z) const {
    double values[max_width], sum = 0;
    active_[element](z, 0, values);
    for (int a = 0; a < width(); ++a) sum += values[a] * c[dofs(element)[a]];
    return sum;
}

double ProfileSpace::extremum_near(const double* c, double z) const {
    for (int iteration = 0; iteration < 4; ++iteration) {
        const int e = element_at(z);
        const auto [r, r1, r2] = evaluate(c, e, z);
        const double reach = breaks_[e + 1] - breaks_[e], before = z;
        if (r2 != 0) z = std::clamp(z - std::clamp(r1 / r2, -reach, reach), cell_.z0, cell_.z1);
        if (std::abs(z - before) < 0.02 * reach)
            break;  // the next step would be smaller than 1e-3, r exact to 1e-6 of it
    }
    return z;
}

double ProfileSpace::top_derivative(const double* c, int element) const {
    double sum = 0;
    for (int a = 0; a < width(); ++a) sum += active_[element].top[a] * c[dofs(element)[a]];
    return sum;
}

Eigen::VectorXd ProfileSpace::solve_mass(const Eigen::VectorXd& load) const {
    std::vector<Eigen::Triplet<double>> entries;
    entries.reserve(elements() * width() * width());
    for (int e = 0; e < elements(); ++e)
        for (int a = 0; a < width(); ++a)
            for (int b = 0; b < width(); ++b) {
                double sum = 0;
                for (int g = 0; g < groups(); ++g)
                    for (int q = 0; q < lanes; ++q)
                        sum += basis(e, g).weight[q] * basis(e, g).by_spline[q][0][a] * basis(e, g).by_spline[q][0][b];
                entries.emplace_back(dofs(e)[a], dofs(e)[b], sum);
            }
    Eigen::SparseMatrix<double> mass(size_, size_);
    mass.setFromTriplets(entries.begin(), entries.end());
    BandLu lu(mass);
    lu.factor(mass.valuePtr());
    return lu.solved(load);
}

Eigen::VectorXd ProfileSpace::prolong(const ProfileSpace& other, const Eigen::VectorXd& c) const {
    return project([&](double z) { return other.value(c.data(), other.element_at(z), z); });
}

Eigen::SparseMatrix<double> ProfileSpace::prolongation(const ProfileSpace& coarse) const {
    const int p = degree_;
    std::vector<Eigen::Triplet<double>> entries;
    std::vector<char> done(size_, 0);
    for (int e = 0; e < elements(); ++e) {
        const int from = coarse.element_at((breaks_[e] + breaks_[e + 1]) / 2);
        const double* t = coarse.active_[from].knots;
        for (int a = 0; a <= p; ++a) {
            const int dof = dofs(e)[a];
            if (done[dof]) continue;
            done[dof] = 1;
            // Coefficient a is the blossom of the coarse polynomial of this element at the p inner knots of spline a;
            // de Boor's triangle with one of them a level, for all coarse splines at once.
            double d[max_width][max_width] = {};
            for (int b = 0; b <= p; ++b) d[b][b] = 1;
            for (int level = 1; level <= p; ++level) {
                const double u = active_[e].knots[a + level];
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

ProfileSpace::Unfolded ProfileSpace::unfold(const Eigen::VectorXd& c, double start) const {
    // Knots around [start, start + period], from the first whole element that reaches into it.
    const double period = cell_.period();
    const int m = multiplicity_;
    int first = static_cast<int>(std::floor((start - cell_.z0) / cell_.length())) * elements() * m - m;
    while (knot(first + m) <= start) first += m;  // knot(first .. first + m - 1) <= start < knot(first + m)
    int last = first + m;
    while (knot(last) < start + period) last += m;
    Unfolded out;
    const int from = first + m - 1 - degree_, to = last - 1;  // raw splines that reach into the period
    for (int i = from; i <= to + degree_ + 1; ++i) out.knots.push_back(knot(i));
    for (int i = from; i <= to; ++i) out.coefficients.push_back(c[dof_of(i)]);
    return out;
}

}  // namespace tubule::axisym
