// Two results of any tiers against each other: shapes and outcomes.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/result/result.hpp"
#include "tools/compare/distance.hpp"

namespace tubule::compare {

// How the run stopped, by name; "unfinished" if it goes on or was killed. When: of an unfinished one, so far.
std::string stop_word(const Result& result);
double stop_time(const Result& result);

// E_ref as stated by the run; 0 if it is not.
double reference_energy(const Result& result);

// The estimated error of the energy, relative to E_ref, as the run states it.
std::optional<double> stated_error(const Result& result);

using FramePair = std::pair<std::size_t, std::size_t>;

// Frames at the same times, within a millionth of the later one's: the runs write them at times given in the case.
std::vector<FramePair> frames_in_common(const Result& a, const Result& b);

struct ShapeDifference {
    FramePair frames;
    double time = 0;  // of A's
    Distance distance;
    RigidMotion motion;                               // of B, with which it was compared,
    Eigen::Vector3d moved = Eigen::Vector3d::Zero();  // and how far that moves its centre (of a tube: its axis)
    std::optional<double> energy;  // difference, relative to E_ref of A; where the frames know their energies
};

bool know_energies(const Result& a, const Result& b, FramePair frames);

// Throws std::invalid_argument with the number and time of the frame if one holds no surface, or the two cannot be
// compared.
ShapeDifference compare_shapes(const Result& a, const Result& b, FramePair frames, bool align);

}  // namespace tubule::compare
