#include "common/shapes/profile_file.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <sstream>

#include "common/geometry/profile_point.hpp"
#include "common/solve/dense.hpp"

namespace tubule {
namespace {

constexpr int fewest_points = 9, most_points = 20000, most_waves = 256;
constexpr double default_tolerance = 1e-4;  // of the largest extent, of the largest |H0|
constexpr double at_end = 1e-6;             // of the largest extent: r = 0 at a pole, ends that are the same point
constexpr int rounds = 4;                   // of fitting, each with the arc length of the curve before
constexpr int points_per_wave = 24;         // of the curve that is made of a fit

// In a file; columns count characters from 1.
struct Place {
    int line, column;
};

struct Point {
    double r, z, H0;  // H0 is 0 where the file has none
    Place at;
};

[[noreturn]] void refuse(const std::filesystem::path& path, const std::string& what) {
    throw ProfileError(fmt::format("{}: {}", path.string(), what));
}
[[noreturn]] void refuse(const std::filesystem::path& path, Place at, const std::string& what) {
    throw ProfileError(fmt::format("{}:{}:{}: {}", path.string(), at.line, at.column, what));
}

struct Cell {
    std::string text;
    int column;
};

// Between commas, semicolons or blanks.
std::vector<Cell> cells(const std::string& line) {
    std::vector<Cell> out{{"", 1}};
    bool open = false;  // a blank ends a cell, but blanks beside a comma do not make one
    for (std::size_t i = 0; i < line.size(); ++i) {
        const char c = line[i];
        const int column = static_cast<int>(i) + 1;
        const bool blank = c == ' ' || c == '\t' || c == '\r', comma = c == ',' || c == ';';
        if (comma) {
            out.push_back({"", column + 1}), open = false;
        } else if (blank) {
            open = !out.back().text.empty();
        } else {
            if (open) out.push_back({"", column});
            if (out.back().text.empty()) out.back().column = column;
            out.back().text += c, open = false;
        }
    }
    return out;
}

std::optional<double> number_in(const std::string& cell) {
    double value = 0;
    const char* end = cell.data() + cell.size();
    const auto [at, error] = std::from_chars(cell.data(), end, value);
    if (cell.empty() || error != std::errc{} || at != end || !std::isfinite(value)) return std::nullopt;
    return value;
}

// The rows of a file: what is neither empty nor a comment.
class Rows {
public:
    explicit Rows(const std::string& text) : file_(text) {}
    // The next row; false at the end.
    bool next() {
        for (std::string text; std::getline(file_, text);) {
            ++line;
            if (line == 1 && text.starts_with("\xef\xbb\xbf")) text.replace(0, 3, "");
            const std::size_t first = text.find_first_not_of(" \t\r");
            if (first == text.npos || text[first] == '#') continue;
            row = cells(text);
            return true;
        }
        return false;
    }

