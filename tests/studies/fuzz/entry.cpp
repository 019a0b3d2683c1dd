// Coverage-guided fuzzing by libFuzzer: the environment variable TUBULE_TARGET names the target. With TUBULE_SEEDS, a
// folder, writes the target's seeds there and ends.
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>

#include "tests/studies/fuzz/targets.hpp"

namespace {

const tubule::fuzz::Target& chosen() {
    const char* name = std::getenv("TUBULE_TARGET");
    for (const auto& target : tubule::fuzz::targets())
        if (name && std::string(name) == target.name) return target;
    std::fputs("TUBULE_TARGET must be one of:\n", stderr);
    for (const auto& target : tubule::fuzz::targets()) std::fprintf(stderr, "%s\n", target.name);
    std::exit(2);
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int*, char***) {
    const auto& target = chosen();
    const char* folder = std::getenv("TUBULE_SEEDS");
    if (!folder) return 0;
    int number = 0;
    for (const std::string& seed : target.seeds())
        std::ofstream(std::string(folder) + "/seed_" + std::to_string(number++), std::ios::binary) << seed;
    std::exit(0);
}

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
    static const auto run = chosen().run;
    run({reinterpret_cast<const std::byte*>(data), size});
    return 0;
}
