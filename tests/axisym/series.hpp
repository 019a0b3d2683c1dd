// Truncated power series in dz around a point: derivatives of any order of what is made from r(z), by algebra alone.
#pragma once

#include <array>
#include <cmath>

namespace tubule {

struct Series {
    static constexpr int n = 7;  // terms
    std::array<double, n> c{};

    double value() const { return c[0]; }

    friend Series operator+(Series a, const Series& b) {
        for (int i = 0; i < n; ++i) a.c[i] += b.c[i];
        return a;
    }
    friend Series operator*(const Series& a, const Series& b) {
        Series out;
        for (int i = 0; i < n; ++i)
            for (int j = 0; i + j < n; ++j) out.c[i + j] += a.c[i] * b.c[j];
        return out;
    }
    friend Series operator*(double f, Series a) {
        for (double& x : a.c) x *= f;
        return a;
    }
    friend Series operator-(const Series& a, const Series& b) { return a + (-1.0) * b; }
    friend Series operator+(Series a, double f) {
        a.c[0] += f;
        return a;
    }
    // a^p, from a y' = p a' y
    friend Series power(const Series& a, double p) {
        Series y;
        y.c[0] = std::pow(a.c[0], p);
        for (int k = 1; k < n; ++k) {
            double sum = 0;
            for (int j = 1; j <= k; ++j) sum += (p * j - (k - j)) * a.c[j] * y.c[k - j];
            y.c[k] = sum / (k * a.c[0]);
        }
        return y;
    }
    // The last term of the derivative is lost; no test reaches that far.
    friend Series derivative(const Series& a) {
        Series out;
        for (int i = 0; i + 1 < n; ++i) out.c[i] = (i + 1) * a.c[i + 1];
        return out;
    }
};

// amplitude cos(q (z + dz) + phase)
inline Series cosine(double amplitude, double q, double phase, double z) {
    Series out;
    double factor = amplitude;
    for (int k = 0; k < Series::n; ++k) {
        out.c[k] = factor * std::cos(q * z + phase + k * std::acos(-1.0) / 2);
        factor *= q / (k + 1);
    }
    return out;
}

// The strong forces theory.md (2.10), (2.11), (2.12) on the surface of revolution of r(z):
//   b20 = -2 k20 [Lap H + (H-H0)(|B|^2 - H(H-H0)/2)]
//   b40 = -k40 [12 div((H-H0)^2 grad H) + (H-H0)^3 ((3H+H0)H - 8K)]
//   b42 = -k42 [2 div((HP-B) grad K) + H K^2]
// each for a modulus of 1.
struct StrongForce {
    double b20, b40, b42;
};

inline StrongForce strong_force(const Series& r, double H0) {
    const Series r1 = derivative(r), g2 = r1 * r1 + 1.0, ig = power(g2, -0.5);
    const Series kappa_s = derivative(r1) * ig * ig * ig, kappa_theta = -1.0 * (ig * power(r, -1));
    const Series H = kappa_s + kappa_theta, K = kappa_s * kappa_theta,
                 B2 = kappa_s * kappa_s + kappa_theta * kappa_theta;
    const Series u = H + (-H0), H1 = derivative(H), K1 = derivative(K);
    // div of the tangential field (factor) df/ds t: (1/(r g)) d/dz (r factor f'/g)
    const auto divergence = [&](const Series& factor, const Series& f1) {
        return power(r, -1) * ig * derivative(r * factor * f1 * ig);
    };
    Series one;
    one.c[0] = 1;
    const Series b20 = divergence(one, H1) + u * (B2 - 0.5 * (H * u));
    const Series b40 = 12.0 * divergence(u * u, H1) + u * u * u * ((3.0 * H + H0) * H - 8.0 * K);
    const Series b42 = 2.0 * divergence(kappa_theta, K1) + H * K * K;  // HP - B is kappa_theta along the meridian
    return {-2 * b20.value(), -b40.value(), -b42.value()};
}

}  // namespace tubule
