// What a case is expected to take, before it runs.
#pragma once

#include <optional>
#include <string>

#include "common/case/problem.hpp"
#include "common/result/record.hpp"
#include "surface3d/run/start.hpp"

namespace tubule {

struct Forecast {
    std::string resolution;                // in words
    std::optional<double> steps, seconds;  // of wall time, of moving surfaces on a quiet machine; none: it is not known
    double bytes = 0;
    std::string ill_posed;    // why the run stops at its start, or empty
    bool finer_runs = false;  // may follow, which are not counted
};

// Takes a few seconds at most: of surfaces in motion trial runs on few triangles, of all else the first seconds of the
// run itself. Throws as an engine and its run; Paused where a PauseWatch of this thread ends it.
Forecast forecast(const Problem& c);

// For a surface whose run may take more than a minute or need finer ones; nothing for others, or where a tenth of
// time.limit does not suffice to find out.
std::optional<Forecast> forecast_if_long(const Problem& c, const surface3d::Start& start);

// What the frames that a case asks for take, where that is much, in words, by the first of them; else empty.
std::string cost_of_frames(const Problem& c, const Record& first);

// "about 180 triangles of order 4; about 41 steps, 5 s, 120 MB", and whether finer runs may follow
std::string words(const Forecast& f);

}  // namespace tubule
