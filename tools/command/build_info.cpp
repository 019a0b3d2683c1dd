#include "tools/command/build_info.hpp"

#include <SuiteSparse_config.h>
#include <dlfcn.h>
#include <fmt/core.h>
#include <gsl/gsl_version.h>
#include <hdf5.h>
#include <link.h>
#include <sundials/sundials_version.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "build_config.hpp"
#include "common/case/text.hpp"
#include "git_hash.hpp"

namespace tubule {
namespace {

std::string sundials() {
    char version[32] = "";
    SUNDIALSGetVersion(version, sizeof version);
    return version;
}

std::string suitesparse() {
    int v[3];
    SuiteSparse_version(v);
    return fmt::format("{}.{}.{}", v[0], v[1], v[2]);
}

std::string hdf5() {
    unsigned v[3];
    H5get_libversion(&v[0], &v[1], &v[2]);
    return fmt::format("{}.{}.{}", v[0], v[1], v[2]);
}

// The BLAS this process has loaded, with OpenBLAS' own words about its kernels and threads. A reference BLAS would
// make supernodal solvers several times slower. GSL's own gslcblas does not count, nothing of ours calls it.
std::string blas() {
    std::string found;
    dl_iterate_phdr(
        [](dl_phdr_info* info, std::size_t, void* data) {
            const std::string file = std::filesystem::path(info->dlpi_name).filename();
            if (file.find("blas") != std::string::npos && file.find("gslcblas") == std::string::npos)
                *static_cast<std::string*>(data) = info->dlpi_name;
            return 0;
        },
        &found);
    if (found.empty()) return "none in use";
    std::error_code ignored;
    const auto real = std::filesystem::canonical(found, ignored);
    std::string text = ignored ? found : real.string();
    if (void* const handle = dlopen(found.c_str(), RTLD_LAZY | RTLD_NOLOAD)) {
        if (const auto config = reinterpret_cast<char* (*)()>(dlsym(handle, "openblas_get_config")))
            text = fmt::format("{} ({})", config(), text);
        dlclose(handle);
    }
    return text;
}

std::string machine() {
    std::string line, model = "unknown processor";
    for (std::ifstream cpuinfo("/proc/cpuinfo"); std::getline(cpuinfo, line);)
        if (line.starts_with("model name") && line.find(": ") != std::string::npos) {
            model = line.substr(line.find(": ") + 2);
            break;
        }
    return fmt::format("{}, {} threads", model, sysconf(_SC_NPROCESSORS_ONLN));
}

}  // namespace

std::vector<std::pair<std::string, std::string>> build_info() {
    return {{"version", TUBULE_VERSION},  //
            {"git_hash", TUBULE_GIT_HASH},  {"build", TUBULE_BUILD},
            {"compiler", TUBULE_COMPILER},  {"sundials", sundials()},
            {"suitesparse", suitesparse()}, {"eigen", TUBULE_EIGEN},
            {"cgal", TUBULE_CGAL},          {"hdf5", hdf5()},
            {"gsl", gsl_version},           {"blas", blas()},
            {"machine", machine()}};
}

std::vector<std::string> lacking() {
    std::vector<std::string> parts = split(TUBULE_LACKS, '\n');
    parts.pop_back();
    return parts;
}

}  // namespace tubule
