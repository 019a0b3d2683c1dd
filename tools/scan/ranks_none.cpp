// Ranks of a build without MPI: there are never any.
#include <cstdlib>
#include <utility>

#include "tools/scan/ranks.hpp"

namespace tubule {

std::optional<Ranks> Ranks::join() {
    return std::nullopt;
}
Ranks::Ranks(Ranks&&) noexcept = default;
Ranks::~Ranks() = default;
int Ranks::run(RankTasks&, const Packet&, const Compute&) {
    return 0;
}
void Ranks::dismiss() {}
void Ranks::serve(const std::function<Compute(const Packet&)>&) {}
void Ranks::abort(int status) {
    std::exit(status);
}

}  // namespace tubule
