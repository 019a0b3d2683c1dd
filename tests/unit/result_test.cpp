// The result file without accidents: what is written is read, resuming, refusals, foreign files, foreign readers.
// Expected values are the numbers handed to the writer.
#include "common/result/result.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/result/journal.hpp"

namespace tubule {
namespace {

namespace fs = std::filesystem;

const std::vector<std::string> series = {"time", "z_last", "a_middle", "energy"};  // not in alphabetical order
const double nan = std::numeric_limits<double>::quiet_NaN();
const double infinity = std::numeric_limits<double>::infinity();

std::vector<double> row_at(double time) {
    return {time, 1e-300 * time, -1 / (3 + time), 1e17 + time};
}

Record record_at(double time) {
    return {time,
            {{"length", 2.5}, {"degree", 5}, {"energy", -1.0 / 3}},
            {{"z", {3}, {0, 1.0 / 3, -0.0}}, {"X", {2, 3}, {1, 2, 3, 4, 5, 6 + time}}, {"A", {0}, {}}}};
}

void expect_same(const Record& a, const Record& b) {
    EXPECT_EQ(a.time, b.time);
    EXPECT_EQ(a.numbers, b.numbers);
    ASSERT_EQ(a.arrays.size(), b.arrays.size());
    for (std::size_t i = 0; i < a.arrays.size(); ++i) {
        EXPECT_EQ(a.arrays[i].name, b.arrays[i].name);
        EXPECT_EQ(a.arrays[i].shape, b.arrays[i].shape);
        EXPECT_EQ(a.arrays[i].data, b.arrays[i].data);
    }
}

std::string message_of(const std::function<void()>& call) {
    try {
        call();
    } catch (const std::exception& e) {
        return e.what();
    }
    return "no error";
}

#define EXPECT_CONTAINS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

class ResultFile : public testing::Test {
protected:
    void SetUp() override {
        std::string pattern = (fs::temp_directory_path() / "tubule-result-XXXXXX").string();
        ASSERT_NE(mkdtemp(pattern.data()), nullptr);
        directory = pattern;
        file = directory / "run.hdf";
    }
    void TearDown() override { fs::remove_all(directory); }

    ResultWriter create() const { return ResultWriter::create(file, {"x = 1\n", {}}, {}, series); }
    // Runs Debian's Python with h5py and gives back what it prints.
    std::string python(const std::string& program) const {
        const fs::path script = directory / "script.py";
        const fs::path printed = directory / "printed";
        std::ofstream(script) << "import h5py, sys\nimport numpy as np\nname = sys.argv[1]\n" << program;
        const std::string command =
            "/usr/bin/python3 -B " + script.string() + " " + file.string() + " >" + printed.string() + " 2>&1";
        const int status = std::system(command.c_str());
        std::stringstream text;
        text << std::ifstream(printed).rdbuf();
        EXPECT_EQ(status, 0) << text.str();
        return text.str();
    }

