#include "common/shapes/profile_file.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <numeric>

#include "common/geometry/profile_point.hpp"

namespace tubule {
namespace {

using Kind = ProfileCurve::Kind;

constexpr int fewest_points = 9, most_points = 20000, most_waves = 256;
constexpr double default_tolerance = 1e-4;  // of the largest extent
constexpr double at_end = 1e-6;             // of the largest extent: r = 0 at a pole, ends that are the same point
constexpr int rounds = 4;                   // of fitting, each with the arc length of the curve before
constexpr int points_per_wave = 24;         // of the curve that is made of a fit

struct Point {
    double r, z;
    int line;
};

[[noreturn]] void refuse(const std::filesystem::path& path, int line, const std::string& what) {
    throw ProfileError(line > 0 ? fmt::format("{}:{}: {}", path.string(), line, what)
                                : fmt::format("{}: {}", path.string(), what));
}

// Cells between commas, semicolons or blanks.
std::vector<std::string> cells(const std::string& line) {
    std::vector<std::string> out{""};
    bool open = false;  // a blank ends a cell, but blanks beside a comma do not make one
    for (const char c : line) {
        const bool blank = c == ' ' || c == '\t' || c == '\r', comma = c == ',' || c == ';';
        if (comma)
            out.emplace_back(), open = false;
        else if (blank)
            open = !out.back().empty();
        else {
            if (open) out.emplace_back();
            out.back() += c, open = false;
        }
    }
    return out;
}

std::optional<double> number(const std::string& cell) {
    double value = 0;
    const char* end = cell.data() + cell.size();
    const auto [at, error] = std::from_chars(cell.data(), end, value);
    if (cell.empty() || error != std::errc{} || at != end || !std::isfinite(value)) return std::nullopt;
    return value;
}

std::vector<Point> read_points(const std::filesystem::path& path) {
    std::ifstream file(path);
    if (!file || !std::filesystem::is_regular_file(path)) refuse(path, 0, "cannot be read");
    std::vector<Point> out;
    std::size_t r = 0, z = 1, columns = 2;
    int line = 0;
    bool header_allowed = true;
    for (std::string text; std::getline(file, text);) {
        ++line;
        if (line == 1 && text.starts_with("\xef\xbb\xbf")) text.erase(0, 3);
        const std::size_t first = text.find_first_not_of(" \t\r");
        if (first == text.npos || text[first] == '#') continue;
        const std::vector<std::string> row = cells(text.substr(first));
        const auto named = [&](const char* name) { return std::find(row.begin(), row.end(), name) - row.begin(); };
        if (header_allowed && !number(row[0])) {
            r = static_cast<std::size_t>(named("r")), z = static_cast<std::size_t>(named("z")), columns = row.size();
            if (r == columns || z == columns) refuse(path, line, "a heading must name the columns r and z");
            header_allowed = false;
            continue;
        }
        header_allowed = false;
        if (row.size() != columns)
            refuse(path, line, fmt::format("has {} values where {} are expected: r, z", row.size(), columns));
        const auto at = number(row[r]), up = number(row[z]);
        if (const std::string& cell = row[at ? z : r]; !at || !up)
            refuse(path, line, fmt::format("'{:.40}{}' is not a finite number", cell, cell.size() > 40 ? "..." : ""));
        if (out.size() == most_points) refuse(path, line, fmt::format("more than {} points", most_points));
        out.push_back({*at, *up, line});
    }
    if (out.size() < fewest_points)
        refuse(path, line, fmt::format("{} points are too few: a profile needs {}", out.size(), fewest_points));
    return out;
}

double extent(const std::vector<Point>& points) {
    const auto [low, high] = std::ranges::minmax(points, {}, &Point::z);
    return std::max(std::ranges::max(points, {}, &Point::r).r, high.z - low.z);
}

// Whether the segments from a to b and from c to d cross or touch.
bool cross(const Point& a, const Point& b, const Point& c, const Point& d) {
    const auto side = [](const Point& p, const Point& q, const Point& x) {
        return (q.r - p.r) * (x.z - p.z) - (q.z - p.z) * (x.r - p.r);
    };
    const double c_side = side(a, b, c), d_side = side(a, b, d), a_side = side(c, d, a), b_side = side(c, d, b);
    return ((c_side <= 0) != (d_side <= 0)) && ((a_side <= 0) != (b_side <= 0));
}

// What noise within the tolerance ties into knots is no crossing.
void refuse_crossing(const std::filesystem::path& path, const std::vector<Point>& points, double length,
                     double tolerance) {
    const std::size_t n = points.size();
    std::vector<double> way{0};
    for (std::size_t i = 1; i < n; ++i)
        way.push_back(way.back() + std::hypot(points[i].r - points[i - 1].r, points[i].z - points[i - 1].z));
    const bool ring = length == 0 && points[0].r > 0;
    for (std::size_t i = 0; i + 1 < n; ++i)
        for (std::size_t j = i + 2; j + 1 < n; ++j) {
            if (ring && i == 0 && j + 2 == n) continue;  // neighbours
            if (way[j] - way[i + 1] < 8 * tolerance) continue;
            if (std::max(points[i].z, points[i + 1].z) < std::min(points[j].z, points[j + 1].z) ||
                std::min(points[i].z, points[i + 1].z) > std::max(points[j].z, points[j + 1].z))
                continue;
            if (cross(points[i], points[i + 1], points[j], points[j + 1]))
                refuse(path, points[j + 1].line,
                       fmt::format("the profile crosses itself: the segment that ends here meets that from line {} to "
                                   "line {}; points must be in order along the profile",
                                   points[i].line, points[i + 1].line));
        }
}

// What the ends say, and points that fit: from the south upwards on the outside, with both ends.
Kind put_in_order(const std::filesystem::path& path, std::vector<Point>& points, const ProfileFile& file,
                  double tolerance) {
    const double size = extent(points), same = at_end * size;
    const auto meets = [&](const Point& a, const Point& b, double rise) {
        return std::abs(a.r - b.r) <= same && std::abs(a.z + rise - b.z) <= same;
    };
    Kind kind = Kind::cell;
    if (file.length) {
        kind = Kind::tube;
        if (points.back().z < points.front().z) std::ranges::reverse(points);
        const Point first = points.front();
        if (meets(first, points.back(), *file.length)) points.pop_back();
        if (!(points.back().z - first.z < *file.length))
            refuse(path, points.back().line,
                   fmt::format("the profile rises by {:.6g}, more than shape.length = {:.6g}",
                               points.back().z - first.z, *file.length));
        points.push_back({first.r, first.z + *file.length, points.back().line});
    } else if (std::abs(points.front().r) <= same && std::abs(points.back().r) <= same) {
        points.front().r = points.back().r = 0;
    } else if (meets(points.front(), points.back(), 0)) {
        kind = Kind::ring;
        points.back() = {points.front().r, points.front().z, points.back().line};
    } else {
        refuse(path, points.back().line,
               fmt::format(
                   "the profile is not closed: r = {:.6g} at its first and {:.6g} at its last point; it must begin "
                   "and end on the axis, r = 0, or end where it begins; one that is periodic needs shape.length",
                   points.front().r, points.back().r));
    }
    for (std::size_t i = 0; i < points.size(); ++i) {
        const bool pole = kind == Kind::cell && (i == 0 || i + 1 == points.size());
        if (!pole && !(points[i].r > 0))
            refuse(path, points[i].line, fmt::format("r = {:.6g}: the profile meets the axis", points[i].r));
        if (i > 0 && points[i].r == points[i - 1].r && points[i].z == points[i - 1].z)
            refuse(path, points[i].line, "the same point as before");
    }
    refuse_crossing(path, points, file.length.value_or(0), tolerance);
    double volume = 0;  // below 0 where the profile runs downwards on the outside
    for (std::size_t i = 0; i + 1 < points.size(); ++i)
        volume += std::pow(points[i].r + points[i + 1].r, 2) * (points[i + 1].z - points[i].z);
    if (volume < 0) std::ranges::reverse(points);
    return kind;
}

// The functions of s that waves up to this number are sums of, and their derivatives.
struct Basis {
    Kind kind;
    int waves;
    bool odd;  // of a cell: r, else z

