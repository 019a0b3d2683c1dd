#include "common/solve/memory.hpp"

#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/resource.h>

#include <algorithm>
#include <fstream>
#include <limits>

#include "common/solve/pause.hpp"

namespace tubule {
namespace {

// Measured choices: docs/decisions/time_and_memory.md, "Time and memory".
constexpr double always_there = 1e8;              // less is not worth a look
constexpr double multiplications_a_second = 3e9;  // of a sparse factorisation, one thread

constexpr double unlimited = std::numeric_limits<double>::infinity();

// The number after a word in a file of words and numbers; unlimited if there is none.
double number_in(const char* file, const std::string& word = "") {
    std::ifstream in(file);
    double value = 0;
    if (word.empty()) return in >> value ? value : unlimited;
    for (std::string next; in >> next;)
        if (next == word && in >> value) return value;
    return unlimited;
}

}  // namespace

bool limited_memory() {
    rlimit limit{};
    return getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY;
}

double free_memory() {
    const double machine = 1024 * number_in("/proc/meminfo", "MemAvailable:");
    double group = number_in("/sys/fs/cgroup/memory.max");
    if (group < unlimited) group -= number_in("/sys/fs/cgroup/memory.current");
    rlimit limit{};
    double own = unlimited;
    if (getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY)
        own = static_cast<double>(limit.rlim_cur) - 1024 * number_in("/proc/self/status", "VmSize:");
    return std::max(0.0, std::min({machine, group, own}));
}

void require_memory(double bytes, const std::string& what) {
    if (bytes < always_there) return;
    const double there = free_memory();
    if (bytes <= there) return;
    throw TooLarge(
        fmt::format("{} would take about {:.2g} GB of memory, but only {:.2g} GB are free: use fewer elements "
                    "(discretisation.elements)",
                    what, bytes / 1e9, there / 1e9));
}

bool can_allocate(std::size_t bytes) {
    void* const there = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    return there != MAP_FAILED && munmap(there, bytes) == 0;
}

void require_factors(double bytes, double multiplications, Eigen::Index size) {
    require_memory(bytes, fmt::format("the factors of a matrix of size {}", size));
    check_pause(multiplications / multiplications_a_second);
}

}  // namespace tubule
