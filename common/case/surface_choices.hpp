// Choices of tier surface3d that a case may make.
#pragma once

#include <array>
#include <cstddef>
#include <string>
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
    irregular  // uniform, then randomly perturbed: for tests that nothing relies on a regular mesh
};

// A time scheme that moves a surface: its name in a case, and which keys a case may give with it. A new scheme is a
// line of `schemes` and a file in surface3d/motion/schemes/ (see its README).
struct SchemeEntry {
    std::string_view name;
    bool default_with_inertia = false, default_without_inertia = false;  // where a case names no scheme
    bool controls_steps = true;  // estimates its error; else a case gives discretisation.step
    bool controls_mesh = true;   // keeps triangles even, and the volume; else no new meshes are made
    bool with_inertia = true;    // else no fluid
    bool smooths = false;        // takes discretisation.smoothing
    int order = 2;               // of its errors in the step, at least
    int most_order = 2;          // and where it can have that of smooth motions
    bool general = true;         // else no gradient flow, no Stokes flow without friction, no terms but k20, k40, k42
};
inline constexpr std::array schemes{
    SchemeEntry{.name = "bdf2", .default_without_inertia = true},
    SchemeEntry{.name = "alpha", .default_with_inertia = true},
    SchemeEntry{.name = "bdf", .with_inertia = false, .most_order = 4},
    SchemeEntry{.name = "euler", .order = 1},
    SchemeEntry{.name = "paper",
                .controls_steps = false,
                .controls_mesh = false,
                .smooths = true,
                .order = 1,
                .general = false},
};

enum class Scheme : std::size_t {};  // a line of `schemes`

consteval Scheme scheme_named(std::string_view name) {
    for (std::size_t i = 0; i < schemes.size(); ++i)
        if (schemes[i].name == name) return Scheme{i};
    throw "no such line in `schemes`";
}

constexpr const SchemeEntry& entry(Scheme scheme) {
    return schemes.at(static_cast<std::size_t>(scheme));
}

constexpr Scheme default_scheme(bool inertia) {
    const auto is_default = inertia ? &SchemeEntry::default_with_inertia : &SchemeEntry::default_without_inertia;
    std::size_t i = 0;
    while (!(schemes.at(i).*is_default)) ++i;
    return Scheme{i};
}

// The modulus of the first term in use that the paper's scheme has no force for; "" if there is none.
inline std::string term_beyond_paper(const Bending& energy) {
    if (energy.kg != 0) return "energy.kg";
    for (std::size_t i = 0; i < count_terms(energy); ++i) {
        const std::string key = term_key(energy, i);
        const bool known = key == "energy.k20" || key == "energy.k40" || key == "energy.k42";
        if (!known && modulus(energy, i) != 0) return key;
    }
    return {};
}

}  // namespace tubule
