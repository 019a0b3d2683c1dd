#include "tools/compare/alignment.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "common/geometry/profile_point.hpp"
#include "common/solve/parallel.hpp"
#include "common/solve/pause.hpp"
#include "tools/compare/surfaces.hpp"

namespace tubule::compare {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Vector6 = Eigen::Matrix<double, 6, 1>;

constexpr std::size_t coarse_samples = 150, fine_samples = 3000;
constexpr std::size_t tried_closely = 12;  // initial guesses that are refined, besides those without a rotation
constexpr double as_good = 1.01;           // mean squares within this factor count as equal: the smallest rotation wins
constexpr int most_steps = 30, last_steps = 12;
// Relative decrease of the mean square in a step below which the iteration ends, in three rounds. The position of the
// minimum is accurate to the square root of it.
constexpr double coarse_gain = 1e-4, fine_gain = 1e-8, last_gain = 1e-13;
constexpr int shifts_tried = 12;      // along a tube, and turns about its axis
constexpr double same_moment = 0.05;  // relative difference below which two moments of inertia count as equal
constexpr int turns_tried = 32;       // about a single known axis
// Where no axis is known: neighbours are about 20 degrees apart, half the length of a wave of degree 9.
constexpr int rotations_tried = 2000;

// The free components of a motion (1, else 0): translations, then rotations about x, y, z.
Vector6 freedom(const Surface& a, const Surface& b) {
    Vector6 out = Vector6::Ones();
    if (a.period() > 0) {
        out[3] = out[4] = 0;
        if (a.grain() == 0 || b.grain() == 0) out[5] = 0;  // a rotation about z changes nothing
    }
    if (a.grain() == 0 && b.grain() == 0) out << 0, 0, 1, 0, 0, 0;
    return out;
}

// About this many of the quadrature points, evenly spaced by index.
std::vector<Sample> some(const std::vector<Sample>& samples, std::size_t count) {
    const std::size_t step = std::max<std::size_t>(samples.size() / count, 1);
    std::vector<Sample> out;
    for (std::size_t i = 0; i < samples.size(); ++i)
        if (i % step == step / 2 && samples[i].weight > 0) out.push_back(samples[i]);
    return out;
}

std::vector<Sample> quadrature_points(const Surface& surface, const Surface& other) {
    std::vector<Sample> samples = surface.samples(other.grain());
    std::erase_if(samples, [](const Sample& s) { return s.weight == 0; });
    return samples;
}

std::vector<Foot> feet(const std::vector<Sample>& samples, const Surface& b, const RigidMotion& motion) {
    check_pause();
    std::vector<Foot> out(samples.size());
    parallel_for(
        samples.size(), [&](std::size_t i) { out[i] = b.foot(motion(samples[i].x)); },
        samples.size() > coarse_samples * 2);
    return out;
}

double mean_square(const std::vector<Sample>& samples, const std::vector<Foot>& feet) {
    double sum = 0, area = 0;
    for (std::size_t i = 0; i < samples.size(); ++i)
        sum += samples[i].weight * feet[i].distance * feet[i].distance, area += samples[i].weight;
    return sum / area;
}

RigidMotion after(const RigidMotion& first, const Vector6& step, const Vector3d& centre) {
    const Vector3d turn = step.tail<3>();
    const double angle = turn.norm();
    const Matrix3d rotation = angle > 0 ? Eigen::AngleAxisd(angle, Vector3d(turn / angle)).toRotationMatrix()
                                        : Matrix3d(Matrix3d::Identity());
    return {rotation * first.rotation, rotation * (first.shift - centre) + centre + step.head<3>()};
}

struct Fit {
    RigidMotion motion;
    double mean_square;
};

// Levenberg's and Marquardt's method: the distance of a moving point grows as fast as it moves away from its foot.
Fit fitted(const std::vector<Sample>& samples, const Surface& b, const Vector6& free, double size, RigidMotion motion,
           int most, double gain) {
    std::vector<Foot> foot = feet(samples, b, motion);
    double value = mean_square(samples, foot), damping = 1e-9;
    for (int i = 0; i < most && damping < 1e3; ++i) {
        Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
        Vector6 right = Vector6::Zero();
        Vector3d centre = Vector3d::Zero();
        if (b.period() == 0)
            for (const Sample& s : samples) centre += motion(s.x) / samples.size();
        for (std::size_t k = 0; k < samples.size(); ++k) {
            const Vector3d x = motion(samples[k].x), away = x - foot[k].point;
            const bool apart = foot[k].distance > 1e-12 * size;
            const Vector3d n = apart ? Vector3d(away / foot[k].distance) : foot[k].normal;
            Vector6 row;
            row << n, (x - centre).cross(n) / size;  // turns in units of lengths
            row = row.cwiseProduct(free);
            normal += samples[k].weight * row * row.transpose();
            right -= samples[k].weight * row * foot[k].distance;
        }
        normal.diagonal().array() += damping * normal.trace() + 1e-300;
        Vector6 step = normal.ldlt().solve(right).cwiseProduct(free);
        step.tail<3>() /= size;
        const RigidMotion next = after(motion, step, centre);
        std::vector<Foot> there = feet(samples, b, next);
        const double changed = mean_square(samples, there);
        if (!(changed < value)) {
            damping = std::max(10 * damping, 1e-6);
            continue;
        }
        const bool enough = changed > (1 - gain) * value || changed < 1e-30 * size * size;
        motion = next, foot = std::move(there), value = changed, damping = std::max(damping / 10, 1e-12);
        if (enough) break;
    }
    return {motion, value};
}

struct Inertia {
    Vector3d centre = Vector3d::Zero(), moments;
    Matrix3d axes;  // columns
};
Inertia inertia(const std::vector<Sample>& samples, bool around_z) {
    Inertia out;
    double area = 0;
    for (const Sample& s : samples) out.centre += s.weight * s.x, area += s.weight;
    out.centre /= area;
    if (around_z) out.centre[0] = out.centre[1] = 0;
    Matrix3d second = Matrix3d::Zero();
    for (const Sample& s : samples) second += s.weight / area * (s.x - out.centre) * (s.x - out.centre).transpose();
    if (around_z) second = Vector3d(second(0, 0) / 2, second(0, 0) / 2, second(2, 2)).asDiagonal();
    const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(second);
    out.moments = solver.eigenvalues(), out.axes = solver.eigenvectors();
    if (out.axes.determinant() < 0) out.axes.col(0) *= -1;
    return out;
}

Matrix3d turn(double angle, const Vector3d& axis) {
    return Eigen::AngleAxisd(angle, axis).toRotationMatrix();
}

// All over the rotations: Alexa's super-Fibonacci spirals (2022).
std::vector<Matrix3d> even_rotations() {
    constexpr double first = 1.414213562373095, second = 1.533751168755204;
    std::vector<Matrix3d> out;
    for (int i = 0; i < rotations_tried; ++i) {
        const double s = i + 0.5, t = s / rotations_tried, a = 2 * pi * s / first, b = 2 * pi * s / second;
        const Eigen::Vector2d sizes(std::sqrt(t), std::sqrt(1 - t));
        out.push_back(Eigen::Quaterniond(sizes[1] * std::cos(b), sizes[0] * std::sin(a), sizes[0] * std::cos(a),
                                         sizes[1] * std::sin(b))
                          .toRotationMatrix());
    }
    return out;
}

// Candidate rotations in the frame of the axes of inertia: those that preserve the axes, or samples where axes are
// not unique.
std::vector<Matrix3d> turns(const Vector3d& moments) {
    const double near = same_moment * moments[2];
    const bool low = moments[1] - moments[0] < near, high = moments[2] - moments[1] < near;
    const std::vector<Matrix3d> flips{Matrix3d::Identity(), turn(pi, Vector3d::UnitX()), turn(pi, Vector3d::UnitY()),
                                      turn(pi, Vector3d::UnitZ())};
    if (!low && !high) return flips;
    std::vector<Matrix3d> out;
    const auto about = [&](const Vector3d& axis, const Vector3d& across) {
        for (int i = 0; i < turns_tried; ++i)
            for (const Matrix3d& flip : {Matrix3d(Matrix3d::Identity()), turn(pi, across)})
                out.push_back(turn(2 * pi * i / turns_tried, axis) * flip);
    };
    if (low != high) {
        low ? about(Vector3d::UnitZ(), Vector3d::UnitX()) : about(Vector3d::UnitX(), Vector3d::UnitZ());
        return out;
    }
    return even_rotations();
}

// Initial guesses: motions of `a` towards `b`.
std::vector<RigidMotion> beginnings(const Surface& a, const Surface& b, const std::vector<Sample>& samples) {
    const bool lone_meridian = a.grain() == 0 && b.grain() == 0;
    const Inertia from = inertia(samples, lone_meridian), to = inertia(quadrature_points(b, a), lone_meridian);
    std::vector<RigidMotion> out{RigidMotion{}, {Matrix3d::Identity(), to.centre - from.centre}};
    if (a.period() > 0) {
        Vector3d across = to.centre - from.centre;
        for (int i = 0; i < shifts_tried; ++i)
            for (int j = 0; j < (a.grain() == 0 || b.grain() == 0 ? 1 : shifts_tried); ++j) {
                const Matrix3d turned = turn(2 * pi * j / shifts_tried, Vector3d::UnitZ());
                across = to.centre - turned * from.centre;
                across[2] = a.period() * i / shifts_tried;
                out.push_back({turned, across});
            }
        return out;
    }
    if (lone_meridian) {
        const Matrix3d flip = turn(pi, Vector3d::UnitX());
        out.push_back({flip, to.centre - flip * from.centre});
        return out;
    }
    for (const Matrix3d& turned : turns(to.moments)) {
        const Matrix3d rotation = to.axes * turned * from.axes.transpose();
        out.push_back({rotation, to.centre - rotation * from.centre});
    }
    return out;
}

}  // namespace

