// Shape "profile": a surface of revolution from points (r, z) in a file, CSV, with a smooth curve fitted to them; and
// the spontaneous curvature, where the file has that of each point.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/formula/formula.hpp"
#include "common/shapes/perturbed_curve.hpp"

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

// A smooth curve near the points, in the fraction s of its arc length.
struct FittedProfile {
    Curve curve;
    double distance = 0;  // of the points, at most, from the curve
    int points = 0, waves = 0;
    // H0 as a function of the part of the area below, 0 to 1, where the file has it; fitted by as few waves as suffice.
    std::shared_ptr<const Formula> H0 = {};
    double H0_distance = 0;  // of the values, at most

    std::string note() const;  // the report of the fit, a sentence
};

// Where this text of a file has a column H0: "FILE:LINE:COLUMN" of its heading; else empty.
std::string place_of_H0(const std::filesystem::path& path, const std::string& text);
// Throws ProfileError, with the path as the name of the text.
FittedProfile read_profile(const std::filesystem::path& path, const std::string& text, const ProfileFile& file);

// The curve through enough points that errors between them are below that of the fit.
PerturbedCurve curve_through(const FittedProfile& profile);
// On that curve, as functions_along() has functions: its second one is the part of the area below, without that of s
// where the curve is no cell.
CurveFunctions area_below(const FittedProfile& profile, const PerturbedCurve& curve);

}  // namespace tubule