    int line = 0;
    std::vector<Cell> row;

private:
    std::istringstream file_;
};

// Which column holds what; those of other names are ignored.
struct Columns {
    std::size_t r = 0, z = 1, count = 2;
    std::optional<std::size_t> H0;
};

std::optional<std::size_t> column_of(const std::vector<Cell>& row, std::string_view name) {
    const auto found = std::ranges::find(row, name, &Cell::text);
    if (found == row.end()) return std::nullopt;
    return static_cast<std::size_t>(found - row.begin());
}

// Nobody means to have H0 ignored.
bool means_H0(std::string name) {
    std::erase_if(name, [](char c) { return !std::isalnum(static_cast<unsigned char>(c)); });
    std::ranges::transform(name, name.begin(), [](char c) { return static_cast<char>(std::tolower(c)); });
    return name == "h0" || name == "c0" || name == "spontaneouscurvature";
}

Columns columns_of(const std::filesystem::path& path, int line, const std::vector<Cell>& heading) {
    const auto r = column_of(heading, "r"), z = column_of(heading, "z");
    if (!r || !z) refuse(path, {line, heading[0].column}, "a heading must name the columns r and z");
    const Columns out{*r, *z, heading.size(), column_of(heading, "H0")};
    for (std::size_t i = 0; i < heading.size(); ++i) {
        const std::string& name = heading[i].text;
        const bool known = i == out.r || i == out.z || i == out.H0;
        if (!known && (name == "r" || name == "z" || name == "H0"))
            refuse(path, {line, heading[i].column}, fmt::format("a second column {}", name));
        if (!known && means_H0(name))
            refuse(path, {line, heading[i].column},
                   fmt::format("there is no column '{:.40}': the spontaneous curvature is called H0", name));
    }
    return out;
}

// The values of a row, as many as there are columns.
Point point_of(const std::filesystem::path& path, int line, const std::vector<Cell>& row, const Columns& columns) {
    if (row.size() != columns.count)
        refuse(path, {line, row[std::min(row.size() - 1, columns.count)].column},
               fmt::format("has {} value{} where {} are expected: r, z{}{}", row.size(), row.size() == 1 ? "" : "s",
                           columns.count, columns.H0 ? ", H0" : "",
                           row.size() == 2 * columns.count ? "; decimals have a point, not a comma" : ""));
    const auto value = [&](std::size_t column, const char* name) {
        const auto& [text, at] = row[column];
        if (text.empty())
            refuse(path, {line, at}, fmt::format("{} is missing: complete the line, or leave it out", name));
        const auto found = number_in(text);
        if (!found)
            refuse(path, {line, at},
                   fmt::format("'{:.40}{}' is not a finite number", text, text.size() > 40 ? "..." : ""));
        return *found;
    };
    return {value(columns.r, "r"),
            value(columns.z, "z"),
            columns.H0 ? value(*columns.H0, "H0") : 0,
            {line, row[columns.r].column}};
}

struct Points {
    std::vector<Point> points;
    bool have_H0 = false;
};

Points read_points(const std::filesystem::path& path, const std::string& text) {
    Rows rows(text);
    Points out;
    Columns columns;
    for (bool first = true; rows.next(); first = false) {
        if (first && !number_in(rows.row[0].text)) {
            columns = columns_of(path, rows.line, rows.row);
            continue;
        }
        const Point point = point_of(path, rows.line, rows.row, columns);
        if (out.points.size() == most_points) refuse(path, point.at, fmt::format("more than {} points", most_points));
        out.points.push_back(point);
    }
    if (out.points.size() < fewest_points)
        refuse(path, {std::max(rows.line, 1), 1},
               fmt::format("{} points are too few: a profile needs {}", out.points.size(), fewest_points));
    out.have_H0 = columns.H0.has_value();
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
                refuse(path, points[j + 1].at,
                       fmt::format("the profile crosses itself: the segment that ends here meets that from line {} to "
                                   "line {}; points must be in order along the profile",
                                   points[i].at.line, points[i + 1].at.line));
        }
}

// Refuses points off the half plane r >= 0, or in no order, with other words than profiles that are not closed.
void refuse_disorder(const std::filesystem::path& path, const std::vector<Point>& points, double size) {
    const auto negative = std::ranges::find_if(points, [&](const Point& p) { return p.r < -at_end * size; });
    if (negative != points.end())
        refuse(path, negative->at,
               fmt::format("r = {:.6g} is below 0, but it is the distance from the axis: {}", negative->r,
                           std::ranges::all_of(points, [&](const Point& p) { return p.z > -at_end * size; })
                               ? "are the columns r and z swapped?"
                               : "give the half of the outline with r >= 0"));
    for (std::size_t i = 1; i < points.size(); ++i)
        if (const double away = std::hypot(points[i].r - points[i - 1].r, points[i].z - points[i - 1].z);
            away > size / 2)
            refuse(path, points[i].at,
                   fmt::format("is {:.3g} from the point before: points must be in order along the profile", away));
}

// A cell, a tube or a ring (a tube of no length) by its ends, and points that fit: from the south upwards on the
// outside, with both ends.
Topology put_in_order(const std::filesystem::path& path, std::vector<Point>& points, const ProfileFile& file,
                      double tolerance) {
    const double size = extent(points), same = at_end * size;
    const auto meets = [&](const Point& a, const Point& b, double rise) {
        return std::abs(a.r - b.r) <= same && std::abs(a.z + rise - b.z) <= same;
    };
    Topology topology = Topology::tube;
    if (file.length) {
        if (points.back().z < points.front().z) std::ranges::reverse(points);
        const Point first = points.front();
        Point end{first.r, first.z + *file.length, first.H0, points.back().at};
        if (meets(first, points.back(), *file.length)) {
            end.H0 = points.back().H0;
            points.pop_back();
        }
        if (!(points.back().z - first.z < *file.length))
            refuse(path, points.back().at,
                   fmt::format("the profile rises by {:.6g}, more than shape.length = {:.6g}",
                               points.back().z - first.z, *file.length));
        points.push_back(end);
    } else if (std::abs(points.front().r) <= same && std::abs(points.back().r) <= same) {
        topology = Topology::cell;
        points.front().r = points.back().r = 0;
    } else if (meets(points.front(), points.back(), 0)) {
        points.back().r = points.front().r, points.back().z = points.front().z;
    } else {
        refuse_disorder(path, points, size);
        refuse(path, points.back().at,
               fmt::format(
                   "the profile is not closed: r = {:.6g} at its first and {:.6g} at its last point; it must begin "
                   "and end on the axis, r = 0, or end where it begins; one that is periodic needs shape.length",
                   points.front().r, points.back().r));
    }
    for (std::size_t i = 0; i < points.size(); ++i) {
        const bool pole = topology == Topology::cell && (i == 0 || i + 1 == points.size());
        if (!pole && !(points[i].r > 0))
            refuse(path, points[i].at,
                   fmt::format("r = {:.6g}: the profile meets the axis within; give one half of the outline, r >= 0, "
                               "from pole to pole",
                               points[i].r));
        if (i > 0 && points[i].r == points[i - 1].r && points[i].z == points[i - 1].z)
            refuse(path, points[i].at, "the same point as before; remove one of the two");
    }
    refuse_crossing(path, points, file.length.value_or(0), tolerance);
    double volume = 0;  // below 0 where the profile runs downwards on the outside
    for (std::size_t i = 0; i + 1 < points.size(); ++i)
        volume += std::pow(points[i].r + points[i + 1].r, 2) * (points[i + 1].z - points[i].z);
    if (volume < 0) std::ranges::reverse(points);
    return topology;
}

// The functions of s that waves up to this number are sums of, and their derivatives: of a cell r = SUM a_k sin(k pi
// s), z = SUM b_k cos(k pi s), else r and z - length s are sums of 1, cos(2 pi k s) and sin(2 pi k s).
struct Basis {
    bool cell;
    int waves;
    bool odd;  // of a cell: r, else z

