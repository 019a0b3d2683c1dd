// The one place that sees MPI.
#define OMPI_SKIP_MPICXX 1  // the C interface only
#define MPICH_SKIP_MPICXX 1
#include <mpi.h>

#include <chrono>
#include <cstdlib>
#include <cstring>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "common/case/read.hpp"
#include "common/solve/interrupt.hpp"
#include "tools/scan/ranks.hpp"

namespace tubule {
namespace {

// A worker sends `result` (empty at first) and gets `work`, or `over`.
enum Tag { result_tag = 1, work_tag, over_tag };

constexpr auto poll = std::chrono::microseconds(50);

using Bytes = std::vector<char>;

void append(Bytes& out, const std::string& text) {
    out.insert(out.end(), text.begin(), text.end());
    out.push_back('\0');
}

std::string next_text(std::span<const char>& in) {
    const std::string text(in.data());
    in = in.subspan(text.size() + 1);
    return text;
}

// What a worker has to know of the scan: the case, how far to go, and the keys of each point with the point.
Bytes header_of(const Scan& scan) {
    Bytes out;
    append(out, scan.case_path);
    append(out, scan.to_the_end ? "end" : "");
    out.insert(out.end(), scan.case_text.begin(), scan.case_text.end());
    return out;
}

Bytes task_of(const Scan& scan, std::size_t point) {
    Bytes out(sizeof(point));
    std::memcpy(out.data(), &point, sizeof(point));
    for (const std::string& set : scan.sets_of(point)) append(out, set);
    return out;
}

// A result but for its message, which follows it.
struct Fixed {
    std::size_t point;
    Outcome outcome;
    int stop;
    decltype(PointResult::measures) measures;
};

Bytes to_bytes(const PointResult& p) {
    const Fixed fixed{p.point, p.outcome, p.stop, p.measures};
    Bytes out(sizeof(fixed));
    std::memcpy(out.data(), &fixed, sizeof(fixed));
    out.insert(out.end(), p.message.begin(), p.message.end());
    return out;
}

PointResult from_bytes(const Bytes& in) {
    Fixed fixed;
    std::memcpy(&fixed, in.data(), sizeof(fixed));
    return {fixed.point, fixed.outcome, fixed.stop, fixed.measures, std::string(in.begin() + sizeof(fixed), in.end())};
}

void send(const Bytes& bytes, int to, Tag tag) {
    MPI_Send(bytes.data(), static_cast<int>(bytes.size()), MPI_CHAR, to, tag, MPI_COMM_WORLD);
}

Bytes receive(const MPI_Status& announced) {
    int size = 0;
    MPI_Get_count(&announced, MPI_CHAR, &size);
    Bytes bytes(static_cast<std::size_t>(size));
    MPI_Recv(bytes.data(), size, MPI_CHAR, announced.MPI_SOURCE, announced.MPI_TAG, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
    return bytes;
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

void broadcast(Bytes& bytes) {
    long size = static_cast<long>(bytes.size());
    MPI_Bcast(&size, 1, MPI_LONG, 0, MPI_COMM_WORLD);
    bytes.resize(static_cast<std::size_t>(size));
    MPI_Bcast(bytes.data(), static_cast<int>(size), MPI_CHAR, 0, MPI_COMM_WORLD);
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
    Bytes nothing;
    broadcast(nothing);
}

int Ranks::run_scan(Dispatcher& dispatcher, const Scan& scan) {
    Bytes header = header_of(scan);
    broadcast(header);
    std::thread here([&] {
        try {
            for (std::size_t point = 0; dispatcher.take(point, true) == Dispatcher::Answer::point;)
                dispatcher.give(run_one(scan, point));
        } catch (...) {
            dispatcher.fail(std::current_exception());
        }
    });
    std::vector<int> idle;
    for (int working = count_ - 1; working > 0;) {
        // After an interrupt nobody is waited for: their points will be run again, and the caller ends them.
        if (interrupted()) break;
        bool quiet = true;
        MPI_Status status;
        int there = 0;
        MPI_Iprobe(MPI_ANY_SOURCE, result_tag, MPI_COMM_WORLD, &there, &status);
        if (there) {
            const Bytes bytes = receive(status);
            if (!bytes.empty()) dispatcher.give(from_bytes(bytes));
            idle.push_back(status.MPI_SOURCE);
            quiet = false;
        }
        while (!idle.empty()) {
            std::size_t point = 0;
            const auto answer = dispatcher.take(point, false);
            if (answer == Dispatcher::Answer::wait) break;
            if (answer == Dispatcher::Answer::point) {
                send(task_of(scan, point), idle.back(), work_tag);
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

void Ranks::serve() {
    Bytes header;
    broadcast(header);
    if (header.empty()) return;
    std::span<const char> rest(header);
    const std::string path = next_text(rest);
    const bool to_the_end = !next_text(rest).empty();
    const std::string text(rest.begin(), rest.end());
    for (Bytes answer;;) {
        send(answer, 0, result_tag);
        const MPI_Status status = await_message(0);
        const Bytes task = receive(status);
        if (status.MPI_TAG == over_tag) return;
        std::size_t point = 0;
        std::memcpy(&point, task.data(), sizeof(point));
        std::span<const char> keys(task.data() + sizeof(point), task.size() - sizeof(point));
        std::vector<std::string> sets;
        while (!keys.empty()) sets.push_back(next_text(keys));
        PointResult result;
        try {
            result = run_point(parse_case(text, sets, path), to_the_end, [] { return interrupted(); });
        } catch (const CaseError& error) {
            result = refused_point(error.what());
        }
        result.point = point;
        answer = to_bytes(result);
    }
}

}  // namespace tubule
