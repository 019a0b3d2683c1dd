// What a case reads besides itself: the frame of a result that is its shape, and what of its files a result keeps.
#pragma once

#include <optional>
#include <string>

#include "common/case/case.hpp"
#include "common/result/result.hpp"

namespace tubule {

// A frame without what only its own run can resume from.
struct StartFrame {
    Record record;
    std::optional<SurfaceCells> cells;  // of its mesh, if it has one
};
// The frame of a case whose shape is a ResultFrame. Throws CaseError that names the key to blame.
StartFrame start_frame(const Case& c);

// The profile of its frame with the modes of its shape. Throws CaseError for modes that it cannot have,
// std::invalid_argument for a frame that has no profile.
PerturbedCurve disturbed_curve(const Case& c, const Record& frame);

// A frame of a result in memory, as what a case reads whose shape is this frame: then it needs no file.
std::shared_ptr<const CaseInput> frame_as_input(const ResultFrame& shape, const Result& result);

// What the case reads, as it is now: with its bytes if they are few. Nothing where it reads nothing, or what cannot be
// read.
std::shared_ptr<const CaseInput> current_input(const Case& c);

// "p.csv has changed since ...", if what the case reads is there and is another one than a result has; else empty.
std::string changed_input(const Case& c, const CaseInputs& of_result);

// The case as a result keeps it.
CaseText kept_case(const Case& c);
// The case as TOML that stands alone, also of a result that has none such; empty where that one can no longer be read.
std::string resolved_case(const CaseText& c);

}  // namespace tubule
