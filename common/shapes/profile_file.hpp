// Shape "profile": a surface of revolution from points (r, z) in a file, CSV, with a smooth curve fitted to them.
#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/shapes/meridian.hpp"
#include "common/shapes/profile_curve.hpp"

namespace tubule {

struct ProfileFile {
    static constexpr const char* kind = "profile";
    std::string path;                 // relative to the case file
    std::optional<double> length;     // of a period; without, the profile is closed
    std::optional<double> tolerance;  // how far the curve may be from the points; by default 1e-4 of the largest extent
};

template <class Keys>
void keys(Keys& k, ProfileFile& file) {
    k.text("path", file.path, k.required);
    k.number("length", file.length, {.above = 0});
    k.number("tolerance", file.tolerance, {.above = 0});
}

// What is wrong with such a file: "FILE:LINE: what".
class ProfileError : public std::invalid_argument {
public:
    using std::invalid_argument::invalid_argument;
};

// Sums of waves in the fraction s of the arc length: of a cell r = SUM a_k sin(k pi s), z = SUM b_k cos(k pi s), else
// r and z - length s are sums of cos(2 pi k s) and sin(2 pi k s).
struct SmoothProfile {
    ProfileCurve::Kind kind = ProfileCurve::Kind::cell;
    double length = 0;
    Eigen::VectorXd r, z;  // coefficients: of a cell by k, else 1, cos, sin, cos, sin, ...
    double distance = 0;   // of the points, at most, from the curve
    int points = 0, waves = 0;

    std::string note() const;  // the report of the fit, a sentence
};

// Throws ProfileError.
SmoothProfile read_profile(const std::filesystem::path& path, const ProfileFile& file);

// r, dr/ds, z, dz/ds
std::array<double, 4> point_at(const SmoothProfile& profile, double s);
Meridian meridian(const SmoothProfile& profile);
// Through so many points that the fit counts for more than what is between them.
ProfileCurve profile_curve(const SmoothProfile& profile);

}  // namespace tubule
