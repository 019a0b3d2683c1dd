// Ranks of a build without MPI: there are never any.
#include <cstdlib>
#include <string>
#include <utility>

#include "common/case/read.hpp"
#include "tools/scan/ranks.hpp"

namespace tubule {

std::optional<Ranks> Ranks::join() {
    for (const char* variable : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE"})
        if (const char* size = std::getenv(variable); size && std::string(size) != "1")
            throw CaseError(
                "this build cannot share work among the processes of an mpirun: install libopenmpi-dev and "
                "openmpi-bin, "
                "then run cmake --preset release && cmake --build --preset release; or run it without mpirun");
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