    int size() const { return !cell ? 2 * waves + 1 : odd ? waves : waves + 1; }
    void at(double s, double* value, double* slope) const {
        if (!cell) {
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
    return solve_dense(normal, rows.transpose() * values);
}

// A curve by the coefficients of r and z.
struct WaveCurve {
    bool cell = true;
    double length = 0;
    int waves = 0;
    Eigen::VectorXd r, z;

    // r, dr/ds, z, dz/ds
    std::array<double, 4> operator()(double s) const {
        thread_local std::vector<double> value, slope;
        const auto sum = [&](const Eigen::VectorXd& c, bool odd) {
            value.resize(c.size()), slope.resize(c.size());
            Basis{cell, waves, odd}.at(s, value.data(), slope.data());
            return std::array{Eigen::Map<const Eigen::VectorXd>(value.data(), c.size()).dot(c),
                              Eigen::Map<const Eigen::VectorXd>(slope.data(), c.size()).dot(c)};
        };
        const auto at_r = sum(r, true), at_z = sum(z, false);
        return {at_r[0], at_r[1], at_z[0] + length * s, at_z[1] + length};
    }
};

// The parameter of the point of the curve nearest to one, near s.
double nearest(const WaveCurve& fit, const Point& p, double s, bool fixed) {
    for (int k = 0; k < 8 && !fixed; ++k) {
        const auto [r, r1, z, z1] = fit(s);
        const double step = ((p.r - r) * r1 + (p.z - z) * z1) / (r1 * r1 + z1 * z1);
        s = std::clamp(s + step, 0.0, 1.0);
        if (std::abs(step) < 1e-13) break;
    }
    return s;
}

// Parameters become fractions of the integral of density(point) over the parameter of a curve of so many waves.
template <class Density, class At>
void measure_by(const Density& density, const At& curve, int waves, std::vector<double>& s) {
    const int n = 16 * waves + 64;
    std::vector<double> sum(n + 1, 0.0);
    const auto at_parameter = [&](double at) { return density(curve(at)); };
    for (int i = 0; i < n; ++i)  // Simpson
        sum[i + 1] =
            sum[i] +
            (at_parameter(double(i) / n) + 4 * at_parameter((i + 0.5) / n) + at_parameter((i + 1.0) / n)) / (6 * n);
    for (double& at : s) {
        const int i = std::clamp(static_cast<int>(at * n), 0, n - 1);
        const double from = double(i) / n, part = at - from;
        at = (sum[i] + part / 6 * (at_parameter(from) + 4 * at_parameter(from + part / 2) + at_parameter(at))) / sum[n];
    }
}

double length_of(const std::array<double, 4>& point) {
    return std::hypot(point[1], point[3]);
}
double area_of(const std::array<double, 4>& point) {
    return point[0] * length_of(point);
}

// A fit: the curve, the distance of the points, and their parameters s.
struct Fit {
    WaveCurve curve;
    double distance = std::numeric_limits<double>::infinity();
    std::vector<double> s;
};
Fit fit_waves(Topology topology, const std::vector<Point>& points, double length, int waves, std::vector<double> s) {
    WaveCurve fit{topology == Topology::cell, length, waves, {}, {}};
    const int n = static_cast<int>(points.size());
    double distance = 0;
    for (int round = 0; round < rounds; ++round) {
        Eigen::VectorXd r(n), z(n);
        for (int i = 0; i < n; ++i) r[i] = points[i].r, z[i] = points[i].z - length * s[i];
        fit.r = least_squares({fit.cell, waves, true}, s, r), fit.z = least_squares({fit.cell, waves, false}, s, z);
        distance = 0;
        for (int i = 0; i < n; ++i) {
            const bool end = i == 0 || i + 1 == n;
            s[i] = nearest(fit, points[i], s[i], end);
            const auto at = fit(s[i]);
            const double off = std::hypot(at[0] - points[i].r, at[2] - points[i].z);
            if (!std::isfinite(off)) return {};  // numbers so far apart that no waves fit them
            distance = std::max(distance, off);
        }
        if (round + 1 < rounds) measure_by(length_of, fit, waves, s);
    }
    return {fit, distance, s};
}

// More waves are not determined by this number of points, or take too long.
int most_waves_of(bool cell, std::size_t points) {
    return std::min(static_cast<int>(points) / (cell ? 2 : 4), most_waves);
}

// H0 by the fewest waves of the area below, which are smooth at the poles, too.
void fit_H0(const std::filesystem::path& path, const std::vector<Point>& points, const ProfileFile& file,
            const Fit& fit, FittedProfile& out) {
    std::vector<double> area = fit.s;
    const bool cell = fit.curve.cell;
    measure_by(area_of, fit.curve, fit.curve.waves, area);
    std::vector<double> at = area;  // T_k(1 - 2 area) = cos(k pi at) of a cell
    if (cell)
        for (double& a : at) a = std::acos(std::clamp(1 - 2 * a, -1.0, 1.0)) / pi;
    const auto n = static_cast<Eigen::Index>(points.size());
    Eigen::VectorXd values(n);
    for (Eigen::Index i = 0; i < n; ++i) values[i] = points[i].H0;
    const double tolerance = file.H0_tolerance.value_or(default_tolerance * values.cwiseAbs().maxCoeff());
    double best = std::numeric_limits<double>::infinity();
    Place worst = points.front().at;
    for (int waves = 0; waves <= most_waves_of(cell, points.size()); waves = std::max(waves + 1, waves * 6 / 5)) {
        const Eigen::VectorXd c = least_squares({cell, waves, false}, at, values);
        const Formula H0 =
            fitted_formula(cell ? Formula::Op::polynomial : Formula::Op::waves, {c.data(), c.data() + c.size()});
        double off = 0;
        Place here = worst;
        for (Eigen::Index i = 0; i < n; ++i)
            if (const double d = std::abs(evaluate(H0, &area[i]) - values[i]); !(d <= off))
                off = d, here = points[i].at;
        if (!(off < best)) continue;
        best = off, worst = here;
        out.H0 = std::make_shared<const Formula>(H0), out.H0_distance = off;
        if (off <= tolerance) return;
    }
    refuse(path, worst,
           fmt::format("no smooth H0 comes within {:.3g} of all {} values: the best is {:.3g} off, here; set "
                       "shape.H0_tolerance to that, or give transitions a width and more points",
                       tolerance, points.size(), best));
}

}  // namespace

FittedProfile read_profile(const std::filesystem::path& path, const std::string& text, const ProfileFile& file) {
    auto [points, have_H0] = read_points(path, text);
    const double tolerance = file.tolerance.value_or(default_tolerance * extent(points));
    const Topology topology = put_in_order(path, points, file, tolerance);
    const bool cell = topology == Topology::cell;
    const double length = file.length.value_or(0);
    std::vector<double> s{0};
    for (std::size_t i = 1; i < points.size(); ++i)
        s.push_back(s.back() + std::hypot(points[i].r - points[i - 1].r, points[i].z - points[i - 1].z));
    for (double& at : s) at /= s.back();
    s.back() = 1;
    Fit best;
    for (int waves = 2; waves <= most_waves_of(cell, points.size()); waves = std::max(waves + 1, waves * 6 / 5)) {
        Fit next = fit_waves(topology, points, length, waves, s);
        if (next.distance < best.distance) best = std::move(next);
        if (best.distance <= tolerance) break;
    }
    if (!(best.distance <= tolerance))
        refuse(path, fmt::format("no smooth curve comes within {:.3g} of all {} points: the best is {:.3g} off; set "
                                 "shape.tolerance to {:.2g}, or give more points where the profile bends",
                                 tolerance, points.size(), best.distance, 1.1 * best.distance));
    const int waves = best.curve.waves;
    for (int i = 1; i < points_per_wave * waves; ++i) {
        const auto at = best.curve(double(i) / (points_per_wave * waves));
        if (!(at[0] > 0))
            refuse(path,
                   fmt::format("the smooth curve meets the axis at z = {:.6g}: set a smaller shape.tolerance", at[2]));
    }
    FittedProfile out{{topology, length, best.curve}, best.distance, static_cast<int>(points.size()), waves};
    if (have_H0) fit_H0(path, points, file, best, out);
    return out;
}

std::string place_of_H0(const std::filesystem::path& path, const std::string& text) {
    Rows rows(text);
    if (!rows.next() || number_in(rows.row[0].text)) return {};
    const auto column = column_of(rows.row, "H0");
    return column ? fmt::format("{}:{}:{}", path.string(), rows.line, rows.row[*column].column) : "";
}

std::string FittedProfile::note() const {
    const std::string fitted = fmt::format(
        "a smooth curve of {} waves is at most {:.2g} from the {} points of the profile", waves, distance, points);
    return H0 ? fmt::format("{}, a smooth H0 at most {:.2g} from its values", fitted, H0_distance) : fitted;
}

PerturbedCurve curve_through(const FittedProfile& profile) {
    const int n = std::max(points_per_wave * profile.waves, 100);
    std::vector<double> r, z;
    for (int i = 0; i <= n; ++i) {
        const auto at = profile.curve.at(double(i) / n);
        r.push_back(at[0]), z.push_back(at[2]);
    }
    const double length = profile.curve.length;
    if (profile.curve.topology == Topology::cell)
        r.front() = r.back() = 0;
    else
        r.back() = r.front(), z.back() = z.front() + length;
    return curve_through(r, z, length);
}

CurveFunctions area_below(const FittedProfile& profile, const PerturbedCurve& curve) {
    const std::size_t n = curve.functions.x.size();
    std::vector<double> area(n);
    for (std::size_t i = 0; i < n; ++i) area[i] = static_cast<double>(i) / static_cast<double>(n - 1);
    measure_by(area_of, profile.curve.at, profile.waves, area);
    if (curve.is_cell()) {
        area.back() = 1;
    } else {
        std::vector<double> s = curve.functions.x;
        for (std::size_t i = 0; i < n; ++i) area[i] -= s[i];
        area.back() = area.front();
    }
    return functions_along(curve, std::vector<double>(n, 0.0), area);
}

}  // namespace tubule
