#include "surface3d/run/run_surface.hpp"

#include <utility>
#include <variant>

#include "surface3d/run/motion_frame.hpp"
#include "surface3d/run/single_surface.hpp"

namespace tubule::surface3d {
namespace {

// For a surface that brings its own triangles: advice in the keys that it has.
void advise_given_triangles(const Problem& c, std::string& advice) {
    const auto* file = std::get_if<MeshFile>(&c.shape);
    const std::string more = !file          ? "begin with a frame of more triangles"
                             : file->remesh ? "set a larger shape.remesh"
                                            : "set shape.remesh, or give the file more triangles";
    for (const auto& [words, instead] : {std::pair<std::string, std::string>{"use more elements", more},
                                         {"try another discretisation.elements or", "try another"},
                                         {", or discretisation.mesh = \"graded\"", ""}})
        if (const auto at = advice.find(words); at != advice.npos) advice.replace(at, words.size(), instead);
}

}  // namespace

std::vector<std::string> series_names(const Problem& c) {
    return c.moves() ? motion_series(c).names() : single_series_names(c);
}

RunSummary run_surface(const Problem& c, RunObserver& observer, const Restart* restart) {
    return run_surface(c, Start(c), observer, restart);
}

RunSummary run_surface(const Problem& c, const Start& start, RunObserver& observer, const Restart* restart) {
    if (restart && !c.moves()) observer.discard();  // there is no partial state to resume from
    RunSummary s = c.moves() ? run_motion(c, start, observer, restart) : run_single(c, start, observer);
    if (!start.resizable()) advise_given_triangles(c, s.stop.advice);
    return s;
}

}  // namespace tubule::surface3d
