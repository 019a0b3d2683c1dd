#include "surface3d/meshing/graded_mesh.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "common/geometry/profile_point.hpp"
#include "common/solve/parallel.hpp"
#include "common/solve/pause.hpp"
#include "common/solve/sparse.hpp"
#include "surface3d/curvature/polynomial_graph.hpp"
#include "surface3d/fem/surface_space.hpp"

namespace tubule::surface3d {
namespace {

constexpr int samples = 240, meridians = 8;
constexpr double most_rows = 1e5;
constexpr double growth = 1.0 / 3;

// A point of the profile's surface and its tangents in t and in the angle.
struct Place {
    Eigen::Vector3d x, along, around;
};
Place place(const Curve& profile, double t, double theta) {
    if (profile.length == 0) {
        if (t < 0 || t > 1) t = t < 0 ? -t : 2 - t, theta += pi;  // over the pole and down on the other side
        t = std::clamp(t, 1e-6, 1 - 1e-6);                        // the angle has no direction at a pole
    }
    const double turns = profile.length > 0 ? std::floor(t) : 0;
    const auto [r, r1, z, z1] = profile.at(t - turns);
    const Eigen::Vector3d radial(std::cos(theta), std::sin(theta), 0), tangent(-std::sin(theta), std::cos(theta), 0);
    const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
    return {r * radial + (z + turns * profile.length) * up, r1 * radial + z1 * up, r * tangent};
}

// How far the shape operator on a curve is from the polynomials of a degree, root mean square.
class CurveDefect {
public:
    explicit CurveDefect(int degree) : B_(3 * (degree + 1), 6), remainder_(B_.rows(), B_.rows()) {
        Eigen::MatrixXd V(B_.rows(), degree + 1);
        for (int j = 0; j <= degree; ++j) V.col(j) = Eigen::ArrayXd::LinSpaced(B_.rows(), -1, 1).pow(j);
        const Eigen::MatrixXd Q =
            Eigen::HouseholderQR<Eigen::MatrixXd>(V).householderQ() * Eigen::MatrixXd::Identity(V.rows(), V.cols());
        remainder_ = Eigen::MatrixXd::Identity(B_.rows(), B_.rows()) - Q * Q.transpose();
    }

    // at(x): the point at -1/2 <= x <= 1/2.
    template <class At>
    double operator()(At&& at) {
        const auto last = static_cast<double>(B_.rows() - 1);
        for (Eigen::Index j = 0; j < B_.rows(); ++j)
            B_.row(j) = packed_tensor(at(static_cast<double>(j) / last - 0.5).B);
        return (remainder_ * B_).norm() / std::sqrt(last + 1);
    }

private:
    Eigen::Matrix<double, Eigen::Dynamic, 6> B_;
    Eigen::MatrixXd remainder_;
};

// Error of the curvatures that PatchRecovery would find, at a vertex amid six equilateral triangles with exact nodes.
class PatchDefect {
public:
    explicit PatchDefect(int order)
        : fit_(2 * order, 3 * order * (order + 1) + 1), nodes_(3, 3 * order * (order + 1) + 1) {
        for (int i = -order; i <= order; ++i)
            for (int j = std::max(-order, -order - i); j <= std::min(order, order - i); ++j)
                lattice_.push_back(Eigen::Vector2d(i, j) / order);
    }

