// Stationary surfaces of the bending energy in three dimensions, as accurate as asked, and their slowest modes.
#pragma once

#include <functional>
#include <string>

#include "common/equilibrium/stationary_problem.hpp"
#include "common/solve/stop.hpp"
#include "surface3d/equilibrium/surface_spectrum.hpp"
#include "surface3d/equilibrium/surface_system.hpp"

namespace tubule::surface3d {

struct SurfaceEquilibriumSettings {
    double accuracy = 1e-4;     // of the energy, relative to E_ref
    int triangles = 0;          // exactly about these, and fewer to compare with; 0: as many as the accuracy needs
    int first_triangles = 160;  // to begin with
    int max_triangles = 20000;  // more are never taken
    bool descend = true;        // look for a minimum; if not, for a stationary shape near the initial one
    bool near = false;          // the initial shape is an equilibrium of a nearby problem, or of the other tier
    int modes = 0;              // slowest ones with errors; one without is always found
    MotionLaw law{.friction = 1, .inextensible = false, .keeps_volume = false};  // of the modes
};

struct SurfaceEquilibrium {
    CurvedMesh mesh;
    Eigen::VectorXd H0;  // at the nodes, where it varies
    double sigma = 0, lambda = 0, mu = 0;
    BeadState beads;
    EnergyValues values;                               // E with area differences
    double reference_energy = 0, estimated_error = 1;  // the latter relative to the former
    int iterations = 0;                                // of Newton, over all meshes
    // Spectrum of displacements along the normal: minus its values are the rates of the law.
    SurfaceSpectrum spectrum;
    std::vector<int> wave_numbers;  // of its vectors: see SurfaceSystem
    int held_motions = 0;
    // finished; or why this is not an equilibrium.
    Stop stop = Stop::solver_failed;
    std::string message;
};

// L of theory.md (3.16).
inline double length(const StationaryProblem& problem, const SurfaceEquilibrium& shape) {
    return problem.beads ? BeadEquations::distance(shape.beads.numbers) : shape.mesh.period;
}

// A mesh of the initial shape of about this many triangles.
using MakeMesh = std::function<CurvedMesh(int triangles)>;

// Newton's method on meshes of more and more triangles, until their energies agree as asked. Throws
// std::invalid_argument as check_problem().
SurfaceEquilibrium find_equilibrium(const StationaryProblem& problem, const MakeMesh& initial,
                                    const SurfaceEquilibriumSettings& settings);

// E_ref, theory.md (11.1).
double reference_energy(const StationaryProblem& problem, const SurfaceSystem& system, const Eigen::VectorXd& u);

}  // namespace tubule::surface3d
