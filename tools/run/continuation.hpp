// Which result a run goes on with, and which it replaces: docs/results.md, "Runs that go on".
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/case/case.hpp"
#include "common/result/result.hpp"

namespace tubule {

// A key whose value is another one in another case; "absent" where it has none.
struct Difference {
    std::string key, there, here;
};

// All values of a case under their full keys as in --set, as TOML, defaults included, but for [about], [units],
// [expect] and time.limit.
std::map<std::string, std::string> values_of(const Case& c);

// The keys in which two cases differ, of those.
std::vector<Difference> differences(const Case& there, const Case& here);

// "energy.k42 is 0.06 there, 0.1 here; ..."; the first few.
std::string words(const std::vector<Difference>& differences);

// Whether the file is HDF5, and so no case file. Never throws.
bool is_hdf5(const std::filesystem::path& file);

// The case of a result with more overrides, which replace those of the same key. Throws CaseError.
Case case_of_result(const Result& result, const std::filesystem::path& file, const std::vector<std::string>& sets);

// What a result has of the files that its case reads; nothing where there is none to go on with.
CaseInputs inputs_to_resume(const std::filesystem::path& file);

// The model that stands for model.kind = "auto" in the case of a result, if it has one.
std::optional<ModelKind> chosen_before(const std::filesystem::path& file);

// Which frame a number names: negative ones count from the last. Throws std::runtime_error if there is no such frame.
std::size_t frame_named(const Result& result, long number);

// How a result came to the state in which it is; nothing if it is unfinished.
std::optional<Stop> stop_of(const Result& result);

// Whether the run of a result goes on with this case: false if it is complete. Throws CaseError where it must not: the
// case is another one but for its end, outputs, limits, [about], [units] and [expect], or the end is earlier than what
// the result has reached, or later where nothing can follow.
bool goes_on(const Case& c, const Result& result, const std::filesystem::path& file);

// Output times of the case that a run which goes on from here no longer passes and that have no frame.
std::vector<double> missed_outputs(const Case& c, const Result& result, double from);

// How the case of a result differs from this one, in words; empty if it does not.
std::string other_case(const Case& c, const CaseText& of_result);

}  // namespace tubule
