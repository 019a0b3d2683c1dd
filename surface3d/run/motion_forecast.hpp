// What a run in motion is expected to take.
#pragma once

#include "common/run/forecast.hpp"
#include "surface3d/run/start.hpp"

namespace tubule::surface3d {

// By a pilot run of a few seconds at most, on few triangles and with a loose tolerance: the number of steps hardly
// depends on the triangles, and follows from the tolerance by the order of the scheme. If what is stated of the error
// then misses what is asked, and a finer run follows, it takes longer than that: so it may be where many steps of a
// fluid lead to surfaces that are rough for the mesh of the pilot run. Throws Paused where a PauseWatch of this thread
// ends a pilot run.
Forecast forecast_motion(const Problem& c, const Start& start);

// Whether the run might take more than a minute, by its settings and its initial shape alone.
bool may_be_long(const Problem& c, const Start& start);

}  // namespace tubule::surface3d
