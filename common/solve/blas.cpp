#include "common/solve/blas.hpp"

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <new>
#include <vector>

#include "common/solve/memory.hpp"

// <cblas.h> is another library's on some systems. The others are those by which OpenBLAS gets its buffers; it keeps
// them for later calls.
extern "C" {
void openblas_set_num_threads(int);
[[gnu::weak]] void* blas_memory_alloc(int);
[[gnu::weak]] void blas_memory_free(void*);
}

namespace tubule {

void prepare_blas(int threads) {
    [[maybe_unused]] static const bool once = [] {
        if (!std::getenv("OPENBLAS_NUM_THREADS")) openblas_set_num_threads(1);
        return true;
    }();
    constexpr std::size_t buffer_bytes = 1 << 27;  // of all kernels for x86-64
    static std::mutex mutex;
    static int wanted = 0, there = 0;  // buffers: by all threads that are alive; of OpenBLAS
    struct Wish {
        int threads = 0;
        ~Wish() {
            const std::lock_guard lock(mutex);
            wanted -= threads;
        }
    };
    thread_local Wish wish;
    if (!limited_memory() || threads <= wish.threads || !blas_memory_alloc || !blas_memory_free) return;
    const std::lock_guard lock(mutex);
    const int more = wanted + threads - wish.threads;
    std::vector<std::unique_ptr<void, void (*)(void*)>> taken;
    while (there < more && static_cast<int>(taken.size()) < more) {
        if (!can_allocate(buffer_bytes)) throw std::bad_alloc();
        taken.emplace_back(blas_memory_alloc(0), blas_memory_free);
    }
    wanted = more, wish.threads = threads, there = std::max(there, more);
}

}  // namespace tubule
