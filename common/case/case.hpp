// A case as plain, validated data. See docs/case_files.md for the keys.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/case/case_input.hpp"
#include "common/case/equilibrium_choices.hpp"
#include "common/case/surface_choices.hpp"
#include "common/case/units.hpp"
#include "common/energy/bending.hpp"
#include "common/model/model.hpp"
#include "common/shapes/capsule.hpp"
#include "common/shapes/dumbbell.hpp"
#include "common/shapes/ellipsoid.hpp"
#include "common/shapes/formula_shape.hpp"
#include "common/shapes/mesh_file.hpp"
#include "common/shapes/patch.hpp"
#include "common/shapes/perturbed_curve.hpp"
#include "common/shapes/profile_file.hpp"
#include "common/shapes/result_frame.hpp"
#include "common/shapes/sphere.hpp"
#include "common/shapes/torus.hpp"
#include "common/shapes/tube.hpp"
#include "common/solve/stop.hpp"

#if !defined(EIGEN_MAX_ALIGN_BYTES) || EIGEN_MAX_ALIGN_BYTES != 64
#error Tubule is compiled with EIGEN_MAX_ALIGN_BYTES=64 EIGEN_MAX_STATIC_ALIGN_BYTES=64; its CMake targets say so
#endif

namespace tubule {

enum class Tier { axisym, surface3d, automatic };

using Shape = std::variant<Tube, Sphere, Ellipsoid, Torus, Capsule, Dumbbell, Patch, FormulaShape, ProfileFile,
                           MeshFile, ResultFrame>;

inline bool is_tube(const Shape& shape) {
    return std::holds_alternative<Tube>(shape);
}
// Whether the shape is, or may be, a patch.
inline bool may_have_rim(const Shape& shape) {
    return std::holds_alternative<Patch>(shape) || std::holds_alternative<ResultFrame>(shape);
}
inline bool has_two_rings(const Shape& shape) {
    const auto* patch = std::get_if<Patch>(&shape);
    return patch && patch->second_radius;
}
// Whether the shape is, or may be, a periodic tube: of a result that is not known before it is read.
inline bool may_have_period(const Shape& shape) {
    const auto* formula = std::get_if<FormulaShape>(&shape);
    const auto* profile = std::get_if<ProfileFile>(&shape);
    return is_tube(shape) || std::holds_alternative<ResultFrame>(shape) || (formula && formula->length) ||
           (profile && profile->length);
}

// How a model with inertia begins.
enum class InitialVelocity {
    rest,
    rotation,  // about the z axis, rigidly
    result     // that of the frame which is the shape
};
struct Velocity {
    InitialVelocity initial = InitialVelocity::rest;
    double omega = 0;  // angular velocity of a rotation
};

// What the parameter of a profile is.
enum class Parametrisation {
    graph,    // z
    even,     // in proportion to arc length
    material  // goes with the flow
};

struct Accuracy {
    double energy = 1e-4;             // asked error of the energy at all times, relative to E_ref
    bool relative_to_energy = false;  // E_ref is |E(0)|, else theory.md (11.1)
    bool estimate = true;  // of surfaces in motion: whether the error is estimated, by coarser runs beside the run
    double r_min = 1e-3;   // floor of the neck radius, below which the run stops with pinch-off; 1e-2 in tier surface3d
};

// Explicit choices of tier axisym; if absent, the required accuracy decides.
struct Discretisation {
    std::optional<int> elements;                     // over one period of the tube; switches adaptive refinement off
    int order = 5;                                   // polynomial degree of the spline: 3, 5, 7
    std::optional<int> smoothness;                   // continuous derivatives at knots, 1 ... order-1; default order-1
    std::optional<double> time_tolerance;            // relative tolerance of the time integrator
    bool symmetry = true;                            // solve one cell of a periodic or mirror symmetric shape
    std::optional<Parametrisation> parametrisation;  // by default as the model and the shape have it
};

// The same of tier surface3d.
struct SurfaceDiscretisation {
    std::optional<int> elements;  // about how many triangles
    std::optional<int> order;     // of the elements: 2, 3, 4; default: see Problem
    MeshKind mesh = MeshKind::uniform;
    // Single shapes only:
    Recovery recovery = Recovery::patch;
    double smoothing = 0;  // length (squared) of the paper's smoothing step of H and K; 0: none. Of its scheme, too
    // Motion only:
    std::optional<Scheme> scheme;          // by default that of the model, see default_scheme()
    std::optional<double> step;            // the same for all steps; switches their control off
    std::optional<double> time_tolerance;  // error of the positions in a step, relative to the root of the area
    std::optional<double> relaxation;      // time in which the mesh becomes even
    bool follow_curvature = false;         // or finer where the surface is more curved
    bool coarsen = false;                  // fewer triangles when the motion has become smooth
};

// What integrates a profile in time: SUNDIALS' IDA (backward differences of variable order), or Rodas5P, a Rosenbrock
// method of order 5 for graphs r(z).
enum class Integrator { ida, rosenbrock };

struct TimeSpan {
    double end = 0;                    // 0: none, nothing moves
    std::vector<double> output;        // times of frames; 0 and end are always written
    std::optional<double> stationary;  // stop when the energy could change by less than this * E_ref until end
    std::optional<double> limit;       // wall clock seconds
    // Tier axisym only:
    Integrator integrator = Integrator::ida;
    int max_order = 5;  // IDA's
};

// Tier "auto": when an axisymmetric run continues in three dimensions.
struct AutoChoices {
    double noise = 1e-6;    // initial amplitude of every mode m, relative to the largest radius
    double largest = 1e-2;  // amplitude at which three dimensions take over, likewise
    int modes = 4;          // modes e^{i m phi} with m = 1 ... modes
};

// Where a run of tier surface3d begins instead of at the shape: not in case files, but from tier "auto".
struct Handover {
    PerturbedCurve curve;
    double time = 0;
    double reference_energy = 0;  // E_ref of the whole run
    double work = 0;              // that loads have done until then
};

// Expected results of a run: checked by `tubule run --expect`.
struct Expectation {
    std::string series;          // e.g. "energy", "r_min"
    std::optional<double> time;  // absent: at the end
    double value = 0;
    std::optional<double> rel, abs;
};
struct Expect {
    std::optional<Stop> stop;
    std::vector<Expectation> values;
};

// Many fields: one for each table of a case file.
struct Case {
    std::string path;                           // where it was read from, for messages
    std::string text;                           // the file, verbatim
    std::vector<std::string> sets;              // --set key=value overrides, in order
    std::map<std::string, std::string> places;  // of the keys, "file:line:column" or "--set ...": see complaint()
    std::shared_ptr<const CaseInput> input;     // of the file of the shape, where it has been read or a result has it

    Tier tier = Tier::axisym;
    std::string title, source;
    std::optional<Units> units;
    Bending energy;
    Model model;
    Velocity velocity;
    Shape shape;
    Accuracy accuracy;
    Discretisation discretisation;  // of tier axisym
    SurfaceDiscretisation surface;  // of tier surface3d
    AutoChoices automatic;          // of tier "auto"
    TimeSpan time;
    std::optional<EquilibriumChoices> equilibrium;  // instead of a motion
    Expect expect;
    std::optional<Handover> handover;

    bool moves() const { return time.end > 0; }
};

// Whether a run of tier axisym can be one of a graph r(z).
inline bool can_be_graph(const Case& c) {
    const MotionLaw law = motion_law(c.model);
    return is_tube(c.shape) && law.unconstrained() && !law.loads_change() && !law.pressure_of_volume &&
           !c.energy.H0_varies() && !c.energy.alpha && c.energy.potentials.empty();
}
// Whether it is, unless the profile overhangs.
inline bool begins_as_graph(const Case& c) {
    return can_be_graph(c) &&
           c.discretisation.parametrisation.value_or(Parametrisation::graph) == Parametrisation::graph;
}

}  // namespace tubule
