// The one writer of a result NAME.hdf: its lock, and how and when the file is written.
#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <vector>

#include "common/result/durable_io.hpp"

namespace tubule {

class FileWriter {
public:
    // Holds NAME.hdf.lock for as long as it lives: a lock on NAME.hdf would end with its replacement. Throws
    // std::runtime_error if another writer has it.
    explicit FileWriter(std::filesystem::path file);
    ~FileWriter() { release(); }

    const std::filesystem::path& path() const { return file_; }
    // Whether 2 s have passed since the last write, and so much that the next one costs no more than 2 % of the time.
    bool due() const;
    // Replaces the file by what `image` makes.
    void write(const std::function<std::vector<std::byte>()>& image);
    void release();  // nothing is written any more

    // Instead: that of the environment, TUBULE_WRITE_SECONDS.
    static std::optional<double> seconds_between_writes;

private:
    using Clock = std::chrono::steady_clock;

    std::filesystem::path file_;
    durable::File lock_;
    Clock::time_point written_at_ = Clock::now();
    Clock::duration cost_{};
};

}  // namespace tubule