    // at(x, y): the point x and y edges away from the vertex, in two directions across each other.
    template <class At>
    double operator()(At&& at) {
        const SurfacePoint<double> vertex = at(0.0, 0.0);
        exact_.clear();
        for (std::size_t i = 0; i < lattice_.size(); ++i) {
            exact_.push_back(at(lattice_[i][0] + lattice_[i][1] / 2, lattice_[i][1] * std::sqrt(0.75)));
            nodes_.col(static_cast<Eigen::Index>(i)) = exact_.back().x;
        }
        const PolynomialGraph graph = fit_(vertex.x, vertex.normal, nodes_);
        double sum = 0, total = 0;
        for (std::size_t i = 0; i < lattice_.size(); ++i) {
            // The share of this vertex in the recovery: 1 there, 0 where its triangles end.
            const double u = lattice_[i][0], v = lattice_[i][1];
            const double weight = 1 - std::max({std::abs(u), std::abs(v), std::abs(u + v)});
            if (weight <= 0) continue;
            sum += weight * weight * (graph.at(exact_[i].x).B - exact_[i].B).squaredNorm();
            total += weight * weight;
        }
        return std::sqrt(sum / total);
    }

private:
    GraphFit fit_;
    Eigen::Matrix3Xd nodes_;
    std::vector<Eigen::Vector2d> lattice_;
    std::vector<SurfacePoint<double>> exact_;
};

double parameter(int i) {
    return static_cast<double>(i) / samples;
}

// Linear interpolation between the samples.
double at_parameter(const std::vector<double>& values, double t) {
    const double x = std::clamp(t, 0.0, 1.0) * samples;
    const int i = std::min(static_cast<int>(x), samples - 1);
    return values[i] + (x - i) * (values[i + 1] - values[i]);
}

// No size exceeds another by more than `growth` times the distance between them.
void limit_growth(const Resolution& r, bool periodic, std::vector<double>& size) {
    const auto pass = [&](int i, int from) {
        const double distance = (r.speed[i] + r.speed[from]) / (2 * samples);
        size[i] = std::min(size[i], size[from] + growth * distance);
    };
    for (int round = 0; round < (periodic ? 2 : 1); ++round) {
        if (periodic) size[0] = size[samples] = std::min(size[0], size[samples]);
        for (int i = 1; i <= samples; ++i) pass(i, i - 1);
        for (int i = samples - 1; i >= 0; --i) pass(i, i + 1);
    }
}

// The largest spans of which the defect, times the span, stays below the level.
std::vector<double> sizes_for(const Resolution& r, bool periodic, double level) {
    std::vector<double> size(samples + 1);
    const int n = static_cast<int>(r.spans.size());
    for (int i = 0; i <= samples; ++i) {
        const auto log_share = [&](int s) { return std::log(std::max(r.defect(i, s), 1e-14) * r.spans[s]); };
        int s = n - 1;
        while (s > 0 && log_share(s) > std::log(level)) --s;
        size[i] = r.spans[s];
        if (s + 1 < n && log_share(s) < std::log(level)) {
            const double part = (std::log(level) - log_share(s)) / (log_share(s + 1) - log_share(s));
            size[i] *= std::pow(r.spans[s + 1] / r.spans[s], part);
        } else if (s == 0) {
            size[i] *= std::min(1.0, level / std::exp(log_share(0)));
        }
    }
    limit_growth(r, periodic, size);
    return size;
}

// Rings whose distances and numbers of points follow the sizes, as in a lattice of equilateral triangles.
std::vector<Ring> rings_for(const Resolution& r, const Curve& profile, const std::vector<double>& size) {
    std::vector<double> rows(samples + 1, 0);  // number of rows up to a sample
    for (int i = 1; i <= samples; ++i)
        rows[i] = rows[i - 1] + (r.speed[i] / size[i] + r.speed[i - 1] / size[i - 1]) / (std::sqrt(3.0) * samples);
    if (!(rows[samples] < most_rows)) throw SolveError("the surface is not finite, or no mesh of it can be");
    const auto parameter_of = [&](double row) {
        const int i =
            std::clamp(static_cast<int>(std::upper_bound(rows.begin(), rows.end(), row) - rows.begin()), 1, samples);
        return (i - 1 + (row - rows[i - 1]) / (rows[i] - rows[i - 1])) / samples;
    };
    std::vector<double> ends = profile.seams;
    ends.insert(ends.begin(), 0.0);
    ends.push_back(1.0);
    std::vector<Ring> rings;
    for (std::size_t piece = 0; piece + 1 < ends.size(); ++piece) {
        const double low = at_parameter(rows, ends[piece]), high = at_parameter(rows, ends[piece + 1]);
        int n = std::max(1, static_cast<int>(std::lround(high - low)));
        if (profile.length > 0 && ends.size() == 2) n = std::max(2, 2 * ((n + 1) / 2));
        for (int j = 0; j < n; ++j) {
            const double t = j == 0 ? ends[piece] : parameter_of(low + (high - low) * j / n);
            const auto at = profile.at(t);
            const int count = static_cast<int>(std::lround(at_parameter(r.around, t) / at_parameter(size, t)));
            const bool pole = profile.length == 0 && piece == 0 && j == 0;
            rings.push_back({at[0], at[2], pole ? 1 : std::max(count, 5), rings.size() % 2 ? 0.5 : 0.0});
        }
    }
    if (profile.length == 0) rings.push_back({0, profile.at(1)[2], 1, 0});
    return rings;
}

// The number of equilateral triangles of these sizes on the surface.
double triangles_of(const Resolution& r, const std::vector<double>& size) {
    double sum = 0;
    for (int i = 0; i <= samples; ++i)
        sum += (i == 0 || i == samples ? 0.5 : 1.0) * r.speed[i] * r.around[i] / (size[i] * size[i]);
    return 4 / std::sqrt(3.0) * sum / samples;
}

// Rings of sizes_of(level), with the level that gives this many triangles; there are more the lower the level.
template <class Sizes>
TriangleMesh rings_of_number(const Resolution& r, const Curve& profile, int triangles, Sizes&& sizes_of) {
    TriangleMesh best;
    double wanted = triangles;
    const auto excess = [&](const TriangleMesh& mesh) {
        return std::abs(std::log(static_cast<double>(mesh.triangles.size()) / triangles));
    };
    // Whole rings of whole numbers of points are some percent off what the sizes would give: ask for that much less.
    for (int attempt = 0; attempt < 4; ++attempt) {
        double low = 1e-12, high = 1e3;
        for (int step = 0; step < 60; ++step) {
            const double level = std::sqrt(low * high);
            (triangles_of(r, sizes_of(level)) > wanted ? low : high) = level;
        }
        TriangleMesh mesh = ring_mesh(rings_for(r, profile, sizes_of(high)), profile.length);
        wanted *= triangles / static_cast<double>(mesh.triangles.size());
        if (best.triangles.empty() || excess(mesh) < excess(best)) best = std::move(mesh);
    }
    return best;
}

}  // namespace

Resolution measure_resolution(const ExactPoint& point, const Curve& profile, int order) {
    Resolution r{std::vector<double>(samples + 1), std::vector<double>(samples + 1), {}, {}};
    const auto at = [&](double t, double theta) {
        const Place p = place(profile, t, theta);
        return point(p.x, p.along, p.around);
    };
    double length = 0;
    int different = 1;  // meridians; of a surface of revolution one does for all
    for (int i = 0; i <= samples; ++i) {
        const double first = at(parameter(i), 0).B.norm();
        for (int m = 0; m < meridians; ++m) {
            const SurfacePoint<double> p = at(parameter(i), 2 * pi * m / meridians);
            r.speed[i] += p.tangent[0].norm() / meridians;
            r.around[i] += p.tangent[1].norm() * 2 * pi / meridians;
            if (std::abs(p.B.norm() - first) > 1e-9 * first) different = meridians;
        }
        length += r.speed[i] / samples;
    }

    const int n_spans = 14;
    for (int s = 0; s < n_spans; ++s) r.spans.push_back(0.5 * length * std::pow(0.6, n_spans - 1 - s));
    r.defect = Eigen::MatrixXd::Zero(samples + 1, n_spans);
    SharedPause pause;
    parallel_for(samples + 1, [&](std::size_t i) {
        CurveDefect curve_defect(order);
        PatchDefect patch_defect(order);
        const auto defect = [&](double t, double theta, double dt, double dtheta) {
            double approximation = curve_defect([&](double x) { return at(t + x * dt, theta); });
            if (dtheta <= 2 * pi)  // beyond, near a pole, the other direction suffices
                approximation =
                    std::max(approximation, curve_defect([&](double x) { return at(t, theta + x * dtheta); }));
            // Straight ahead from the profile's surface: no angle is needed, and poles are points like others.
            const Place p = place(profile, t, theta);
            return std::hypot(approximation, patch_defect([&](double x, double y) {
                                  return point(p.x + x * dt * p.along + y * dtheta * p.around, p.along, p.around);
                              }));
        };
        for (int m = 0; m < different && !pause.look(); ++m)
            for (int s = 0; s < n_spans; ++s)
                r.defect(i, s) =
                    std::max(r.defect(i, s), defect(parameter(i), 2 * pi * m / meridians, r.spans[s] / r.speed[i],
                                                    r.spans[s] / (r.around[i] / (2 * pi))));
    });
    pause.check();
    return r;
}

TriangleMesh uniform_rings(const Resolution& r, const Curve& profile, int triangles) {
    return rings_of_number(r, profile, triangles, [](double size) { return std::vector<double>(samples + 1, size); });
}

TriangleMesh graded_rings(const Resolution& r, const Curve& profile, int triangles) {
    return rings_of_number(r, profile, triangles,
                           [&](double level) { return sizes_for(r, profile.length > 0, level); });
}

}  // namespace tubule::surface3d
