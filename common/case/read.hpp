// Case files: TOML text to validated data and back. The keys are described in keys.hpp and docs/case_files.md.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/case/case.hpp"
#include "common/case/text.hpp"

namespace tubule {

// Bad input. The message starts with "file:line:column: " (or "--set key=value: " if an override
// caused it), and says what is wrong, what is allowed and, for a near miss, what was probably meant.
struct CaseError : std::runtime_error {
    explicit CaseError(const std::string& what) : std::runtime_error(printable(what)) {}
};

// Reads and validates a case; `sets` are overrides "a.b=value" applied to it first. Throws CaseError.
Case read_case(const std::filesystem::path& path, const std::vector<std::string>& sets = {},
               const CaseInputs& inputs = {});

// The same for a text in memory; `path` names it in messages. Of `inputs` it takes that of its shape, and reads the
// bytes there instead of the file.
Case parse_case(const std::string& text, const std::vector<std::string>& sets, const std::string& path,
                const CaseInputs& inputs = {});
CaseInputs inputs_of(const Case& c);

// The name under which the file of a shape is kept; empty if it has none.
std::string input_name(const Shape& shape);
// Where the file of a shape is, and its bytes, at most `most`. Throws CaseError.
std::filesystem::path beside(const Case& c, const std::string& path);
std::string shape_bytes(const Case& c, const std::string& path, std::size_t most);
// The smooth curve through the points of a file. Throws CaseError.
FittedProfile start_profile(const Case& c, const ProfileFile& file);

// What is wrong with a key, "shape.path" say, that only a later stage can find out, with its place or, where it is
// absent, that of its table.
CaseError complaint(const Case& c, const std::string& key, const std::string& what);

// The same of a spontaneous curvature that varies, which may come from the file of a profile.
CaseError complaint_about_H0(const Case& c, const std::string& what);

// The case as TOML text that stands alone: overrides applied, defaults written out. Comments are not kept.
std::string effective_toml(const Case& c);

}  // namespace tubule
