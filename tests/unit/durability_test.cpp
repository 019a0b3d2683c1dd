// A result that is written at each call is killed at every system call by which it reaches the disk. What a call has
// reported must be there afterwards, bit for bit, and nothing else but the call under way.
//
// Expected values: `Model` below, which keeps the meaning of the calls in plain vectors, without any file.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

#include "common/result/durable_io.hpp"
#include "common/result/file_writer.hpp"
#include "common/result/hdf5_file.hpp"
#include "common/result/result.hpp"
#include "tests/support/message_of.hpp"

namespace tubule {
namespace durability_test {

namespace fs = std::filesystem;

const std::vector<std::string> series = {"time", "energy"};
const std::string case_text = "tier = \"axisym\"\n# \xC3\xA9l\xC3\xA9gant\n";

// Numbers whose last bits matter.
Record make_record(double time, std::size_t size) {
    Record record{time, {{"degree", 5}, {"energy", -1.0 / (3 + time)}}, {{"z", {size}, {}}, {"X", {size, 2}, {}}}};
    for (Array& array : record.arrays) {
        std::size_t n = 1;
        for (const std::size_t extent : array.shape) n *= extent;
        for (std::size_t i = 0; i < n; ++i) array.data.push_back(static_cast<double>(i) / 7 + time / 3);
    }
    if (size > 1) record.arrays[0].data[1] = -0.0;
    return record;
}

// A tube of 1250 and a closed surface of 2 cells; the frames on them.
SurfaceCells make_mesh(bool tube) {
    SurfaceCells mesh{tube ? 3 : 2, 7, {}, tube ? 2.5 : 0.0, {}};
    for (int i = 0; i < (tube ? 12500 : 12); ++i) {
        mesh.cells.push_back(i * i % 7);
        if (tube) mesh.shifts.push_back(i % 3 - 1);
    }
    return mesh;
}
Record make_surface_record(double time, std::size_t mesh) {
    Record record = make_record(time, 4);
    record.mesh = mesh;
    record.arrays.push_back({"points", {7, 3}, std::vector<double>(21, 0.1 + time)});
    record.arrays.push_back({"H", {7}, {-0.0, 1.0 / 3, 2, 3, 4, 5, time}});
    return record;
}

// What a result means, in plain vectors.
struct Model {
    std::string text;
    std::vector<SurfaceCells> meshes;
    std::vector<std::vector<double>> rows;
    std::vector<Record> frames;
    std::optional<Record> checkpoint;
    std::optional<std::string> stop;

