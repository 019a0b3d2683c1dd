// The parts of `tubule stability`: what is asked, and one report for each kind of answer.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/case/problem.hpp"
#include "common/case/units.hpp"
#include "common/result/result.hpp"
#include "common/theory/dispersion.hpp"

namespace tubule {

inline constexpr double largest_number = 1e100;  // products with it are numbers
inline constexpr int most_modes = 100;

// Throws std::invalid_argument unless low <= value <= high. `option` names it.
void require_within(const std::string& option, double value, double low, double high);

// Many fields: one for each option of the command.
struct StabilityOptions {
    std::string file, model, q, fit, plot;
    std::vector<std::string> sets;
    std::optional<double> Re, gamma, tension, kT;
    std::optional<int> waves, rates;
    std::optional<long> frame;
    int modes = 2;
    bool numerical = false, csv = false, json = false;
};

// The case, and the frame of a result that is asked about; `result` where all of it is at hand.
struct StabilitySubject {
    Problem c;
    bool case_is_known = true;  // not if a result to be fitted has a case of another version's keys
    std::optional<Result> result = {};
    std::optional<Record> frame = {};
};

// A tube whose waves are known in closed form.
struct TubeSubject {
    theory::UniformTube tube;
    double length = 1;
    std::vector<TubeMode> waves;    // of the case, largest amplitude first
    std::optional<double> tension;  // as asked, or as the frame has it
    std::string tension_source;     // of the above
    double end = 0;                 // until when the case runs; 0: nothing moves
    std::optional<Scales> scales;   // of what is printed in words
};

// What the command prints. Throws std::invalid_argument for what cannot be asked, SolveError where an equilibrium is
// not found.
std::string stability_answer(const StabilityOptions& options, StabilitySubject subject);
// The frame of a result that the options name, counted from the end where negative. Throws std::invalid_argument.
StabilitySubject stability_subject(Result result, const StabilityOptions& options);

// Reports throw std::invalid_argument for what cannot be asked. `models`: the case with each model that is asked about.
std::string tube_report(const StabilityOptions& options, const TubeSubject& subject,
                        const std::vector<Problem>& models);
std::string sphere_report(const StabilityOptions& options, const theory::UniformSphere& sphere,
                          const std::optional<Scales>& scales, const std::vector<Problem>& models);
std::string spectrum_report(const StabilityOptions& options, const StabilitySubject& subject,
                            const std::vector<Problem>& models);
std::string surface_report(const StabilityOptions& options, const StabilitySubject& subject,
                           const std::vector<Problem>& models);
std::string fit_report(const StabilityOptions& options, const StabilitySubject& subject);
// What the picture of --plot is drawn from, as JSON.
std::string tube_curves(const StabilityOptions& options, const TubeSubject& subject,
                        const std::vector<Problem>& models);

// <a^2> of the displacement a phi with INT phi^2 dS = A, theory.md (8.12). Throws std::invalid_argument, with the
// name of the mode, where an eigenvalue of this scale is not positive: the shape is no minimum.
double mean_square(double kT, double eigenvalue, double scale, double area, const std::string& mode);
void refuse_motion(const std::string& why);  // of a shape that is asked about at a kT

// One mode: its growth rate and its m; -1 for a shape without an axis.
struct SlowMode {
    double rate;
    int m;
    double error = -1;  // estimated; -1: unknown
    double frequency = 0, frequency_error = -1;
};
// Rows of a table of them.
std::string words_of_modes(const std::vector<SlowMode>& modes, const std::optional<Scales>& scales);

// Name and numbers of its model.
std::string words_of_model(const Problem& c);

}  // namespace tubule
