// What a case is expected to take, before it runs.
#pragma once

#include <optional>
#include <string>

#include "common/case/problem.hpp"
#include "common/result/record.hpp"
#include "common/run/forecast.hpp"

namespace tubule {

// Takes a few seconds at most: of surfaces in motion a pilot run (surface3d/run/motion_forecast), of all else the first
// seconds of the run itself. Throws as an engine and its run; Paused where a PauseWatch of this thread ends it.
Forecast forecast(const Problem& c);

// For a surface at rest whose triangles are given in number; nothing for all else.
std::optional<Forecast> forecast_at_rest(const Problem& c);

// What the frames that a case asks for take, where that is much, in words: told by the first of them. Else empty.
std::string cost_of_frames(const Problem& c, const Record& first);

// "about 180 triangles of order 4; about 41 steps, 5 s, 120 MB", and whether finer runs may follow
std::string words(const Forecast& f);

}  // namespace tubule