    const Record* restart() const {
        const Record* last = frames.empty() ? nullptr : &frames.back();
        return checkpoint && (!last || checkpoint->time >= last->time) ? &*checkpoint : last;
    }
    void resume() {
        const double time = restart()->time;
        std::erase_if(rows, [&](const auto& row) { return row[0] > time; });
        std::erase_if(frames, [&](const Record& frame) { return frame.time > time; });
        std::size_t needed = 0;
        for (const Record& frame : frames) needed = std::max(needed, frame.mesh ? *frame.mesh + 1 : 0);
        if (checkpoint && checkpoint->mesh) needed = std::max(needed, *checkpoint->mesh + 1);
        meshes.resize(needed);
        stop.reset();
    }
};

bool same(double a, double b) {
    return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

bool same(const Record& a, const Record& b) {
    bool equal = same(a.time, b.time) && a.mesh == b.mesh && a.numbers.size() == b.numbers.size() &&
                 a.arrays.size() == b.arrays.size();
    for (std::size_t i = 0; equal && i < a.numbers.size(); ++i)
        equal = a.numbers[i].first == b.numbers[i].first && same(a.numbers[i].second, b.numbers[i].second);
    for (std::size_t i = 0; equal && i < a.arrays.size(); ++i) {
        const Array& x = a.arrays[i];
        const Array& y = b.arrays[i];
        equal = x.name == y.name && x.shape == y.shape && x.data.size() == y.data.size();
        for (std::size_t j = 0; equal && j < x.data.size(); ++j) equal = same(x.data[j], y.data[j]);
    }
    return equal;
}

bool same(const Result& result, const Model& model) {
    std::optional<std::string> stop;
    for (const auto& [name, value] : result.about)
        if (name == "stop") stop = std::get<std::string>(value);
    bool equal = result.case_text.text == model.text && result.series_names == series && stop == model.stop &&
                 result.series.at("time").size() == model.rows.size() && result.frames.size() == model.frames.size() &&
                 result.checkpoint.has_value() == model.checkpoint.has_value() && result.meshes == model.meshes;
    for (std::size_t i = 0; equal && i < model.rows.size(); ++i)
        equal = same(result.series.at("time")[i], model.rows[i][0]) &&
                same(result.series.at("energy")[i], model.rows[i][1]);
    for (std::size_t i = 0; equal && i < model.frames.size(); ++i) equal = same(result.frames[i], model.frames[i]);
    return equal && (!model.checkpoint || same(*result.checkpoint, *model.checkpoint));
}

// One call to the library, and what it means.
struct Step {
    std::string name;
    std::function<void(std::optional<ResultWriter>&, const fs::path&)> call;
    std::function<void(Model&)> meaning;
};

// With its first row, at time 0: the file changes then.
Step create(const std::string& text) {
    const std::vector<double> values = {0, 1};
    return {"create",
            [=](auto& writer, const fs::path& file) {
                writer = ResultWriter::create(file, {text, {"a=1"}}, {{"version", "0"}}, series);
                writer->row(values);
            },
            [=](Model& m) { m = Model{text, {}, {values}, {}, {}, {}}; }};
}
Step row(double time) {
    const std::vector<double> values = {time, 1 / (1 + time)};
    return {"row", [=](auto& writer, const fs::path&) { writer->row(values); },
            [=](Model& m) { m.rows.push_back(values); }};
}
Step frame(double time, std::size_t size = 3) {
    const Record record = make_record(time, size);
    return {"frame", [=](auto& writer, const fs::path&) { writer->frame(record); },
            [=](Model& m) { m.frames.push_back(record); }};
}
Step checkpoint(double time) {
    const Record record = make_record(time, 2);
    return {"checkpoint", [=](auto& writer, const fs::path&) { writer->checkpoint(record); },
            [=](Model& m) { m.checkpoint = record; }};
}
Step mesh(bool tube) {
    return {"mesh", [=](auto& writer, const fs::path&) { writer->mesh(make_mesh(tube)); },
            [=](Model& m) { m.meshes.push_back(make_mesh(tube)); }};
}
Step surface_frame(double time, std::size_t mesh) {
    const Record record = make_surface_record(time, mesh);
    return {"frame", [=](auto& writer, const fs::path&) { writer->frame(record); },
            [=](Model& m) { m.frames.push_back(record); }};
}
Step discard() {
    return {"discard", [](auto& writer, const fs::path&) { writer->discard(); },
            [](Model& m) {
                m.meshes.clear();
                m.rows.clear();
                m.frames.clear();
                m.checkpoint.reset();
            }};
}
Step finish(const std::string& stop) {
    return {"finish",
            [=](auto& writer, const fs::path&) {
                writer->finish({{"stop", stop}});
            },
            [=](Model& m) { m.stop = stop; }};
}
// As if the process had died here.
Step abandon() {
    return {"abandon", [](auto& writer, const fs::path&) { writer.reset(); }, [](Model&) {}};
}
// With its first row.
Step resume(double time) {
    const Step first = row(time);
    return {"resume",
            [=](auto& writer, const fs::path& file) {
                writer = ResultWriter::resume(file);
                first.call(writer, file);
            },
            [=](Model& m) {
                m.resume();
                first.meaning(m);
            }};
}

// An earlier result of the same name, unfinished.
const std::vector<Step> before = {create("# before\n"), frame(0), row(1)};

const std::vector<Step> run = {create(case_text),   frame(0),  row(1),        checkpoint(1),
                               mesh(false),         discard(), row(0),        frame(0),
                               checkpoint(1),       row(2),    frame(2, 600), row(3),
                               abandon(),           resume(3), mesh(true),    checkpoint(3),
                               surface_frame(4, 0), abandon(), resume(5),     finish("finished")};

class Durability : public testing::Test {
protected:
    void SetUp() override {
        // In memory where there is such a folder: a disk takes 5 ms to sync, which no test here can see.
        const fs::path memory = "/dev/shm";
        std::string pattern = ((fs::exists(memory) ? memory : fs::temp_directory_path()) / "tubule-XXXXXX").string();
        ASSERT_NE(mkdtemp(pattern.data()), nullptr);
        directory = pattern;
        file = directory / "run.hdf";
        most_rewritten = 1000;  // large frames have files of their own
        FileWriter::seconds_between_writes = 0;
    }
    void TearDown() override {
        most_rewritten = usual;
        FileWriter::seconds_between_writes.reset();
        durable::fault = nullptr;
        fs::remove_all(directory);
    }
    void clear() {
        for (const auto& entry : fs::directory_iterator(directory))
            if (entry.path() != directory / "kept") fs::remove_all(entry.path());
    }

    static void take(const std::vector<Step>& steps, const fs::path& file) {
        std::optional<ResultWriter> writer;
        for (const Step& step : steps) step.call(writer, file);
    }

    const std::size_t usual = most_rewritten;
    fs::path directory, file;
};

// Kills the process at its n-th operation; of a write, the given share of the bytes still reaches the file.
void die_at(std::size_t n, double share) {
    durable::fault = [n, share](const durable::Operation& operation) mutable {
        if (n-- > 0) return 0;
        if (operation.call == durable::Call::write) {
            const auto part = static_cast<std::size_t>(share * static_cast<double>(operation.bytes.size()));
            if (::write(operation.fd, operation.bytes.data(), part) < 0) std::abort();
        }
        ::raise(SIGKILL);
        return 0;
    };
}

struct Child {
    int reported = 0;  // calls that have returned
    bool killed = false;
};

// Runs work(report) in a child process; report() tells the parent that one more call has returned.
// The parent may do `meanwhile(pid, next report)`.
Child in_child(const std::function<void(const std::function<void()>&)>& work,
               const std::function<void(pid_t, const std::function<bool()>&)>& meanwhile = {}) {
    int ends[2];
    if (::pipe(ends) != 0) throw std::runtime_error("no pipe");
    const pid_t pid = ::fork();
    if (pid == 0) {
        ::close(ends[0]);
        try {
            work([&] {
                const char one = 1;
                if (::write(ends[1], &one, 1) != 1) std::abort();
            });
        } catch (const std::exception& e) {
            fprintf(stderr, "child: %s\n", e.what());
            ::_exit(1);
        }
        ::_exit(0);
    }
    ::close(ends[1]);
    Child child;
    const auto next = [&] {
        char one = 0;
        const bool got = ::read(ends[0], &one, 1) == 1;
        child.reported += got;
        return got;
    };
    if (meanwhile) meanwhile(pid, next);
    while (next()) {
    }
    ::close(ends[0]);
    int status = 0;
    ::waitpid(pid, &status, 0);
    child.killed = WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL;
    EXPECT_TRUE(child.killed || (WIFEXITED(status) && WEXITSTATUS(status) == 0));
    return child;
}

// The result can be resumed if it has a state to resume from.
void expect_resumable(const fs::path& file, Model model) {
    if (!model.restart()) {
        EXPECT_THROW(ResultWriter::resume(file), std::runtime_error);
        return;
    }
    const Record restart = *model.restart();
    std::optional<ResultWriter> writer;
    for (const Step& step : {resume(restart.time + 1), frame(restart.time + 1), finish("finished")}) {
        step.call(writer, file);
        step.meaning(model);
        EXPECT_TRUE(same(writer->restart_record(), restart));
        EXPECT_TRUE(same(read_result(file), model)) << "after " << step.name;
    }
    EXPECT_FALSE(fs::exists(file.string() + ".lock"));
    for (std::size_t i = 0; i < model.frames.size(); ++i) {
        const fs::path view = file.parent_path() / "view" / ("run_00000" + std::to_string(i) + ".hdf");
        EXPECT_EQ(fs::exists(view), model.frames[i].mesh.has_value()) << view;
    }
}

// Long: one run, killed once at each of its operations, and all that must hold afterwards.
TEST_F(Durability, KilledAtEveryOperationOfARun) {
    const auto& steps = run;
    Model old;
    for (const Step& step : before) step.meaning(old);
    std::vector<Model> models = {old};  // after each step
    for (const Step& step : steps) {
        models.push_back(models.back());
        step.meaning(models.back());
    }

    std::vector<durable::Call> operations;
    take(before, file);
    const fs::path kept = directory / "kept";
    fs::create_directory(kept);
    fs::copy(file, kept / file.filename());
    durable::fault = [&](const durable::Operation& operation) {
        operations.push_back(operation.call);
        return 0;
    };
    take(steps, file);
    durable::fault = nullptr;
    ASSERT_GT(operations.size(), 80u);

    for (std::size_t n = 0; n < operations.size(); ++n) {
        // All of a write may have happened and the process be dead nevertheless: share 1.
        const bool writes = operations[n] == durable::Call::write;
        for (const double share : writes ? std::vector{0.4, 1.0} : std::vector{0.0}) {
            SCOPED_TRACE("operation " + std::to_string(n) + ", share " + std::to_string(share));
            clear();
            fs::copy(kept, directory);
            const Child child = in_child([&](const auto& report) {
                die_at(n, share);
                std::optional<ResultWriter> writer;
                for (const Step& step : steps) {
                    step.call(writer, file);
                    report();
                }
            });
            ASSERT_TRUE(child.killed);
            const auto done = static_cast<std::size_t>(child.reported);
            SCOPED_TRACE("killed in " + steps[done].name);

            const Result result = read_result(file);
            const bool one_more = !same(result, models[done]);
            ASSERT_TRUE(same(result, models[done + one_more]));
            expect_resumable(file, models[done + one_more]);
            if (HasFailure()) return;
        }
    }
}

// Between two writes nothing is on the disk: at most 2 s, or 50 times the cost of a write.
TEST_F(Durability, WrittenWhenDue) {
    FileWriter::seconds_between_writes = 0.3;
    const auto written = [&] { return read_result(file).series.at("time").size(); };
    {
        auto writer = ResultWriter::create(file, {case_text, {}}, {}, series);
        const auto add = [&](double time) { writer.row(std::vector<double>{time, 1}); };
        add(0);
        EXPECT_EQ(written(), 1u);
        add(1);
        EXPECT_EQ(written(), 1u);
        add(2);
        writer.checkpoint(make_record(2, 2));  // a run goes on from here
        EXPECT_EQ(written(), 3u);
        ::usleep(400'000);
        add(3);
        EXPECT_EQ(written(), 4u);
        add(4);
        EXPECT_EQ(written(), 4u);
    }
    EXPECT_EQ(written(), 5u);  // its writer has gone
}

// ---- errors instead of kills

// Makes every operation of the kind fail with `error`; of a write, half of the bytes still reach the file.
void break_disk(durable::Call call, int error) {
    durable::fault = [=](const durable::Operation& operation) {
        if (operation.call != call) return 0;
        if (call == durable::Call::write)
            if (::write(operation.fd, operation.bytes.data(), operation.bytes.size() / 2) < 0) std::abort();
        return error;
    };
}

using test::message_of;

TEST_F(Durability, AFullDiskIsReportedAndCostsNothingWritten) {
    auto writer = ResultWriter::create(file, {case_text, {}}, {}, series);
    writer.row(std::vector<double>{0, 1});
    break_disk(durable::Call::write, ENOSPC);
    const std::string message = message_of<std::runtime_error>([&] { writer.row(std::vector<double>{1, 2}); });
    EXPECT_CONTAINS(message, "run.hdf.tmp: No space left on device");
    EXPECT_THROW(writer.finish({}), std::runtime_error);
    EXPECT_FALSE(fs::exists(directory / "run.hdf.tmp"));
    EXPECT_EQ(read_result(file).series.at("time"), std::vector<double>{0});

    durable::fault = nullptr;  // someone made room
    writer.row(std::vector<double>{2, 3});
    EXPECT_EQ(read_result(file).series.at("time"), (std::vector<double>{0, 1, 2}));
    writer.finish({});
}

TEST_F(Durability, EveryFailingOperationOfCreateNamesTheFileAndKeepsTheOldResult) {
    using durable::Call;
    for (const auto& [call, error, words] :
         {std::tuple(Call::open, EACCES, "Permission denied"), std::tuple(Call::write, ENOSPC, "No space left"),
          std::tuple(Call::sync, EIO, "Input/output error"),
          std::tuple(Call::rename, EROFS, "Read-only file system")}) {
        SCOPED_TRACE(words);
        clear();
        take({create("# before\n"), frame(0), finish("finished")}, file);
        break_disk(call, error);
        const std::string message = message_of<std::runtime_error>([&] { take({create(case_text)}, file); });
        durable::fault = nullptr;
        EXPECT_CONTAINS(message, file.string());
        EXPECT_CONTAINS(message, words);
        EXPECT_EQ(read_result(file).case_text.text, "# before\n");
        EXPECT_EQ(read_result(file).frames.size(), 1u);
        for (const auto& entry : fs::directory_iterator(directory)) EXPECT_EQ(entry.path(), file);  // no litter
    }
}

// ---- runs that fail at their start

TEST_F(Durability, WhatWasThereStaysUntilTheFirstRow) {
    take(before, file);
    Model old;
    for (const Step& step : before) step.meaning(old);
    {
        auto writer = ResultWriter::create(file, {case_text, {}}, {}, series);
        writer.mesh(make_mesh(false));
        writer.frame(make_surface_record(0, 0));
        writer.checkpoint(make_record(0, 2));
        EXPECT_THROW(writer.row(std::vector<double>{0, INFINITY}), std::invalid_argument);
        writer.discard();
        EXPECT_FALSE(writer.began());
    }
    EXPECT_TRUE(same(read_result(file), old));
    {
        auto writer = ResultWriter::resume(file);
        EXPECT_THROW(writer.row(std::vector<double>{INFINITY, 1}), std::invalid_argument);
        EXPECT_FALSE(writer.began());
    }
    EXPECT_TRUE(same(read_result(file), old));

    auto writer = ResultWriter::create(file, {case_text, {}}, {}, series);
    writer.frame(make_record(0, 3));
    writer.row(std::vector<double>{0, 1});
    EXPECT_TRUE(writer.began());
    EXPECT_TRUE(same(read_result(file), Model{case_text, {}, {{0, 1}}, {make_record(0, 3)}, {}, {}}));
}

// Where nothing was before, the reason is all that such a run leaves.
TEST_F(Durability, AResultWithoutRowsSaysWhyItStopped) {
    auto writer = ResultWriter::create(file, {case_text, {}}, {}, series);
    EXPECT_FALSE(fs::exists(file));
    writer.finish({{"stop", "solver-failed"}});
    EXPECT_TRUE(same(read_result(file), Model{case_text, {}, {}, {}, {}, "solver-failed"}));
}

// ---- several parties

TEST_F(Durability, ASecondWriterIsRefusedAsLongAsTheFirstIsThere) {
    auto writer = ResultWriter::create(file, {case_text, {}}, {}, series);
    writer.row(std::vector<double>{0, 1});
    writer.frame(make_record(0, 3));
    for (const auto& second :
         std::vector<std::function<void()>>{[&] {
                                                ResultWriter::create(file, {case_text, {}}, {}, series);
                                            },
                                            [&] { ResultWriter::resume(file); }}) {
        EXPECT_CONTAINS(message_of(second), "another process is writing");
    }
    EXPECT_EQ(read_result(file).frames.size(), 1u);
    writer.finish({});
    EXPECT_NO_THROW(ResultWriter::resume(file));
}

// A reader sees a prefix of the run at any time, at least as long as the one it saw before.
TEST_F(Durability, ReadingWhileARunGoesOn) {
    const std::size_t calls = 300;
    take({create(case_text), frame(0)}, file);
    const Child child = in_child(
        [&](const auto& report) {
            auto writer = ResultWriter::resume(file);
            report();
            for (std::size_t i = 1; i < calls; ++i) {
                writer.row(std::vector<double>{static_cast<double>(i), 0.5});
                report();
            }
        },
        [&](pid_t, const auto& next) {
            next();
            std::size_t seen = 0;
            for (int reads = 0; seen < calls && reads < 100'000 && !HasFailure(); ++reads) {
                const auto times = read_result(file).series.at("time");
                EXPECT_GE(times.size(), seen);
                seen = times.size();
                for (std::size_t i = 0; i < seen; ++i) EXPECT_EQ(times[i], static_cast<double>(i));
            }
            EXPECT_EQ(seen, calls);
        });
    EXPECT_FALSE(child.killed);
    EXPECT_EQ(read_result(file).series.at("time").size(), calls);
}

}  // namespace durability_test
}  // namespace tubule
