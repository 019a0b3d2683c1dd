// Random perturbations of tubes and spheres: modes with random amplitudes, the same for the same seed everywhere.
#pragma once

#include <cstdint>

namespace tubule {

struct Tube;
struct Sphere;

// Random sum of all modes up to these numbers.
struct ShapeNoise {
    double amplitude = 0;  // root of the mean square of what is added to the radius; of spheres relative to it
    int along = 8;         // n of tubes, l of spheres
    int around = 0;        // m
    int seed = 1;
};

// Adds the modes of the noise to the others, and forgets the noise.
void make_noise(Tube& tube);
void make_noise(Sphere& sphere);

// The keys of [[shape.noise]]; `along` is the name of the number along the axis.
template <class Keys>
void keys(Keys& k, ShapeNoise& noise, const char* along, int least) {
    k.number("amplitude", noise.amplitude, {.from = 0}, k.required);
    k.integer(along, noise.along, {.from = static_cast<double>(least), .to = 100});
    k.integer("m", noise.around, {.from = 0, .to = 100});
    k.integer("seed", noise.seed, {.from = 0, .to = 1e9});
}

}  // namespace tubule