RigidMotion alignment(const Surface& a, const Surface& b) {
    require_same_kind(a, b);
    const std::vector<Sample> all = quadrature_points(a, b);
    const std::vector<Sample> few = some(all, coarse_samples), many = some(all, fine_samples);
    const Vector6 free = freedom(a, b);
    double size = 0;
    for (const Sample& s : all) size = std::max(size, s.x.norm());

    std::vector<Fit> fits;
    for (const RigidMotion& begin : beginnings(a, b, all)) fits.push_back({begin, 0});
    parallel_for(fits.size(),
                 [&](std::size_t i) { fits[i].mean_square = mean_square(few, feet(few, b, fits[i].motion)); });
    const auto better = [](const Fit& l, const Fit& r) { return l.mean_square < r.mean_square; };
    std::stable_sort(fits.begin() + 2, fits.end(), better);
    fits.resize(std::min(fits.size(), tried_closely + 2));
    parallel_for(fits.size(),
                 [&](std::size_t i) { fits[i] = fitted(few, b, free, size, fits[i].motion, most_steps, coarse_gain); });
    // A symmetric shape fits in many ways: the smallest rotation is chosen.
    const double enough =
        as_good * std::min_element(fits.begin(), fits.end(), better)->mean_square + 1e-20 * size * size;
    const Fit* best = nullptr;
    for (const Fit& fit : fits)
        if (fit.mean_square <= enough && (!best || fit.motion.rotation.trace() > best->motion.rotation.trace() + 1e-6))
            best = &fit;
    // For surfaces that differ, the minimum depends on the weights: the last fit uses all points.
    const RigidMotion near = fitted(many, b, free, size, best->motion, most_steps, fine_gain).motion;
    return fitted(all, b, free, size, near, last_steps, last_gain).motion.inverse();
}

}  // namespace tubule::compare
