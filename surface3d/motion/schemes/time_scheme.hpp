// Time schemes: what they have in common, and how they are found by name. README.md says how to add one.
#pragma once

#include <memory>

#include "common/case/surface_choices.hpp"
#include "common/result/record.hpp"
#include "surface3d/motion/moving_surface.hpp"

namespace tubule::surface3d {

// Moves a surface on one mesh. A step begins from any state, of which it is a function alone, so that a step can be
// refused and tried again; what a scheme knows of steps before is in the state (SchemeMemory). From a state without its
// memory, initially, on a new mesh or by another scheme, a scheme makes a first step.
class TimeScheme {
public:
    TimeScheme(const CurvedMesh& mesh, const SurfaceLaw& law, const Bending& bending, const MotionControl& control)
        : surface_(mesh, law, bending, control) {}
    virtual ~TimeScheme() = default;
    TimeScheme(const TimeScheme&) = delete;
    TimeScheme& operator=(const TimeScheme&) = delete;

    // SolveError where a system cannot be solved, or area or volume cannot be kept to 1e-8.
    virtual MotionStep step(const MotionState& from, double tau) = 0;

    MovingSurface& surface() { return surface_; }

private:
    MovingSurface surface_;
};

// std::invalid_argument for a law or an energy that the scheme has no equations for.
std::unique_ptr<TimeScheme> make_scheme(Scheme scheme, const CurvedMesh& mesh, const SurfaceLaw& law,
                                        const Bending& bending, const MotionControl& control);

// What the scheme remembers of `state`, which it made. Throws as RecordReader.
std::shared_ptr<const SchemeMemory> restored_memory(Scheme scheme, const RecordReader& in, const MotionState& state);

// For the file of a scheme, which defines scheme_type() of its line in `schemes` (common/case/surface_choices.hpp):

struct SchemeType {
    std::unique_ptr<TimeScheme> (*make)(const CurvedMesh&, const SurfaceLaw&, const Bending&, const MotionControl&);
    std::shared_ptr<const SchemeMemory> (*restore)(const RecordReader&, const MotionState&);
};

// A memory that lists its fields once: Own::fields(Fields& f, Own& own, const MotionState& state), see record.hpp.
template <class Own>
class ListedMemory : public SchemeMemory {
public:
    void save(RecordWriter& out, const MotionState& state) const override {
        Own::fields(out, static_cast<const Own&>(*this), state);
    }
};

struct NoMemory {};

// The memory of a state that this scheme made, else nullptr.
template <class Memory>
const Memory* memory_of(const MotionState& state) {
    return dynamic_cast<const Memory*>(state.memory.get());
}

template <class Made, class Memory = NoMemory>
SchemeType scheme_type_of() {
    return {[](const CurvedMesh& mesh, const SurfaceLaw& law, const Bending& bending, const MotionControl& control)
                -> std::unique_ptr<TimeScheme> { return std::make_unique<Made>(mesh, law, bending, control); },
            [](const RecordReader& in, const MotionState& state) -> std::shared_ptr<const SchemeMemory> {
                if constexpr (std::is_same_v<Memory, NoMemory>) {
                    return nullptr;
                } else {
                    auto memory = std::make_shared<Memory>();
                    Memory::fields(in, *memory, state);
                    return memory;
                }
            }};
}

template <Scheme scheme>
SchemeType scheme_type();

}  // namespace tubule::surface3d
