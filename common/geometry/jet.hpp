// Forward derivatives of first and second order in N variables, on any scalar T (double, or a SIMD
// pack that holds several quadrature points): a law is written once, its derivatives follow.
// Loops are unrolled by hand: gcc 12 leaves jets in memory otherwise, at twice the cost.
#pragma once

#include <array>
#include <cmath>

namespace tubule {

// Index of the (i, j) second derivative, i <= j, in packed storage.
template <int N>
constexpr int packed(int i, int j) {
    return i <= j ? i * N - i * (i - 1) / 2 + (j - i) : packed<N>(j, i);
}

// Value `v`, gradient `d`, and with Order 2 the packed Hessian `dd`.
template <class T, int N, int Order>
struct Jet {
    static constexpr int n_second = Order > 1 ? N*(N + 1) / 2 : 0;
    T v{};
    std::array<T, N> d{};
    std::array<T, n_second> dd{};

    Jet() = default;
    Jet(double constant) : v(constant) {}

    static Jet variable(const T& value, int i) {
        Jet x;
        x.v = value;
        x.d[i] = T(1.0);
        return x;
    }
};

// The number inside, for decisions that no derivative goes through.
inline double scalar_part(double x) {
    return x;
}
template <class T, int N, int Order>
double scalar_part(const Jet<T, N, Order>& x) {
    return scalar_part(x.v);
}

// F(a) given F, F', F'' at a.v.
template <class T, int N, int Order>
Jet<T, N, Order> chain(const Jet<T, N, Order>& a, const T& f, const T& f1, [[maybe_unused]] const T& f2) {
    Jet<T, N, Order> out;
    out.v = f;
#pragma GCC unroll 8
    for (int i = 0; i < N; ++i) out.d[i] = f1 * a.d[i];
    if constexpr (Order > 1) {
#pragma GCC unroll 8
        for (int i = 0; i < N; ++i)
#pragma GCC unroll 8
            for (int j = i; j < N; ++j) {
                const int k = packed<N>(i, j);
                out.dd[k] = f1 * a.dd[k] + f2 * a.d[i] * a.d[j];
            }
    }
    return out;
}

// F(a, b) given F and its partials (fa, fb, faa, fab, fbb) at (a.v, b.v).
template <class T, int N, int Order>
Jet<T, N, Order> chain(const Jet<T, N, Order>& a, const Jet<T, N, Order>& b, const T& f, const T& fa, const T& fb,
                       [[maybe_unused]] const T& faa, [[maybe_unused]] const T& fab, [[maybe_unused]] const T& fbb) {
    Jet<T, N, Order> out;
    out.v = f;
#pragma GCC unroll 8
    for (int i = 0; i < N; ++i) out.d[i] = fa * a.d[i] + fb * b.d[i];
    if constexpr (Order > 1) {
#pragma GCC unroll 8
        for (int i = 0; i < N; ++i)
#pragma GCC unroll 8
            for (int j = i; j < N; ++j) {
                const int k = packed<N>(i, j);
                out.dd[k] = fa * a.dd[k] + fb * b.dd[k] + faa * a.d[i] * a.d[j] +
                            fab * (a.d[i] * b.d[j] + a.d[j] * b.d[i]) + fbb * b.d[i] * b.d[j];
            }
    }
    return out;
}

template <class T, int N, int O>
Jet<T, N, O> operator*(const Jet<T, N, O>& a, const Jet<T, N, O>& b) {
    Jet<T, N, O> out;
    out.v = a.v * b.v;
#pragma GCC unroll 8
    for (int i = 0; i < N; ++i) out.d[i] = a.v * b.d[i] + b.v * a.d[i];
    if constexpr (O > 1) {
#pragma GCC unroll 8
        for (int i = 0; i < N; ++i)
#pragma GCC unroll 8
            for (int j = i; j < N; ++j) {
                const int k = packed<N>(i, j);
                out.dd[k] = a.v * b.dd[k] + b.v * a.dd[k] + (a.d[i] * b.d[j] + a.d[j] * b.d[i]);
            }
    }
    return out;
}

template <class T, int N, int O>
Jet<T, N, O> operator*(double c, Jet<T, N, O> a) {
    a.v = c * a.v;
#pragma GCC unroll 8
    for (auto& x : a.d) x = c * x;
#pragma GCC unroll 8
    for (auto& x : a.dd) x = c * x;
    return a;
}
template <class T, int N, int O>
Jet<T, N, O> operator*(const Jet<T, N, O>& a, double c) {
    return c * a;
}

template <class T, int N, int O>
Jet<T, N, O> operator+(Jet<T, N, O> a, const Jet<T, N, O>& b) {
    a.v = a.v + b.v;
#pragma GCC unroll 8
    for (int i = 0; i < N; ++i) a.d[i] = a.d[i] + b.d[i];
#pragma GCC unroll 8
    for (int k = 0; k < Jet<T, N, O>::n_second; ++k) a.dd[k] = a.dd[k] + b.dd[k];
    return a;
}
template <class T, int N, int O>
Jet<T, N, O> operator-(const Jet<T, N, O>& a, const Jet<T, N, O>& b) {
    return a + (-1.0) * b;
}
template <class T, int N, int O>
Jet<T, N, O> operator+(Jet<T, N, O> a, double c) {
    a.v = a.v + c;
    return a;
}

template <class T, int N, int O>
Jet<T, N, O> operator-(const Jet<T, N, O>& a) {
    return (-1.0) * a;
}
template <class T, int N, int O>
Jet<T, N, O> operator+(double c, const Jet<T, N, O>& a) {
    return a + c;
}
template <class T, int N, int O>
Jet<T, N, O> operator-(const Jet<T, N, O>& a, double c) {
    return a + (-c);
}
template <class T, int N, int O>
Jet<T, N, O> operator-(double c, const Jet<T, N, O>& a) {
    return (-1.0) * a + c;
}
template <class T, int N, int O>
Jet<T, N, O>& operator+=(Jet<T, N, O>& a, const Jet<T, N, O>& b) {
    return a = a + b;
}

template <class T, int N, int O>
Jet<T, N, O> inverse(const Jet<T, N, O>& a) {
    const T f = 1.0 / a.v, f1 = -f * f;
    return chain(a, f, f1, T(-2.0 * f * f1));
}
template <class T>
T inverse(const T& a) {
    return 1.0 / a;
}

// a^(-1/2)
template <class T, int N, int O>
Jet<T, N, O> inverse_sqrt(const Jet<T, N, O>& a) {
    using std::sqrt;
    const T inv = 1.0 / a.v, f = sqrt(inv), f1 = -0.5 * f * inv;
    return chain(a, f, f1, T(-1.5 * f1 * inv));
}
template <class T>
T inverse_sqrt(const T& a) {
    using std::sqrt;
    return 1.0 / sqrt(a);
}

template <class T, int N, int O>
Jet<T, N, O> operator/(double c, const Jet<T, N, O>& a) {
    return c * inverse(a);
}
template <class T, int N, int O>
Jet<T, N, O> operator/(const Jet<T, N, O>& a, const Jet<T, N, O>& b) {
    return a * inverse(b);
}

template <class T, int N, int O>
Jet<T, N, O> sqrt(const Jet<T, N, O>& a) {
    using std::sqrt;
    const T f = sqrt(a.v), f1 = 0.5 / f;
    return chain(a, f, f1, T(-0.5 * f1 / a.v));
}
template <class T, int N, int O>
Jet<T, N, O> sin(const Jet<T, N, O>& a) {
    using std::cos, std::sin;
    const T f = sin(a.v);
    return chain(a, f, T(cos(a.v)), T(-f));
}
template <class T, int N, int O>
Jet<T, N, O> cos(const Jet<T, N, O>& a) {
    using std::cos, std::sin;
    const T f = cos(a.v);
    return chain(a, f, T(-sin(a.v)), T(-f));
}
template <class T, int N, int O>
Jet<T, N, O> atan2(const Jet<T, N, O>& y, const Jet<T, N, O>& x) {
    using std::atan2;
    const T q = inverse(T(x.v * x.v + y.v * y.v)), fy = x.v * q, fx = -(y.v * q);
    return chain(y, x, T(atan2(y.v, x.v)), fy, fx, T(2.0 * fx * fy), T(fx * fx - fy * fy), T(-2.0 * fx * fy));
}

}  // namespace tubule
