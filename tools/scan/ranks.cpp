// The one place that sees MPI.
#include "tools/scan/ranks.hpp"

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "common/case/read.hpp"
#include "common/solve/interrupt.hpp"

#if TUBULE_HAS_MPI
#define OMPI_SKIP_MPICXX 1  // the C interface only
#define MPICH_SKIP_MPICXX 1
#include <mpi.h>
#endif

namespace tubule {

void work_off(Tasks& tasks, const Compute& compute) {
    try {
        for (Packet task; tasks.take(task, true) == NextTask::ready;) tasks.give(compute(task));
    } catch (...) {
        tasks.fail(std::current_exception());
    }
}

#if TUBULE_HAS_MPI
namespace {

using Bytes = std::vector<std::uint8_t>;

// A worker sends `result` (null at first) and gets `work`, or `over`.
enum Tag { result_tag = 1, work_tag, over_tag };

constexpr auto poll = std::chrono::microseconds(50);

void send(const Packet& packet, int to, Tag tag) {
    const Bytes bytes = Packet::to_msgpack(packet);
    MPI_Send(bytes.data(), static_cast<int>(bytes.size()), MPI_CHAR, to, tag, MPI_COMM_WORLD);
}

Packet receive(const MPI_Status& announced) {
    int size = 0;
    MPI_Get_count(&announced, MPI_CHAR, &size);
    Bytes bytes(static_cast<std::size_t>(size));
    MPI_Recv(bytes.data(), size, MPI_CHAR, announced.MPI_SOURCE, announced.MPI_TAG, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
    return Packet::from_msgpack(bytes);
}

// Sleeps between looks: MPI's own waiting keeps a core busy that another rank could use.
MPI_Status await_message(int from) {
    MPI_Status status;
    for (int there = 0;;) {
        MPI_Iprobe(from, MPI_ANY_TAG, MPI_COMM_WORLD, &there, &status);
        if (there) return status;
        std::this_thread::sleep_for(poll);
    }
}

// From rank 0 to the others.
Packet broadcast(const Packet& packet) {
    Bytes bytes = Packet::to_msgpack(packet);
    long size = static_cast<long>(bytes.size());
    MPI_Bcast(&size, 1, MPI_LONG, 0, MPI_COMM_WORLD);
    bytes.resize(static_cast<std::size_t>(size));
    MPI_Bcast(bytes.data(), static_cast<int>(size), MPI_CHAR, 0, MPI_COMM_WORLD);
    return Packet::from_msgpack(bytes);
}

bool started_by_mpirun() {
    for (const char* variable : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "PMI_RANK", "PMIX_RANK"})
        if (std::getenv(variable)) return true;
    return false;
}

}  // namespace

std::optional<Ranks> Ranks::join() {
    if (!started_by_mpirun()) return std::nullopt;
    int level = 0;
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &level);
    Ranks ranks;
    ranks.joined_ = true;
    MPI_Comm_rank(MPI_COMM_WORLD, &ranks.rank_);
    MPI_Comm_size(MPI_COMM_WORLD, &ranks.count_);
    return ranks;
}

Ranks::Ranks(Ranks&& other) noexcept
    : rank_(other.rank_), count_(other.count_), joined_(std::exchange(other.joined_, false)) {}

Ranks::~Ranks() {
    if (joined_) MPI_Finalize();
}

void Ranks::abort(int status) {
    MPI_Abort(MPI_COMM_WORLD, status);
    std::exit(status);
}

void Ranks::dismiss() {
    broadcast({});
}

int Ranks::run(Tasks& tasks, const Packet& header, const Compute& compute) {
    broadcast(header);
    std::thread here([&] { work_off(tasks, compute); });
    std::vector<int> idle;
    for (int working = count_ - 1; working > 0;) {
        // After an interrupt nobody is waited for: their tasks will be done again, and the caller ends them.
        if (interrupted()) break;
        bool quiet = true;
        MPI_Status status;
        int there = 0;
        MPI_Iprobe(MPI_ANY_SOURCE, result_tag, MPI_COMM_WORLD, &there, &status);
        if (there) {
            const Packet result = receive(status);
            if (!result.is_null()) tasks.give(result);
            idle.push_back(status.MPI_SOURCE);
            quiet = false;
        }
        while (!idle.empty()) {
            Packet task;
            const NextTask next = tasks.take(task, false);
            if (next == NextTask::wait) break;
            if (next == NextTask::ready) {
                send(task, idle.back(), work_tag);
            } else {
                send({}, idle.back(), over_tag);
                --working;
            }
            idle.pop_back();
            quiet = false;
        }
        if (quiet) std::this_thread::sleep_for(poll);
    }
    here.join();
    return count_;
}

void Ranks::serve(const std::function<Compute(const Packet& header)>& begin) {
    const Packet header = broadcast({});
    if (header.is_null()) return;
    const Compute compute = begin(header);
    for (Packet answer;;) {
        send(answer, 0, result_tag);
        const MPI_Status status = await_message(0);
        const Packet task = receive(status);
        if (status.MPI_TAG == over_tag) return;
        answer = compute(task);
    }
}

#else  // there are never any

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
int Ranks::run(Tasks&, const Packet&, const Compute&) {
    return 0;
}
void Ranks::dismiss() {}
void Ranks::serve(const std::function<Compute(const Packet&)>&) {}
void Ranks::abort(int status) {
    std::exit(status);
}

#endif

}  // namespace tubule
