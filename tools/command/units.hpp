// In which units tables of results are shown.
#pragma once

#include <optional>
#include <string>

#include "common/case/units.hpp"
#include "common/result/result.hpp"
#include "tools/command/output.hpp"

namespace tubule {

// Those of the case of a result, and with --units others: "none", or keys of [units] with their values, as
// "length=50 nm,bending_rigidity=20 kT". Throws CaseError; none where the case has keys of another version.
std::optional<Scales> shown_scales(const CaseText& of, const std::string& file, const std::string& option = "");

// A unit of every series, by its dimensions as the catalogue has them: {"energy": {"scale": 20, "unit": "kT"}, ...}.
Json json_of(const Scales& scales);

// A value in its unit, with so many digits.
std::string with_unit(double value, const LabUnit& unit, int digits);

}  // namespace tubule
