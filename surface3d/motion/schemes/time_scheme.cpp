#include "surface3d/motion/schemes/time_scheme.hpp"

#include <array>
#include <utility>

namespace tubule::surface3d {
namespace {

// In the order of `schemes`; a line there whose file is missing is found by the linker.
template <std::size_t... i>
std::array<SchemeType, sizeof...(i)> all_types(std::index_sequence<i...>) {
    return {scheme_type<static_cast<Scheme>(i)>()...};
}

const SchemeType& type_of(Scheme scheme) {
    static const auto types = all_types(std::make_index_sequence<schemes.size()>());
    return types.at(static_cast<std::size_t>(scheme));
}

}  // namespace

std::unique_ptr<TimeScheme> make_scheme(Scheme scheme, const CurvedMesh& mesh, const SurfaceLaw& law,
                                        const Bending& bending, const MotionControl& control) {
    return type_of(scheme).make(mesh, law, bending, control);
}

std::shared_ptr<const SchemeMemory> restored_memory(Scheme scheme, const RecordReader& in, const MotionState& state) {
    return type_of(scheme).restore(in, state);
}

}  // namespace tubule::surface3d
