#include "axisym/curve/vesicle_families.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "axisym/splines/arc_length.hpp"
#include "common/shapes/ellipsoid.hpp"

namespace tubule::axisym {

Curve spheroid(double reduced_volume, bool prolate) {
    if (!(reduced_volume > 0 && reduced_volume < 1))
        throw std::invalid_argument(fmt::format("a spheroid cannot have a reduced volume of {}", reduced_volume));
    // Area of the spheroid with a = 1, c = q.
    const auto area = [&](double q) {
        const double e = std::sqrt(prolate ? 1 - 1 / (q * q) : 1 - q * q);
        return 2 * pi * (prolate ? 1 + q / e * std::asin(e) : 1 + (1 - e * e) / e * std::atanh(e));
    };
    double low = 0, high = 1;  // of 1/q or q
    for (int k = 0; k < 60; ++k) {
        const double middle = (low + high) / 2, q = prolate ? 1 / middle : middle;
        (8 * std::pow(pi, 1.5) * q / std::pow(area(q), 1.5) < reduced_volume ? low : high) = middle;
    }
    const double q = prolate ? 1 / low : low, a = std::sqrt(4 * pi / area(q));
    return meridian(Ellipsoid{a, a, a * q});
}

Curve pear(double reduced_volume) {
    if (!(reduced_volume > std::sqrt(0.5) && reduced_volume < 1))
        throw std::invalid_argument(fmt::format("two spheres cannot have a reduced volume of {}", reduced_volume));
    double low = 0, high = pi / 4;  // radii cos a, sin a
    for (int k = 0; k < 60; ++k) {
        const double a = (low + high) / 2;
        (std::pow(std::cos(a), 3) + std::pow(std::sin(a), 3) > reduced_volume ? low : high) = a;
    }
    const double R1 = std::cos(low), R2 = std::sin(low), neck = 0.25 * R2;
    // The circle of the neck is as wide as the neck itself and touches both spheres.
    const double middle = 2 * neck, up = std::sqrt((R1 + neck) * (R1 + neck) - middle * middle),
                 down = std::sqrt((R2 + neck) * (R2 + neck) - middle * middle);
    const double turn1 = pi - std::atan2(middle, up), turn2 = pi - std::atan2(middle, down);
    const double first = R1 * turn1, second = neck * (turn1 + turn2 - pi), third = R2 * turn2,
                 total = first + second + third;
    Curve m;
    m.seams = {first / total, (first + second) / total};
    m.at = [=](double t) {
        const double s = t * total;
        const auto on_circle = [&](double r, double z, double radius, double angle, double sign) {
            return std::array{r + radius * std::sin(angle), sign * total * std::cos(angle),
                              z - radius * std::cos(angle), sign * total * std::sin(angle)};
        };
        if (s <= first) return on_circle(0, 0, R1, s / R1, 1);  // angles from the south pole
        if (s >= first + second) return on_circle(0, up + down, R2, pi - (total - s) / R2, 1);
        return on_circle(middle, up, neck, turn1 - pi - (s - first) / neck, -1);
    };
    return m;
}

Curve bowl(double thickness, double opening) {
    if (!(thickness > 0 && thickness < 1 && opening > 0 && opening < pi))
        throw std::invalid_argument("a bowl needs a thickness between 0 and 1 and an opening between 0 and pi");
    const double inner = 1 - thickness, rim = thickness / 2, middle = 1 - rim;
    const double total = opening + pi * rim + inner * opening;
    const double first = opening / total, second = (opening + pi * rim) / total;
    Curve m;
    m.seams = {first, second};
    m.at = [=](double t) {
        const double s = t * total;
        if (t <= first) return std::array{std::sin(s), total * std::cos(s), -std::cos(s), total * std::sin(s)};
        if (t >= second) {
            const double angle = (total - s) / inner;
            return std::array{inner * std::sin(angle), -total * std::cos(angle), -inner * std::cos(angle),
                              -total * std::sin(angle)};
        }
        // Around the middle of the rim, from the outward direction over the top to the inward one.
        const double angle = opening + (s - opening) / rim;
        return std::array{middle * std::sin(opening) + rim * std::sin(angle), total * std::cos(angle),
                          -middle * std::cos(opening) - rim * std::cos(angle), total * std::sin(angle)};
    };
    return m;
}

std::optional<Family> family_of(const Curve& cell, double reduced_volume) {
    if (reduced_volume > 1 - volume_off_sphere) return std::nullopt;
    // Distances relative to the largest radius, below which a profile is symmetric and a pole is not dented.
    constexpr double symmetric = 0.02, dented = 1e-3;
    constexpr int intervals = 200;
    const ArcLength arc(cell);
    Eigen::Matrix2Xd x(2, intervals + 1);
    for (int i = 0; i <= intervals; ++i) {
        const auto [r, z] = arc.point(static_cast<double>(i) / intervals);
        x.col(i) << r, z;
    }
    const double width = x.row(0).maxCoeff(), low = x.row(1).minCoeff(), high = x.row(1).maxCoeff();
    const double south = x(1, 0), north = x(1, intervals);
    Eigen::Matrix2Xd image = x.rowwise().reverse();
    image.row(1) = (south + north - image.row(1).array()).matrix();
    if ((x - image).cwiseAbs().maxCoeff() < symmetric * width)
        return high - low > 2 * width ? Family::prolate : Family::oblate;
    const double dent = std::max(std::min(south, north) - low, high - std::max(south, north));
    return dent > dented * width ? Family::stomatocyte : Family::pear;
}

std::string_view name(Family family) {
    static constexpr std::array<std::string_view, 4> names{"prolate", "oblate", "stomatocyte", "pear"};
    return names[static_cast<std::size_t>(family)];
}

}  // namespace tubule::axisym
