// Work that is handed out task by task, on threads of this process or across the processes of one mpirun: rank 0 hands
// out tasks and takes in results, all ranks compute.
#pragma once

#include <exception>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>

namespace tubule {

// Ranks send it to each other as MessagePack, in which numbers and texts stay what they are to the bit.
using Packet = nlohmann::json;

// What a queue answers who asks for a task: here it is; `wait`, as it depends on others that are being done; or `over`,
// there is nothing left to do.
enum class NextTask { ready, wait, over };

// What is handed out and taken in, from any thread.
class Tasks {
public:
    virtual ~Tasks() = default;
    // With `may_wait`, waits instead of saying so.
    virtual NextTask take(Packet& task, bool may_wait) = 0;
    virtual void give(const Packet& result) = 0;
    virtual void fail(std::exception_ptr error) = 0;  // of a task of this process; the tasks are then over
};

// From a task to its result. Throws nothing on ranks other than 0.
using Compute = std::function<Packet(const Packet& task)>;

// Does tasks, one after the other, until they are over.
void work_off(Tasks& tasks, const Compute& compute);

// The other processes of the mpirun that started this one.
class Ranks {
public:
    // Joins them; nothing if this process runs by itself. Throws CaseError where MPI was not built in: each process
    // would do all of the work.
    static std::optional<Ranks> join();
    Ranks(Ranks&& other) noexcept;
    ~Ranks();  // leaves them

    int rank() const { return rank_; }
    int count() const { return count_; }

    // Rank 0 does the tasks on all ranks, one at a time each, until they are over or an interrupt comes. `header`,
    // not null, is what all of them need. How many ranks there are.
    int run(Tasks& tasks, const Packet& header, const Compute& compute);
    // Rank 0 calls it in place of run: there is nothing to do.
    void dismiss();
    // The others compute what rank 0 hands out, until it says that all is over. `begin` reads the header.
    void serve(const std::function<Compute(const Packet& header)>& begin);
    // Ends all ranks at once with this exit status: none waits for what another is doing.
    [[noreturn]] void abort(int status);

private:
    Ranks() = default;
    int rank_ = 0, count_ = 1;
    bool joined_ = false;
};

}  // namespace tubule
