// Choices of tier surface3d that a case may make.
#pragma once

#include <string_view>

#include "common/energy/bending.hpp"

namespace tubule {

// How curvature is recovered from the nodes of curved elements (docs/curvature.md compares them).
enum class Recovery {
    elementwise,  // second derivatives of each element, projected: the paper's
    normal,       // B = -grad nu of the projected normal, then projected
    weak,         // (H nu, Z) = -(grad X, grad Z), and B likewise from nu by parts
    lifted,       // element by element plus the kinks between elements, projected
    patch_nodal,  // from polynomial graphs through the nodes around each vertex, at the nodes
    patch,        // the same, projected: the default
    exact         // at the nodes, of a shape that is known exactly
};

// How a mesh is made for a shape.
enum class MeshKind {
    uniform,   // triangles of about equal size
    graded,    // small where the curvature varies within a short distance
    irregular  // uniform, then disturbed at random: to see that nothing hangs on regular neighbours
};

// How a surface is moved.
enum class Scheme {
    bdf2,   // H and K implicit, backward differences of second order
    alpha,  // the same, the generalised alpha method, which hardly damps waves
    euler,  // the same of first order
    paper   // the paper's: Euler steps with K explicit and smoothed
};

// The first term in use that the paper's scheme has no force for; "" if there is none.
inline std::string_view term_beyond_paper(const Bending& energy) {
    std::string_view beyond;
    for_each_bending_term([&](std::size_t i, const auto& term) {
        const std::string_view key = term.key;
        const bool known = key == "k20" || key == "k40" || key == "k42";
        if (!known && energy.k[i] != 0 && beyond.empty()) beyond = key;
    });
    return beyond;
}

}  // namespace tubule