    fs::path directory, file;
};

TEST_F(ResultFile, RoundTrip) {
    const CaseText c = {"tier = \"axisym\"\n# 100 \xC2\xB5m\n\n", {"a=1", "shape.mode.0.amplitude=0.3"}};
    const About about = {{"version", "0.1.0"}, {"threads", std::int64_t{1} << 62}, {"E_ref", 0.1}, {"note", ""}};
    auto writer = ResultWriter::create(file, c, about, series);
    for (int i = 0; i < 7; ++i) writer.row(row_at(i));
    writer.frame(record_at(0));
    writer.frame(record_at(6));
    writer.checkpoint(record_at(3));
    writer.checkpoint(record_at(4));
    // The same through the journal, and from the file alone.
    for (const bool finished : {false, true}) {
        SCOPED_TRACE(finished);
        if (finished) writer.finish({{"E_ref", 0.2}, {"stop", "finished"}});
        EXPECT_EQ(fs::exists(journal_path(file)), !finished);
        const Result result = read_result(file);
        EXPECT_EQ(result.case_text.text, c.text);
        EXPECT_EQ(result.case_text.sets, c.sets);
        const About with_end = {{"version", "0.1.0"},
                                {"threads", std::int64_t{1} << 62},
                                {"E_ref", 0.2},
                                {"note", ""},
                                {"stop", "finished"}};
        EXPECT_EQ(result.about, finished ? with_end : about);
        EXPECT_EQ(result.series_names, series);
        for (std::size_t j = 0; j < series.size(); ++j) {
            ASSERT_EQ(result.series.at(series[j]).size(), 7u);
            for (int i = 0; i < 7; ++i) EXPECT_EQ(result.series.at(series[j])[i], row_at(i)[j]);
        }
        ASSERT_EQ(result.frames.size(), 2u);
        expect_same(result.frames[0], record_at(0));
        expect_same(result.frames[1], record_at(6));
        ASSERT_TRUE(result.checkpoint);
        expect_same(*result.checkpoint, record_at(4));
    }
}

TEST_F(ResultFile, EmptyCaseAndNoRows) {
    ResultWriter::create(file, {"", {}}, {}, {"time"}).finish({});
    const Result result = read_result(file);
    EXPECT_EQ(result.case_text.text, "");
    EXPECT_TRUE(result.case_text.sets.empty());
    EXPECT_TRUE(result.about.empty());
    EXPECT_TRUE(result.series.at("time").empty());
    EXPECT_TRUE(result.frames.empty());
    EXPECT_FALSE(result.checkpoint);
}

// HDF5 stores many attributes in another way than few, and lists names by a tree from some number on.
TEST_F(ResultFile, ManyFramesAndManyNamesKeepTheirOrder) {
    std::vector<std::string> names = {"time"};
    About about;
    Record record;
    for (int i = 300; i > 0; --i) {
        names.push_back("s" + std::to_string(i));
        about.emplace_back("a" + std::to_string(i), std::int64_t{i});
        record.numbers.emplace_back("n" + std::to_string(i), i);
        record.arrays.push_back({"r" + std::to_string(i), {1}, {1.0 * i}});
    }
    auto writer = ResultWriter::create(file, {"", {}}, about, names);
    writer.frame(record);
    for (int i = 1; i < 50; ++i) writer.frame({1.0 * i, {}, {}});
    writer.finish({});
    const Result result = read_result(file);
    EXPECT_EQ(result.series_names, names);
    EXPECT_EQ(result.about, about);
    expect_same(result.frames[0], record);
    for (int i = 1; i < 50; ++i) EXPECT_EQ(result.frames[i].time, i);
}

TEST_F(ResultFile, DiscardForgetsRowsFramesAndCheckpoint) {
    auto writer = create();
    writer.row(row_at(0));
    writer.frame(record_at(0));
    writer.checkpoint(record_at(0));
    writer.discard();
    writer.row(row_at(5));
    writer.finish({});
    const Result result = read_result(file);
    EXPECT_EQ(result.series.at("time"), std::vector<double>{5});
    EXPECT_TRUE(result.frames.empty());
    EXPECT_FALSE(result.checkpoint);
}

TEST_F(ResultFile, CreateReplacesAnOldResult) {
    {
        auto old = create();
        old.row(row_at(0));
        old.frame(record_at(0));
    }  // not finished: its journal lies there
    auto writer = ResultWriter::create(file, {"y = 2\n", {}}, {}, {"time"});
    EXPECT_EQ(read_result(file).case_text.text, "y = 2\n");
    EXPECT_TRUE(read_result(file).series.at("time").empty());
    EXPECT_TRUE(read_result(file).frames.empty());
}

TEST_F(ResultFile, NothingFollowsFinish) {
    auto writer = create();
    writer.finish({});
    EXPECT_THROW(writer.row(row_at(0)), std::logic_error);
    EXPECT_THROW(writer.frame(record_at(0)), std::logic_error);
    EXPECT_THROW(writer.checkpoint(record_at(0)), std::logic_error);
    EXPECT_THROW(writer.discard(), std::logic_error);
    EXPECT_THROW(writer.finish({}), std::logic_error);
}

TEST_F(ResultFile, TheWriterKeepsToItsFileWhenTheDirectoryChanges) {
    const fs::path here = fs::current_path();
    fs::current_path(directory);
    auto writer = ResultWriter::create("run.hdf", {"", {}}, {}, {"time"});
    fs::current_path(here);
    writer.row(std::vector<double>{1});
    writer.finish({});
    EXPECT_EQ(read_result(file).series.at("time"), std::vector<double>{1});
}

TEST_F(ResultFile, ALinkStaysALink) {
    const fs::path target = directory / "target.hdf";
    ResultWriter::create(target, {"old", {}}, {}, {"time"}).finish({});
    fs::create_symlink(target, file);
    create().finish({});
    EXPECT_TRUE(fs::is_symlink(file));
    EXPECT_EQ(read_result(target).case_text.text, "x = 1\n");
}

// ---- resuming

TEST_F(ResultFile, ResumeFromTheLastFrameDropsLaterRows) {
    {
        auto writer = create();
        writer.checkpoint(record_at(0.5));
        for (const double time : {0.0, 1.0, 2.0, 2.5}) writer.row(row_at(time));
        writer.frame(record_at(0));
        writer.frame(record_at(2));
    }
    auto writer = ResultWriter::resume(file);
    expect_same(writer.restart_record(), record_at(2));
    EXPECT_EQ(read_result(file).series.at("time"), (std::vector<double>{0, 1, 2}));
    writer.row(row_at(4));
    writer.finish({});
    const Result result = read_result(file);
    EXPECT_EQ(result.series.at("time"), (std::vector<double>{0, 1, 2, 4}));
    EXPECT_EQ(result.series.at("energy"), (std::vector<double>{1e17, 1e17 + 1, 1e17 + 2, 1e17 + 4}));
    EXPECT_EQ(result.frames.size(), 2u);
    expect_same(*result.checkpoint, record_at(0.5));
}

TEST_F(ResultFile, ResumeFromALaterCheckpoint) {
    {
        auto writer = create();
        for (const double time : {0.0, 1.0, 2.0, 3.0}) writer.row(row_at(time));
        writer.frame(record_at(0));
        writer.checkpoint(record_at(2));
    }
    auto writer = ResultWriter::resume(file);
    expect_same(writer.restart_record(), record_at(2));
    EXPECT_EQ(read_result(file).series.at("time"), (std::vector<double>{0, 1, 2}));
}

TEST_F(ResultFile, AFinishedResultResumesAndIsNoLongerFinished) {
    {
        auto writer = ResultWriter::create(file, {"", {}}, {{"version", "1"}}, series);
        writer.row(row_at(0));
        writer.frame(record_at(0));
        writer.finish({{"stop", "time-limit"}, {"wall_seconds", 1.5}});
    }
    auto writer = ResultWriter::resume(file);
    EXPECT_EQ(read_result(file).about, (About{{"version", "1"}}));
    writer.frame(record_at(1));
    writer.finish({{"stop", "finished"}});
    EXPECT_EQ(read_result(file).about, (About{{"version", "1"}, {"stop", "finished"}}));
    EXPECT_EQ(read_result(file).frames.size(), 2u);
}

TEST_F(ResultFile, NothingToResumeFrom) {
    {
        auto writer = create();
        writer.row(row_at(0));
    }
    const std::string message = message_of([&] { ResultWriter::resume(file); });
    EXPECT_CONTAINS(message, file.string());
    EXPECT_CONTAINS(message, "neither frame nor checkpoint");
    EXPECT_EQ(read_result(file).series.at("time"), std::vector<double>{0});  // still there
}

// ---- refusals

TEST_F(ResultFile, NonFiniteNumbersAreRefusedByName) {
    auto writer = create();
    EXPECT_CONTAINS(message_of([&] { writer.row(std::vector<double>{0, 1, nan, 3}); }), "series a_middle is nan");
    EXPECT_CONTAINS(message_of([&] { writer.row(std::vector<double>{0, 1, 2, -infinity}); }), "series energy is -inf");
    Record record = record_at(0);
    record.arrays[1].data[4] = infinity;
    EXPECT_CONTAINS(message_of([&] { writer.frame(record); }), "frame X[4] is inf");
    record = record_at(0);
    record.numbers[2].second = nan;
    EXPECT_CONTAINS(message_of([&] { writer.checkpoint(record); }), "checkpoint energy is nan");
    EXPECT_CONTAINS(message_of([&] { writer.frame(record_at(nan)); }), "frame time is nan");
    EXPECT_CONTAINS(message_of([&] { writer.finish({{"E_ref", nan}}); }), "about E_ref is nan");
    EXPECT_THROW(writer.row(std::vector<double>{0, 1, nan, 3}), std::invalid_argument);
    EXPECT_THROW(writer.frame(record_at(nan)), std::invalid_argument);
    // Nothing of it was written, and the writer goes on.
    writer.row(row_at(1));
    EXPECT_EQ(read_result(file).series.at("time"), std::vector<double>{1});
    EXPECT_TRUE(read_result(file).frames.empty());
}

TEST_F(ResultFile, MalformedInputIsRefused) {
    auto make = [&](const CaseText& c, const About& about, const std::vector<std::string>& names) {
        return message_of([&] { ResultWriter::create(file, c, about, names); });
    };
    const std::string zero("a\0b", 3);
    EXPECT_CONTAINS(make({zero, {}}, {}, series), "the case contains a zero byte");
    EXPECT_CONTAINS(make({"", {zero}}, {}, series), "--set contains a zero byte");
    EXPECT_CONTAINS(make({"", {}}, {{"v", zero}}, series), "about v contains a zero byte");
    EXPECT_CONTAINS(make({"", {}}, {{"v", "1"}, {"v", "2"}}, series), "about: v comes twice");
    EXPECT_CONTAINS(make({"", {}}, {}, {"energy"}), "there must be one of the name time");
    EXPECT_CONTAINS(make({"", {}}, {}, {"time", "energy", "energy"}), "series: energy comes twice");
    EXPECT_CONTAINS(make({"", {}}, {}, {"time", "a/b"}), "series: \"a/b\" cannot be a name");
    EXPECT_TRUE(fs::is_empty(directory));

    auto writer = create();
    EXPECT_CONTAINS(message_of([&] { writer.row(std::vector<double>{1, 2}); }), "a row of 2 values for 4 series");
    EXPECT_CONTAINS(message_of([&] {
                        writer.frame({0, {}, {{"z", {2, 2}, {1, 2, 3}}}});
                    }),
                    "frame z: its shape asks for 4 numbers, it has 3");
    EXPECT_CONTAINS(message_of([&] { writer.frame({0, {{"time", 1}}, {}}); }), "frame: time comes twice");
    EXPECT_CONTAINS(message_of([&] { writer.frame({0, {}, {{"", {0}, {}}}}); }), "frame: \"\" cannot be a name");
}

TEST_F(ResultFile, AMissingDirectoryIsReportedAtOnce) {
    const fs::path lost = directory / "no" / "run.hdf";
    const std::string message = message_of([&] { ResultWriter::create(lost, {"", {}}, {}, series); });
    EXPECT_CONTAINS(message, lost.string());
    EXPECT_CONTAINS(message, "No such file or directory");
}

// ---- foreign files

TEST_F(ResultFile, OtherFilesAreNeitherReadNorReplaced) {
    const auto expect_refused = [&](const std::string& why) {
        const auto messages = {message_of([&] { read_result(file); }), message_of([&] { repair_result(file); }),
                               message_of([&] { ResultWriter::resume(file); }), message_of([&] { create(); })};
        for (const std::string& message : messages) {
            EXPECT_CONTAINS(message, file.string());
            EXPECT_CONTAINS(message, why);
        }
        EXPECT_THROW(read_result(file), std::runtime_error);
    };
    std::ofstream(file) << "tier = \"axisym\"\n";
    expect_refused("HDF5 cannot open it");
    EXPECT_EQ(fs::file_size(file), 16u);

    python("h5py.File(name, 'w').create_group('series')");
    expect_refused("no Tubule result: it lacks /case");
    python("f = h5py.File(name, 'w')\nfor part in 'about series frames'.split(): f.create_group(part)\nf['case'] = ''");
    expect_refused("no Tubule result: it lacks the attribute id");

    fs::remove(file);
    fs::create_directory(file);
    expect_refused("not a regular file");
    fs::remove(file);

    EXPECT_CONTAINS(message_of([&] { read_result(file); }), file.string() + ": No such file or directory");
    EXPECT_CONTAINS(message_of([&] { ResultWriter::resume(file); }), file.string() + ": No such file or directory");
}

TEST_F(ResultFile, ADamagedResultNamesItsLack) {
    const auto damaged = [&](const std::string& damage) {
        {
            auto writer = create();
            writer.row(row_at(0));
            writer.frame(record_at(0));
            writer.finish({});
        }
        python("f = h5py.File(name, 'a')\n" + damage);
        const std::string message = message_of([&] { read_result(file); });
        fs::remove(file);
        return message;
    };
    EXPECT_CONTAINS(damaged("del f['series/energy']"), "energy");
    EXPECT_CONTAINS(damaged("del f['series/energy']; f['series/energy'] = [1.0, 2.0]"),
                    "series time and energy differ in length");
    EXPECT_CONTAINS(damaged("f.move('frames/000000', 'frames/last')"), "000000");
    EXPECT_CONTAINS(damaged("del f['frames/000000'].attrs['time']; f['frames/000000'].attrs['time'] = 'now'"), "time");
    EXPECT_CONTAINS(damaged("del f['case'].attrs['set']"), "set");
}

TEST_F(ResultFile, ACutOffFileIsRefused) {
    create().finish({});
    fs::resize_file(file, fs::file_size(file) / 2);
    EXPECT_CONTAINS(message_of([&] { read_result(file); }), "HDF5 cannot open it");
}

// ---- h5py

TEST_F(ResultFile, H5pyReadsItDuringTheRunAndAfter) {
    const CaseText c = {"# \xC2\xB5\n", {"a=1", "b=\"x\""}};
    auto writer =
        ResultWriter::create(file, c, {{"version", "0.1.0"}, {"threads", std::int64_t{2}}, {"E_ref", 0.1}}, series);
    writer.row(row_at(0));
    // The journal is not for h5py; the file is, whole, at any time.
    EXPECT_EQ(python("f = h5py.File(name)\nprint(f['case'].asstr()[()] == '# \\u00b5\\n', f['series/time'].shape)"),
              "True (0,)\n");
    writer.row(row_at(1));
    writer.frame(record_at(1));
    writer.checkpoint(record_at(1));
    writer.finish({{"stop", "finished"}});
    EXPECT_EQ(python(R"(f = h5py.File(name)
print(list(f))
print(list(f['case'].attrs['set']), {k: v for k, v in f['about'].attrs.items()})
print(list(f['series'].attrs['order']), f['series/energy'][:] - 1e17, f['series/time'].dtype, f['series/time'].chunks)
for frame in f['frames/000000'], f['checkpoint']:
    print(dict(frame.attrs), list(frame), frame['X'][:].tolist(), frame['A'].shape, frame['z'][1] == 1/3)
)"),
              "['about', 'case', 'checkpoint', 'frames', 'series']\n"
              "['a=1', 'b=\"x\"'] {'version': '0.1.0', 'threads': 2, 'E_ref': 0.1, 'stop': 'finished'}\n"
              "['time', 'z_last', 'a_middle', 'energy'] [0. 0.] float64 None\n"
              "{'time': 1.0, 'length': 2.5, 'degree': 5.0, 'energy': -0.3333333333333333} ['z', 'X', 'A'] "
              "[[1.0, 2.0, 3.0], [4.0, 5.0, 7.0]] (0,) True\n"
              "{'time': 1.0, 'length': 2.5, 'degree': 5.0, 'energy': -0.3333333333333333} ['z', 'X', 'A'] "
              "[[1.0, 2.0, 3.0], [4.0, 5.0, 7.0]] (0,) True\n");
}

TEST_F(ResultFile, ATableWithoutSetsIsAnEmptyListForH5py) {
    create().finish({});
    EXPECT_EQ(python("f = h5py.File(name)\nprint(len(f['case'].attrs['set']))"), "0\n");
}

}  // namespace
}  // namespace tubule
