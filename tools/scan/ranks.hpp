// A scan across the processes of one mpirun: rank 0 holds the queue and the result file, all ranks compute.
#pragma once

#include <optional>

#include "tools/scan/dispatcher.hpp"

namespace tubule {

// The other processes of the mpirun that started this one. Only where MPI was built in and it was mpirun that did.
class Ranks {
public:
    // Joins them; nothing if this process runs by itself.
    static std::optional<Ranks> join();
    Ranks(Ranks&& other) noexcept;
    ~Ranks();  // leaves them

    int rank() const { return rank_; }
    int count() const { return count_; }

    // Of rank 0: runs the scan on all ranks, one point at a time each. How many they are.
    int run_scan(Dispatcher& dispatcher, const Scan& scan);
    // Of rank 0 in place of run_scan: there is nothing to do.
    void dismiss();
    // Of the others: computes what rank 0 hands out, until it says that all is over.
    void serve();
    // Ends all ranks at once with this exit status: none waits for what another is doing.
    [[noreturn]] void abort(int status);

private:
    Ranks() = default;
    int rank_ = 0, count_ = 1;
    bool joined_ = false;
};

}  // namespace tubule
