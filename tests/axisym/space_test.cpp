// The spline space: a basis, exactly evaluated, nested, of full order, and the same with and without symmetry.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "axisym/graph/graph_forms.hpp"
#include "axisym/graph/graph_mesh.hpp"
#include "axisym/splines/breaks.hpp"
#include "axisym/splines/spline_space.hpp"
#include "common/geometry/profile_point.hpp"
#include "tests/axisym/runs.hpp"
#include "tests/support/message_of.hpp"
#include "tests/support/random_vector.hpp"

namespace tubule::axisym::space_test {

using Vector = Eigen::VectorXd;

struct Kind {
    int degree, smoothness;
};
constexpr Kind kinds[] = {{3, 1}, {3, 2}, {5, 1}, {5, 2}, {5, 4}, {7, 3}, {7, 6}};  // (3, 1) and (5, 2): Hermite

std::string text(const Kind& k) {
    return "degree " + std::to_string(k.degree) + ", smoothness " + std::to_string(k.smoothness);
}

// Breaks with sizes that vary by a factor of 5.
std::vector<double> uneven(const Cell& cell, int n, unsigned seed = 1) {
    std::mt19937 engine(seed);
    std::uniform_real_distribution<double> size(1, 5);
    std::vector<double> breaks{0};
    for (int i = 0; i < n; ++i) breaks.push_back(breaks.back() + size(engine));
    const double scale = cell.length() / breaks.back();
    for (double& b : breaks) b = cell.z0 + scale * b;
    breaks.back() = cell.z1;
    return breaks;
}

Vector rough(int n, unsigned seed = 2) {
    return test::uniform_vector(n, 0.5, 1.5, seed);
}

const Cell periodic{-0.3, 1.7, false, 1}, mirrored{-0.3, 0.7, true, 1};

TEST(SplineSpace, refusesWhatIsNoSpace) {
    const auto message = [](std::vector<double> breaks, int degree, int smoothness) -> std::string {
        return test::message_of<std::invalid_argument>([&] {
            SplineSpace(Cell{0, 1, false, 1}, std::move(breaks), degree, smoothness);
        });
    };
    const std::vector<double> good{0, 0.5, 1};
    EXPECT_EQ(message(good, 5, 4), "accepted");
    for (int degree : {0, 1, 8, 9}) EXPECT_EQ(message(good, degree, 1), "spline degree must be 2 ... 7") << degree;
    for (int smoothness : {-1, 0, 5})
        EXPECT_EQ(message(good, 5, smoothness), "smoothness must be 1 ... degree - 1") << smoothness;
    for (const auto& breaks : {std::vector<double>{}, {0, 1}, {0, 0.5, 0.5, 1}, {0, 0.7, 0.5, 1}})
        EXPECT_EQ(message(breaks, 5, 4), "breaks must increase and define at least two elements") << breaks.size();
}

TEST(SplineSpace, hasTheDimensionOfItsPiecewisePolynomials) {
    // Theorem: n elements of degree p with C^s at the knots have n (p - s) periodic splines; the even ones about both
    // ends of a mirrored cell are half of those of the doubled cell, plus one half for each end where a spline of
    // odd degree is symmetric about the knot itself ((p - s) odd).
    for (const Kind& k : kinds) {
        const int n = 6, m = k.degree - k.smoothness;
        const SplineSpace whole(periodic, uneven(periodic, n), k.degree, k.smoothness);
        EXPECT_EQ(whole.size(), n * m) << text(k);
        const SplineSpace half(mirrored, uneven(mirrored, n), k.degree, k.smoothness);
        EXPECT_EQ(half.size(), m % 2 == 1 ? n * m + 1 : n * m + (k.smoothness % 2 == 0 ? 1 : 0)) << text(k);
    }
}

TEST(SplineSpace, basisSumsToOneAndDerivativesToZero) {
    for (const Kind& k : kinds)
        for (const Cell& cell : {periodic, mirrored}) {
            const SplineSpace space(cell, uneven(cell, 7), k.degree, k.smoothness);
            const Vector one = Vector::Ones(space.size());
            for (int e = 0; e < space.elements(); ++e) {
                const double h = space.breaks()[e + 1] - space.breaks()[e];
                for (double s : {0.0, 0.3, 0.9, 1.0}) {
                    const auto [r, r1, r2] = space.evaluate(one.data(), e, space.breaks()[e] + s * h);
                    EXPECT_NEAR(r, 1, 1e-14) << text(k);
                    EXPECT_NEAR(r1 * h, 0, 1e-12) << text(k);
                    EXPECT_NEAR(r2 * h * h, 0, 1e-11) << text(k);
                }
                EXPECT_NEAR(space.top_derivative(one.data(), e) * std::pow(h, k.degree), 0, 1e-7) << text(k);
            }
        }
}

TEST(SplineSpace, derivativesAreThoseOfTheValue) {
    // Taylor's theorem, exact for polynomials: the value of a spline within an element is interpolated at degree + 1
    // points; the derivatives of the interpolant (divided differences in long double) are those expected.
    for (const Kind& k : kinds) {
        const SplineSpace space(periodic, uneven(periodic, 5), k.degree, k.smoothness);
        const Vector x = rough(space.size());
        for (int e = 0; e < space.elements(); ++e) {
            const double a = space.breaks()[e], h = space.breaks()[e + 1] - a;
            const int n = k.degree + 1;
            std::vector<long double> node(n), c(n);
            for (int i = 0; i < n; ++i) {
                node[i] = (1 - std::cos(pi * (i + 0.5) / n)) / 2;
                c[i] = space.value(x.data(), e, static_cast<double>(a + h * node[i]));
            }
            for (int level = 1; level < n; ++level)
                for (int i = n - 1; i >= level; --i) c[i] = (c[i] - c[i - 1]) / (node[i] - node[i - level]);
            const auto [r, r1, r2] = space.evaluate(x.data(), e, a + 0.37 * h);
            long double v = 0, v1 = 0, v2 = 0;  // Horner with derivatives
            for (int i = n - 1; i >= 0; --i) {
                const long double s = 0.37L - node[i];
                v2 = v2 * s + 2 * v1, v1 = v1 * s + v, v = v * s + c[i];
            }
            EXPECT_NEAR(r, static_cast<double>(v), 1e-13) << text(k);
            EXPECT_NEAR(r1 * h, static_cast<double>(v1), 1e-11) << text(k);
            EXPECT_NEAR(r2 * h * h, static_cast<double>(v2), 1e-10) << text(k);
            double factorial = 1;
            for (int i = 2; i <= k.degree; ++i) factorial *= i;
            const double top = factorial * static_cast<double>(c[n - 1]);
            EXPECT_NEAR(space.top_derivative(x.data(), e) * std::pow(h, k.degree), top, 1e-8 * factorial) << text(k);
        }
    }
}

TEST(SplineSpace, tabulatedBasisIsTheEvaluatedOne) {
    // Expected: evaluate(), from other code, at the Gauss points; the weights integrate 1 to the length of the cell.
    for (const Kind& k : kinds) {
        const SplineSpace space(mirrored, uneven(mirrored, 4), k.degree, k.smoothness);
        const Vector x = rough(space.size());
        double length = 0;
        for (int e = 0; e < space.elements(); ++e)
            for (int g = 0; g < space.groups(); ++g) {
                const auto& b = space.basis(e, g);
                for (int q = 0; q < SplineSpace::lanes; ++q) {
                    length += b.weight[q];
                    const auto expected = space.evaluate(x.data(), e, b.z[q]);
                    for (int d = 0; d < 3; ++d) {
                        double sum = 0;
                        for (int a = 0; a < space.width(); ++a) {
                            sum += x[space.dofs(e)[a]] * b.by_spline[q][d][a];
                            EXPECT_EQ(b.by_spline[q][d][a], b.by_point[d][a][q]);
                        }
                        EXPECT_NEAR(sum, expected[d], 1e-11 * std::max(1.0, std::abs(expected[d]))) << text(k);
                    }
                }
            }
        EXPECT_NEAR(length, 1, 1e-14);
    }
}

TEST(SplineSpace, isAsSmoothAsItSaysAndNoSmoother) {
    // From the two sides of a knot: value and slope always agree, the second derivative if smoothness >= 2.
    for (const Kind& k : kinds)
        for (const Cell& cell : {periodic, mirrored}) {
            const SplineSpace space(cell, uneven(cell, 5), k.degree, k.smoothness);
            const Vector x = rough(space.size());
            double jump[3] = {0, 0, 0};
            for (int e = 0; e < space.elements(); ++e) {
                const int next = (e + 1) % space.elements();
                if (next == 0 && cell.mirror) continue;
                const auto left = space.evaluate(x.data(), e, space.breaks()[e + 1]);
                const auto right = space.evaluate(x.data(), next, space.breaks()[next]);
                for (int d = 0; d < 3; ++d) jump[d] = std::max(jump[d], std::abs(left[d] - right[d]));
            }
            EXPECT_LT(jump[0], 1e-13) << text(k);
            EXPECT_LT(jump[1], 1e-10) << text(k);
            if (k.smoothness >= 2)
                EXPECT_LT(jump[2], 1e-8) << text(k);
            else
                EXPECT_GT(jump[2], 1) << text(k);
            if (cell.mirror) {  // even about both ends
                EXPECT_NEAR(space.evaluate(x.data(), 0, cell.z0)[1], 0, 1e-11) << text(k);
                EXPECT_NEAR(space.evaluate(x.data(), space.elements() - 1, cell.z1)[1], 0, 1e-11) << text(k);
            }
        }
}

// Largest difference of two splines on a fine grid.
double distance(const SplineSpace& a, const Vector& x, const SplineSpace& b, const Vector& y) {
    double largest = 0;
    for (int i = 0; i <= 997; ++i) {
        const double z = a.cell().z0 + a.cell().length() * i / 997;
        largest =
            std::max(largest, std::abs(a.value(x.data(), a.element_at(z), z) - b.value(y.data(), b.element_at(z), z)));
    }
    return largest;
}

std::vector<double> halved(const std::vector<double>& breaks) {
    std::vector<double> out;
    for (std::size_t i = 0; i + 1 < breaks.size(); ++i) {
        out.push_back(breaks[i]);
        out.push_back(0.4 * breaks[i] + 0.6 * breaks[i + 1]);
    }
    out.push_back(breaks.back());
    return out;
}

TEST(SplineSpace, nestedSpacesHoldEachOther) {
    // Theorem: inserting knots keeps the spline. Projection, prolongation and its matrix all reproduce it.
    for (const Kind& k : kinds)
        for (const Cell& cell : {periodic, mirrored}) {
            const SplineSpace coarse(cell, uneven(cell, 5), k.degree, k.smoothness);
            const SplineSpace fine(cell, halved(coarse.breaks()), k.degree, k.smoothness);
            const Vector x = rough(coarse.size());
            const Vector again =
                coarse.project([&](double z) { return coarse.value(x.data(), coarse.element_at(z), z); });
            EXPECT_LT((again - x).norm(), 1e-10) << text(k);
            EXPECT_LT(distance(coarse, x, fine, fine.prolong(coarse, x)), 1e-11) << text(k);
            EXPECT_LT(distance(coarse, x, fine, fine.prolongation(coarse) * x), 1e-12) << text(k);
        }
}

TEST(SplineSpace, hermiteSpacesHoldWhatIsLocal) {
    // With smoothness s = (p - 1)/2 a spline of degree p is free to vanish outside of the two elements at a knot
    // and to be 1 there: the Hermite interpolant, in closed form.
    for (const Kind& k : {Kind{3, 1}, Kind{5, 2}, Kind{7, 3}}) {
        const SplineSpace space(periodic, uneven(periodic, 6), k.degree, k.smoothness);
        const double a = space.breaks()[2], b = space.breaks()[4], knot = space.breaks()[3];
        const auto local = [&](double z) {  // step of degree 2s + 1 = p, flat to order s at both ends
            const int s = k.smoothness;
            if (z <= a || z >= b) return 0.0;
            const double u = z < knot ? (z - a) / (knot - a) : (b - z) / (b - knot);
            double sum = 0, c = 1;
            for (int i = 0; i <= s; ++i) {
                sum += c * std::pow(1 - u, i);
                c *= double(s + 1 + i) / (i + 1);
            }
            return std::pow(u, s + 1) * sum;
        };
        const Vector x = space.project(local);
        double error = 0;
        for (int i = 0; i <= 500; ++i) {
            const double z = periodic.z0 + periodic.length() * i / 500;
            error = std::max(error, std::abs(space.value(x.data(), space.element_at(z), z) - local(z)));
        }
        EXPECT_LT(error, 1e-12) << text(k);
        EXPECT_NEAR(space.value(x.data(), 3, knot), 1, 1e-12) << text(k);
    }
}

TEST(SplineSpace, approximatesWithFullOrder) {
    // Theorem: the error of the best spline of degree p falls like h^(p+1) for smooth functions.
    const auto f = [](double z) { return 1 + 0.3 * std::sin(pi * z) + 0.1 * std::cos(2 * pi * z + 0.4); };
    for (const Kind& k : kinds) {
        double error[2];
        const int n[2] = {10, 20};
        for (int i = 0; i < 2; ++i) {
            const SplineSpace space(periodic, equal_breaks(n[i], periodic), k.degree, k.smoothness);
            const Vector x = space.project(f);
            double sum = 0;
            for (int j = 0; j < 1000; ++j) {
                const double z = periodic.z0 + periodic.length() * (j + 0.5) / 1000;
                sum += std::pow(space.value(x.data(), space.element_at(z), z) - f(z), 2);
            }
            error[i] = std::sqrt(sum / 1000);
        }
        EXPECT_GT(std::log2(error[0] / error[1]), k.degree + 0.5) << text(k) << ", error " << error[1];
    }
}

// The spline of knots and coefficients in the usual convention, by the Cox-de Boor recurrence.
double cox_de_boor(const std::vector<double>& t, const std::vector<double>& c, int p, double z) {
    std::size_t span = p;
    while (span + 1 < c.size() && z >= t[span + 1]) ++span;
    const std::function<double(std::size_t, int)> basis = [&](std::size_t i, int q) -> double {
        if (q == 0) return i == span ? 1 : 0;
        const double left = t[i + q] - t[i], right = t[i + q + 1] - t[i + 1];
        return (left > 0 ? (z - t[i]) / left * basis(i, q - 1) : 0) +
               (right > 0 ? (t[i + q + 1] - z) / right * basis(i + 1, q - 1) : 0);
    };
    double sum = 0;
    for (std::size_t i = span - p; i <= span; ++i) sum += c[i] * basis(i, p);
    return sum;
}

TEST(SplineSpace, unfoldsToTheWholePeriod) {
    // Expected: value() at the image of z in the cell; the unfolded spline is evaluated by the textbook recurrence.
    for (const Kind& k : kinds)
        for (const Cell& cell : {periodic, mirrored, Cell{0.2, 0.7, false, 3}, Cell{0.2, 0.5, true, 2}}) {
            const SplineSpace space(cell, uneven(cell, 5), k.degree, k.smoothness);
            const Vector x = rough(space.size());
            for (double start : {0.0, -0.3, 0.45}) {
                const auto [knots, coefficients] = space.unfold(x, start);
                ASSERT_EQ(knots.size(), coefficients.size() + k.degree + 1);
                EXPECT_LE(knots[k.degree], start);
                EXPECT_GE(knots[coefficients.size()], start + cell.period() - 1e-12);
                for (int i = 0; i <= 60; ++i) {
                    const double z = start + cell.period() * i / 60.0;
                    const double turn = cell.length() * (cell.mirror ? 2 : 1);
                    double inside = std::fmod(z - cell.z0 + 10 * turn, turn);
                    if (inside > cell.length()) inside = 2 * cell.length() - inside;
                    inside = std::clamp(cell.z0 + inside, cell.z0, cell.z1);
                    EXPECT_NEAR(cox_de_boor(knots, coefficients, k.degree, z),
                                space.value(x.data(), space.element_at(inside), inside), 1e-11)
                        << text(k) << " at " << z;
                }
            }
        }
}

TEST(SplineSpace, findsExtremaWhereTheyAre) {
    // Expected: the minimum of 1 - 0.5 cos(2 pi (z - 0.5)) at z = 0.5, found from a distance.
    const Cell cell{0, 1, false, 1};
    const SplineSpace space(cell, uneven(cell, 12), 7, 6);
    const Vector x = space.project([](double z) { return 1 - 0.5 * std::cos(2 * pi * (z - 0.5)); });
    EXPECT_NEAR(space.extremum_near(x.data(), 0.47), 0.5, 1e-6);
}

TEST(GaussRule, integratesPolynomialsOfDegree2nMinus1) {
    // Theorem; INT_0^1 z^k dz = 1/(k+1). Degree 2n is integrated wrongly.
    for (int n : {4, 8}) {
        const GaussRule rule = gauss_rule(n);
        for (int k = 0; k <= 2 * n; ++k) {
            double sum = 0;
            for (int i = 0; i < n; ++i) sum += rule.weights[i] * std::pow(rule.nodes[i], k);
            if (k < 2 * n)
                EXPECT_NEAR(sum, 1.0 / (k + 1), 1e-15) << n << " " << k;
            else
                EXPECT_GT(std::abs(sum - 1.0 / (k + 1)), 1e-12) << n;
        }
    }
}

TEST(Symmetry, mirrorCellIsThePeriodicOne) {
    // A mirrored cell is half of the doubled mesh: same energy, and forces summed over each spline and its image.
    const Bending material = bending(0.2, -2, 0.01, 0.06);
    for (const Kind& k : kinds) {
        const Cell half{0, 1, true, 1}, whole{0, 2, false, 1};
        const auto breaks = uneven(half, 6);
        auto all = breaks;
        for (int i = 5; i >= 0; --i) all.push_back(2 - breaks[i]);
        const SplineSpace a(half, breaks, k.degree, k.smoothness), b(whole, all, k.degree, k.smoothness);
        const auto profile = [](double z) { return 1 + 0.4 * std::cos(pi * z) - 0.1 * std::cos(2 * pi * z); };
        const auto direction = [](double z) { return 0.3 - std::cos(pi * z) + 0.2 * std::cos(3 * pi * z); };
        const Vector x = a.project(profile), y = b.project(profile), v = a.project(direction), w = b.project(direction);
        const Forms fa(a, material), fb(b, material);
        const double scale = fb.free_energy(y);
        EXPECT_NEAR(fa.free_energy(x), scale, 1e-12 * scale) << text(k);
        EXPECT_NEAR(fa.gradient(x).dot(v), fb.gradient(y).dot(w), 1e-10 * scale) << text(k);
        EXPECT_NEAR(v.dot(fa.hessian(x) * v), w.dot(fb.hessian(y) * w), 1e-9 * scale) << text(k);
        EXPECT_NEAR(v.dot(fa.mass(x) * v), w.dot(fb.mass(y) * w), 1e-12 * w.dot(fb.mass(y) * w)) << text(k);
        const Observation oa = fa.observe(x.data(), v.data()), ob = fb.observe(y.data(), w.data());
        EXPECT_NEAR(oa.area, ob.area, 1e-12 * ob.area);
        EXPECT_NEAR(oa.volume, ob.volume, 1e-12 * ob.volume);
        EXPECT_NEAR(oa.dissipation, ob.dissipation, 1e-12 * ob.dissipation);
        for (int n : {0, 1, 2}) {
            const auto ma = fa.mode(n), mb = fb.mode(n);
            EXPECT_NEAR(ma[0].dot(x), mb[0].dot(y), 1e-13) << n;
            EXPECT_NEAR(ma[1].dot(x), mb[1].dot(y), 1e-13) << n;
        }
    }
}

TEST(Symmetry, cellIsTheSmallestThatDeterminesTheTube) {
    // By hand: common waves divide the period; modes even about a common plane halve it.
    const auto cell = [](std::vector<TubeMode> modes, bool symmetry = true) {
        return cell_of(Tube{.radius = 1, .length = 2, .modes = std::move(modes)}, symmetry);
    };
    EXPECT_EQ(cell({}).images(), 2);
    EXPECT_EQ(cell({{0.1, 1, 0, 0.3}}).images(), 2);                    // one mode has its own plane
    EXPECT_EQ(cell({{0.1, 4, 0, 0.3}}).images(), 8);                    // four waves
    EXPECT_EQ(cell({{0.1, 4, 0, 0}, {0.1, 6, 0, 0}}).images(), 4);      // gcd 2, even about 0
    EXPECT_EQ(cell({{0.1, 1, 0, 0}, {0.1, 2, 0, 0.5}}).images(), 1);    // no common plane
    EXPECT_EQ(cell({{0.1, 2, 0, 0}, {0.1, 4, 0, 0.5}}).images(), 2);    // nor here, but two waves
    EXPECT_EQ(cell({{0.1, 1, 0, 0.4}, {0.1, 2, 0, 0.8}}).images(), 2);  // one shifted by the other
    EXPECT_EQ(cell({{0.1, 1, 0, 0}}, false).images(), 1);               // as asked
    EXPECT_EQ(cell({{0.1, 1, 0, 0}, {0, 2, 0, 0.5}}).images(), 2);      // a mode that is not there
    EXPECT_DOUBLE_EQ(cell({{0.1, 4, 0, 0.3}}).period(), 2);
}

}  // namespace tubule::axisym::space_test
