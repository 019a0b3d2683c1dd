// Shape "profile": a surface of revolution from points (r, z) in a file, CSV, with a smooth curve fitted to them; and
// the spontaneous curvature, where the file has that of each point.
#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/formula/formula.hpp"
#include "common/shapes/meridian.hpp"
#include "common/shapes/profile_curve.hpp"

namespace tubule {

struct ProfileFile {
    static constexpr const char* kind = "profile";
    std::string path;                 // relative to the case file
    std::optional<double> length;     // of a period; without, the profile is closed
    std::optional<double> tolerance;  // how far the curve may be from the points; by default 1e-4 of the largest extent
    std::optional<double> H0_tolerance;  // how far H0 may be from its values; by default 1e-4 of the largest |H0|
};

template <class Keys>
void keys(Keys& k, ProfileFile& file) {
    k.text("path", file.path, k.required);
    k.number("length", file.length, {.above = 0});
    k.number("tolerance", file.tolerance, {.above = 0});
    k.number("H0_tolerance", file.H0_tolerance, {.above = 0});
}

// What is wrong with such a file: "FILE:LINE:COLUMN: what".
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
    // H0 as a function of the part of the area below, 0 to 1, where the file has it; fitted by as few waves as suffice.
    std::shared_ptr<const Formula> H0 = {};
    double H0_distance = 0;  // of the values, at most

    std::string note() const;  // the report of the fit, a sentence
};

// Where this text of a file has a column H0: "FILE:LINE:COLUMN" of its heading; else empty.
std::string place_of_H0(const std::filesystem::path& path, const std::string& text);
// Throws ProfileError, with the path as the name of the text.
SmoothProfile read_profile(const std::filesystem::path& path, const std::string& text, const ProfileFile& file);

// r, dr/ds, z, dz/ds
std::array<double, 4> point_at(const SmoothProfile& profile, double s);
Meridian meridian(const SmoothProfile& profile);
// The curve through enough points that errors between them are below that of the fit.
ProfileCurve profile_curve(const SmoothProfile& profile);
// On that curve, as along_curve() has functions: its second one is the part of the area below, without that of s where
// the curve is no cell.
BlendedCurve area_below(const SmoothProfile& profile, const ProfileCurve& curve);

}  // namespace tubule