    int size() const { return kind != Kind::cell ? 2 * waves + 1 : odd ? waves : waves + 1; }
    void at(double s, double* value, double* slope) const {
        if (kind != Kind::cell) {
            value[0] = 1, slope[0] = 0;
            for (int k = 1; k <= waves; ++k) {
                const double q = 2 * pi * k, c = std::cos(q * s), sine = std::sin(q * s);
                value[2 * k - 1] = c, slope[2 * k - 1] = -q * sine;
                value[2 * k] = sine, slope[2 * k] = q * c;
            }
            return;
        }
        for (int i = 0; i < size(); ++i) {
            const double q = pi * (odd ? i + 1 : i);
            value[i] = odd ? std::sin(q * s) : std::cos(q * s);
            slope[i] = odd ? q * std::cos(q * s) : -q * std::sin(q * s);
        }
    }
};

Eigen::VectorXd least_squares(const Basis& basis, const std::vector<double>& s, const Eigen::VectorXd& values) {
    const int n = basis.size();
    Eigen::MatrixXd rows(values.size(), n);
    Eigen::VectorXd row(n), slope(n);
    for (int i = 0; i < values.size(); ++i) {
        basis.at(s[i], row.data(), slope.data());
        rows.row(i) = row.transpose();
    }
    Eigen::MatrixXd normal = rows.transpose() * rows;
    normal.diagonal().array() *= 1 + 1e-13;  // points may leave gaps
    return normal.ldlt().solve(rows.transpose() * values);
}

// The parameter of the point of the curve nearest to one, near s.
double nearest(const SmoothProfile& fit, const Point& p, double s, bool fixed) {
    for (int k = 0; k < 8 && !fixed; ++k) {
        const auto [r, r1, z, z1] = point_at(fit, s);
        const double step = ((p.r - r) * r1 + (p.z - z) * z1) / (r1 * r1 + z1 * z1);
        s = std::clamp(s + step, 0.0, 1.0);
        if (std::abs(step) < 1e-13) break;
    }
    return s;
}

// Parameters become fractions of the arc length of the curve.
void measure_by_length(const SmoothProfile& fit, std::vector<double>& s) {
    const int n = 16 * fit.waves + 64;
    std::vector<double> length(n + 1, 0.0);
    const auto speed = [&](double at) {
        const auto [r, r1, z, z1] = point_at(fit, at);
        return std::hypot(r1, z1);
    };
    for (int i = 0; i < n; ++i)  // Simpson
        length[i + 1] = length[i] + (speed(double(i) / n) + 4 * speed((i + 0.5) / n) + speed((i + 1.0) / n)) / (6 * n);
    for (double& at : s) {
        const int i = std::clamp(static_cast<int>(at * n), 0, n - 1);
        const double from = double(i) / n, part = at - from;
        at = (length[i] + part / 6 * (speed(from) + 4 * speed(from + part / 2) + speed(at))) / length[n];
    }
}

// Fits of so many waves: coefficients, and how far the points are.
SmoothProfile fit_waves(Kind kind, const std::vector<Point>& points, double length, int waves, std::vector<double> s) {
    SmoothProfile fit{.kind = kind, .length = length, .r = {}, .z = {}};
    const int n = static_cast<int>(points.size());
    fit.points = n, fit.waves = waves;
    for (int round = 0; round < rounds; ++round) {
        Eigen::VectorXd r(n), z(n);
        for (int i = 0; i < n; ++i) r[i] = points[i].r, z[i] = points[i].z - length * s[i];
        fit.r = least_squares({kind, waves, true}, s, r), fit.z = least_squares({kind, waves, false}, s, z);
        fit.distance = 0;
        for (int i = 0; i < n; ++i) {
            const bool end = i == 0 || i + 1 == n;
            s[i] = nearest(fit, points[i], s[i], end);
            const auto at = point_at(fit, s[i]);
            const double off = std::hypot(at[0] - points[i].r, at[2] - points[i].z);
            fit.distance = std::isfinite(off) ? std::max(fit.distance, off) : std::numeric_limits<double>::infinity();
            if (!std::isfinite(off)) return fit;  // numbers so far apart that no waves fit them
        }
        if (round + 1 < rounds) measure_by_length(fit, s);
    }
    return fit;
}

}  // namespace

std::array<double, 4> point_at(const SmoothProfile& profile, double s) {
    thread_local std::vector<double> value, slope;
    const auto sum = [&](const Eigen::VectorXd& c, bool odd) {
        value.resize(c.size()), slope.resize(c.size());
        Basis{profile.kind, profile.waves, odd}.at(s, value.data(), slope.data());
        return std::array{Eigen::Map<const Eigen::VectorXd>(value.data(), c.size()).dot(c),
                          Eigen::Map<const Eigen::VectorXd>(slope.data(), c.size()).dot(c)};
    };
    const auto r = sum(profile.r, true), z = sum(profile.z, false);
    return {r[0], r[1], z[0] + profile.length * s, z[1] + profile.length};
}

SmoothProfile read_profile(const std::filesystem::path& path, const ProfileFile& file) {
    std::vector<Point> points = read_points(path);
    const double tolerance = file.tolerance.value_or(default_tolerance * extent(points));
    const Kind kind = put_in_order(path, points, file, tolerance);
    std::vector<double> s{0};
    for (std::size_t i = 1; i < points.size(); ++i)
        s.push_back(s.back() + std::hypot(points[i].r - points[i - 1].r, points[i].z - points[i - 1].z));
    for (double& at : s) at /= s.back();
    s.back() = 1;
    const int per_wave = kind == Kind::cell ? 2 : 4;  // fewer points do not determine the waves
    const int most = std::min(static_cast<int>(points.size()) / per_wave, most_waves);
    SmoothProfile best;
    best.distance = std::numeric_limits<double>::infinity();
    for (int waves = 2; waves <= most; waves = std::max(waves + 1, waves * 6 / 5)) {
        SmoothProfile fit = fit_waves(kind, points, file.length.value_or(0), waves, s);
        if (fit.distance < best.distance) best = std::move(fit);
        if (best.distance <= tolerance) break;
    }
    if (!(best.distance <= tolerance))
        refuse(path, 0,
               fmt::format("no smooth curve comes within {:.3g} of all {} points: the best is {:.3g} off; set "
                           "shape.tolerance to that, or give more points where the profile bends",
                           tolerance, points.size(), best.distance));
    for (int i = 1; i < points_per_wave * best.waves; ++i) {
        const auto at = point_at(best, double(i) / (points_per_wave * best.waves));
        if (!(at[0] > 0))
            refuse(path, 0,
                   fmt::format("the smooth curve meets the axis at z = {:.6g}: set a smaller shape.tolerance", at[2]));
    }
    return best;
}

std::string SmoothProfile::note() const {
    return fmt::format("a smooth curve of {} waves is at most {:.2g} from the {} points of the profile", waves,
                       distance, points);
}

Meridian meridian(const SmoothProfile& profile) {
    Meridian m;
    m.topology = profile.kind == Kind::cell ? Topology::cell : Topology::tube;
    m.length = profile.length;
    m.at = [profile](double t) { return point_at(profile, t); };
    return m;
}

ProfileCurve profile_curve(const SmoothProfile& profile) {
    const int n = std::max(points_per_wave * profile.waves, 100);
    std::vector<double> r, z;
    for (int i = 0; i <= n; ++i) {
        const auto at = point_at(profile, double(i) / n);
        r.push_back(at[0]), z.push_back(at[2]);
    }
    if (profile.kind == Kind::cell) r.front() = r.back() = 0;
    if (profile.kind != Kind::cell) r.back() = r.front(), z.back() = z.front() + profile.length;
    return profile_curve(r, z, profile.length);
}

}  // namespace tubule
