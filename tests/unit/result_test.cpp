// The result file without accidents: what is written is read, resuming, refusals, foreign files, foreign readers.
// Expected values are the numbers handed to the writer.
#include "common/result/result.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "common/result/file_writer.hpp"
#include "common/result/hdf5_file.hpp"
#include "tests/support/message_of.hpp"

namespace tubule {
namespace result_test {

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

// Two quadratic triangles that share an edge; nothing here asks whether a surface is closed.
SurfaceCells two_cells() {
    return {2, 9, {0, 1, 2, 4, 5, 6, 2, 1, 3, 5, 7, 8}, 0, {}};
}
// The same as a tube's: the second cell sees nodes 2, 3 and 8 moved by one period, node 1 by two, and the first cell
// sees node 2 moved down.
SurfaceCells two_shifted_cells() {
    return {2, 9, {0, 1, 2, 4, 5, 6, 2, 1, 3, 5, 7, 8}, 2.5, {0, 0, -1, 0, 0, 0, 1, 2, 1, 0, 0, 1}};
}

// A frame on one of them: point data of each kind, and a state of the run that means nothing.
Record surface_record_at(double time, std::size_t mesh) {
    Record record{time, {{"energy", -1.0 / 3}}, {}, mesh};
    const auto add = [&](const std::string& name, std::vector<std::size_t> shape, std::size_t size) {
        record.arrays.push_back({name, std::move(shape), {}});
        for (std::size_t i = 0; i < size; ++i)
            record.arrays.back().data.push_back(time / 7 - static_cast<double>(i) / 3);
    };
    add("restart_state", {9, 3}, 27);
    add("H", {9}, 9);
    add("points", {9, 3}, 27);
    add("B", {9, 6}, 54);
    add("history", {9, 2}, 18);
    add("normal", {9, 3}, 27);
    add("nothing", {0}, 0);
    record.arrays[1].data[4] = -0.0;
    return record;
}

void expect_same(const Record& a, const Record& b) {
    EXPECT_EQ(a.time, b.time);
    EXPECT_EQ(a.mesh, b.mesh);
    EXPECT_EQ(a.numbers, b.numbers);
    ASSERT_EQ(a.arrays.size(), b.arrays.size());
    for (std::size_t i = 0; i < a.arrays.size(); ++i) {
        EXPECT_EQ(a.arrays[i].name, b.arrays[i].name);
        EXPECT_EQ(a.arrays[i].shape, b.arrays[i].shape);
        EXPECT_EQ(a.arrays[i].data, b.arrays[i].data);
    }
}

using test::message_of;

class ResultFile : public testing::Test {
protected:
    void SetUp() override {
        std::string pattern = (fs::temp_directory_path() / "tubule-result-XXXXXX").string();
        ASSERT_NE(mkdtemp(pattern.data()), nullptr);
        directory = pattern;
        file = directory / "run.hdf";
        FileWriter::seconds_between_writes = 0;
    }
    void TearDown() override {
        FileWriter::seconds_between_writes.reset();
        fs::remove_all(directory);
    }

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

    // Copies of the file, each changed by some lines of Python, are refused with these words.
    void expect_refused(const std::vector<std::pair<std::string, std::string>>& changes) const {
        std::string list;
        for (const auto& [change, words] : changes) list += "\"\"\"" + change + "\"\"\", ";
        python(
            "import shutil\nfor i, change in enumerate([" + list +
            "]):\n    shutil.copy(name, f'{name}.{i}')\n    with h5py.File(f'{name}.{i}', 'a') as f: exec(change)\n");
        for (std::size_t i = 0; i < changes.size(); ++i) {
            const std::string copy = file.string() + "." + std::to_string(i);
            EXPECT_CONTAINS(message_of([&] { read_result(copy); }), changes[i].second);
        }
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
    for (const bool finished : {false, true}) {
        SCOPED_TRACE(finished);
        if (finished) writer.finish({{"E_ref", 0.2}, {"stop", "finished"}});
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

// ---- curved surfaces

TEST_F(ResultFile, FramesOnMeshesRoundTrip) {
    auto writer = create();
    writer.row(row_at(0));
    EXPECT_EQ(writer.mesh(two_cells()), 0u);
    writer.frame(surface_record_at(0, 0));
    EXPECT_EQ(writer.mesh(two_shifted_cells()), 1u);
    EXPECT_EQ(writer.mesh(two_cells()), 0u);  // known
    writer.frame(record_at(0.5));             // frames of both kinds may follow each other
    writer.frame(surface_record_at(1, 1));
    writer.frame(surface_record_at(2, 1));
    writer.checkpoint(surface_record_at(2.5, 0));
    for (const bool finished : {false, true}) {
        SCOPED_TRACE(finished);
        if (finished) writer.finish({});
        const Result result = read_result(file);
        ASSERT_EQ(result.meshes.size(), 2u);
        EXPECT_EQ(result.meshes[0], two_cells());
        EXPECT_EQ(result.meshes[1], two_shifted_cells());
        ASSERT_EQ(result.frames.size(), 4u);
        expect_same(result.frames[0], surface_record_at(0, 0));
        expect_same(result.frames[1], record_at(0.5));
        expect_same(result.frames[2], surface_record_at(1, 1));
        expect_same(result.frames[3], surface_record_at(2, 1));
        expect_same(*result.checkpoint, surface_record_at(2.5, 0));
    }
}

TEST_F(ResultFile, DiscardForgetsMeshes) {
    auto writer = create();
    writer.mesh(two_cells());
    writer.frame(surface_record_at(0, 0));
    writer.discard();
    EXPECT_THROW(writer.frame(surface_record_at(0, 0)), std::invalid_argument);
    EXPECT_EQ(writer.mesh(two_shifted_cells()), 0u);
    writer.frame(surface_record_at(1, 0));
    writer.finish({});
    ASSERT_EQ(read_result(file).meshes.size(), 1u);
    EXPECT_EQ(read_result(file).meshes[0], two_shifted_cells());
}

TEST_F(ResultFile, ResumeKeepsTheMeshesThatAreNeeded) {
    SurfaceCells third = two_cells();
    std::swap(third.cells[0], third.cells[1]);
    {
        auto writer = create();
        writer.row(row_at(0));
        for (const SurfaceCells& mesh : {two_cells(), two_shifted_cells(), third}) writer.mesh(mesh);
        writer.frame(surface_record_at(0, 1));
    }
    auto writer = ResultWriter::resume(file);
    expect_same(writer.restart_record(), surface_record_at(0, 1));
    // The first is needed by nothing, but the number of the second is in the frame.
    EXPECT_EQ(writer.mesh(third), 2u);
    writer.checkpoint(surface_record_at(1, 2));
    writer.finish({});
    EXPECT_EQ(ResultWriter::resume(file).restart_record().mesh, 2u);
    EXPECT_EQ(read_result(file).meshes.size(), 3u);
}

TEST_F(ResultFile, MalformedMeshesAndFramesOnThemAreRefused) {
    auto writer = create();
    writer.row(row_at(0));
    const auto refused = [&](const std::function<void(SurfaceCells&)>& spoil) {
        SurfaceCells mesh = two_shifted_cells();
        spoil(mesh);
        return message_of([&] { writer.mesh(mesh); });
    };
    EXPECT_CONTAINS(refused([](auto& m) { m.order = 5; }), "mesh: its order is 5, not 1 to 4");
    EXPECT_CONTAINS(refused([](auto& m) { m.order = 3; }), "mesh: 12 node numbers do not divide into cells of 10");
    EXPECT_CONTAINS(refused([](auto& m) { m.cells.clear(); }), "mesh: 0 node numbers do not divide into cells of 6");
    EXPECT_CONTAINS(refused([](auto& m) { m.nodes = 8; }), "mesh: a cell uses node 8, but there are 8");
    EXPECT_CONTAINS(refused([](auto& m) { m.cells[3] = -1; }), "mesh: a cell uses node -1, but there are 9");
    EXPECT_CONTAINS(refused([](auto& m) { m.period = nan; }), "mesh: its period is nan");
    EXPECT_CONTAINS(refused([](auto& m) { m.period = 0; }), "mesh: 12 shifts, but its period 0 requires 0");
    EXPECT_CONTAINS(refused([](auto& m) { m.shifts.clear(); }), "mesh: 0 shifts, but its period 2.5 requires 12");

    EXPECT_CONTAINS(message_of([&] { writer.frame(surface_record_at(0, 0)); }),
                    "frame: it refers to mesh 0, but there are 0");
    writer.mesh(two_cells());
    const auto refused_frame = [&](const std::function<void(Record&)>& spoil) {
        Record record = surface_record_at(0, 0);
        spoil(record);
        return message_of([&] { writer.checkpoint(record); });
    };
    EXPECT_CONTAINS(refused_frame([](auto& r) { r.mesh = 1; }), "checkpoint: it refers to mesh 1, but there are 1");
    EXPECT_CONTAINS(refused_frame([](auto& r) { r.arrays.erase(r.arrays.begin() + 2); }),
                    "checkpoint: on a mesh it must have an array points [9, 3]");
    EXPECT_CONTAINS(refused_frame([](auto& r) { r.arrays[2].shape = {27}; }), "must have an array points [9, 3]");
    EXPECT_CONTAINS(refused_frame([](auto& r) { r.arrays[4].name = "Offsets"; }),
                    "checkpoint: Offsets is a name reserved by the mesh format");
    EXPECT_CONTAINS(refused_frame([](auto& r) { r.numbers.push_back({"Type", 1}); }), "checkpoint: Type is a name");
    EXPECT_EQ(message_of([&] {
                  Record record = surface_record_at(0, 0);
                  record.arrays[1].name = "Offsets";  // point data are in a group of their own
                  writer.frame(record);
              }),
              "accepted");
    EXPECT_EQ(read_result(file).frames.size(), 1u);
}

TEST_F(ResultFile, ADamagedSurfaceNamesItsLack) {
    auto writer = create();
    writer.mesh(two_shifted_cells());
    writer.frame(surface_record_at(0, 0));
    writer.finish({});
    expect_refused({
        {"f.attrs['schema'] += 1", "later version of tubule, with schema 3; this version reads 1 to 2"},
        {"del f['meshes']", "000000 refers to mesh 0, which is missing"},
        {"del f['meshes/000000/point_shift']", "point_shift"},
        {"f['meshes/000000/Connectivity'][0] = 99", "mesh 000000: a cell uses point 99, but there are 14"},
        {"f['meshes/000000'].attrs['order'] = 7", "mesh 000000: its order is 7, not 1 to 4"},
        {"g = f['frames/000000']; del g['Points']; g['Points'] = np.zeros((3, 3))",
         "Points has fewer rows than its mesh has nodes"},
    });
}

// What VTK's own reader makes of it: tests/tools/vtk_test.py.
TEST_F(ResultFile, H5pyFindsPointsOfPeriodsAndAllFramesInOne) {
    auto writer = create();
    writer.mesh(two_cells());
    writer.mesh(two_shifted_cells());
    writer.frame(surface_record_at(0, 0));
    writer.frame(surface_record_at(1, 1));
    writer.frame(surface_record_at(2, 1));
    writer.finish({});
    // Five points more than nodes: (2, -1), (2, 1), (1, 2), (3, 1), (8, 1), in the order in which cells name them.
    EXPECT_EQ(python(R"(f = h5py.File(name)
m, a = f['meshes/000001'], f['frames/000001']
print(list(f), a['Connectivity'] == m['Connectivity'], a['Types'] == m['Types'])
print(m['point_node'][9:], m['point_shift'][9:], m['Connectivity'][:], m['Offsets'][:], m['Types'][:])
print(np.all(a['Points'][9:] == a['Points'][:][m['point_node'][9:]] + np.outer(m['point_shift'][9:], [0, 0, 2.5])))
print(np.all(a['PointData/B'][9:] == a['PointData/B'][:][m['point_node'][9:]]), list(a['PointData']))
t = f['VTKHDF']
for s in range(3):
    frame, step = f['frames'][f'{s:06d}'], {key: t['Steps'][key][s] for key in t['Steps'] if key != 'PointDataOffsets'}
    part, point = step['PartOffsets'], step['PointOffsets']
    points, cells, ids = (t[key][part] for key in ('NumberOfPoints', 'NumberOfCells', 'NumberOfConnectivityIds'))
    cell, first = step['CellOffsets'][0], step['ConnectivityIdOffsets'][0]
    print(step['Values'], part, points, cells, ids,
          np.array_equal(t['Points'][point:point + points], frame['Points']),
          np.array_equal(t['PointData/normal'][point:point + points], frame['PointData/normal']),
          np.array_equal(t['Connectivity'][first:first + ids], frame['Connectivity']),
          np.array_equal(t['Offsets'][cell + part:cell + part + cells + 1], frame['Offsets']),
          t['Steps/PointDataOffsets/H'][s] == point)
print(t.attrs['Version'], t.attrs['Type'], f['frames/000000'].attrs['Version'], t['Steps'].attrs['NSteps'])
)"),
              "['VTKHDF', 'about', 'case', 'frames', 'meshes', 'series'] True True\n"
              "[2 2 1 3 8] [-1  1  2  1  1] [ 0  1  9  4  5  6 10 11 12  5  7 13] [ 0  6 12] [69 69]\n"
              "True\n"
              "True ['H', 'B', 'normal']\n"
              "0.0 0 9 2 12 True True True True True\n"
              "1.0 1 14 2 12 True True True True True\n"
              "2.0 1 14 2 12 True True True True True\n"
              "[2 0] b'UnstructuredGrid' [1 0] 3\n");
}

TEST_F(ResultFile, TheViewFollowsTheFrames) {
    const auto view = [&] {
        std::vector<std::string> names;
        if (fs::exists(directory / "view"))
            for (const auto& entry : fs::directory_iterator(directory / "view"))
                names.push_back(entry.path().filename().string());
        std::sort(names.begin(), names.end());
        return names;
    };
    auto writer = create();
    writer.mesh(two_cells());
    for (const double time : {0.0, 0.1, 2.0}) writer.frame(surface_record_at(time, 0));
    EXPECT_TRUE(view().empty());
    writer.finish({});
    EXPECT_EQ(view(),
              (std::vector<std::string>{"run.hdf.series", "run_000000.hdf", "run_000001.hdf", "run_000002.hdf"}));
    std::stringstream series;
    series << std::ifstream(directory / "view" / "run.hdf.series").rdbuf();
    EXPECT_CONTAINS(series.str(), "{\"name\": \"run_000001.hdf\", \"time\": 0.1},\n");
    EXPECT_EQ(python("import json, os\nfolder = os.path.join(os.path.dirname(name), 'view')\n"
                     "for entry in json.load(open(os.path.join(folder, 'run.hdf.series')))['files']:\n"
                     "    f = h5py.File(os.path.join(folder, entry['name']))\n"
                     "    print(f['VTKHDF'].attrs['time'] == entry['time'], f['VTKHDF/Points'].shape)\n"),
              "True (9, 3)\nTrue (9, 3)\nTrue (9, 3)\n");

    {
        auto again = ResultWriter::resume(file);
        EXPECT_EQ(view().size(), 4u);
        again.checkpoint(surface_record_at(3, 0));
        again.frame(surface_record_at(4, 0));
    }
    EXPECT_EQ(view().size(), 5u);

    // A new result takes its place; other files in the folder stay.
    std::ofstream(directory / "view" / "run_notes.hdf") << "mine";
    auto other = create();
    EXPECT_EQ(view().size(), 6u);
    other.row(row_at(0));
    EXPECT_EQ(view(), std::vector<std::string>{"run_notes.hdf"});
}

// ---- large results

// Its frames move to files of their own, and back into one at the end; h5py and the view see no difference. Long: one
// result through all its life.
TEST_F(ResultFile, FramesOfALargeResultAreWrittenOnce) {
    const std::size_t usual = std::exchange(most_rewritten, 1000);
    const auto frames = [&] {
        std::vector<Record> expected = {record_at(0)};
        for (const double time : {0.1, 2.0, 3.0, 4.0}) expected.push_back(surface_record_at(time, time > 1));
        return expected;
    }();
    const auto segments = [&] {
        std::vector<fs::path> found;
        for (const auto& entry : fs::directory_iterator(directory))
            if (entry.path().string().find(".hdf.frames") != std::string::npos) found.push_back(entry.path());
        std::sort(found.begin(), found.end());
        return found;
    };
    const auto expect_frames = [&](std::size_t count) {
        const Result result = read_result(file);
        ASSERT_EQ(result.frames.size(), count);
        for (std::size_t i = 0; i < count; ++i) expect_same(result.frames[i], frames[i]);
        EXPECT_EQ(result.meshes, (std::vector<SurfaceCells>{two_cells(), two_shifted_cells()}));
        EXPECT_EQ(
            python("f = h5py.File(name)\nprint(f['VTKHDF/Points'].shape[0], f['VTKHDF/PointData/H'][9:].tolist() == "
                   "f['frames/000002/PointData/H'][:].tolist() + f['frames/000003/PointData/H'][:].tolist() + "
                   "(f['frames/000004/PointData/H'][:].tolist() if len(f['frames']) > 4 else []))"),
            count > 4 ? "51 True\n" : "37 True\n");
        EXPECT_EQ(python("import os\nf = h5py.File(os.path.dirname(name) + '/view/run_000002.hdf')\n"
                         "print(f['VTKHDF'].attrs['time'])"),
                  "2.0\n");
    };
    {
        auto writer = create();
        writer.row(row_at(0));
        writer.mesh(two_cells());
        writer.mesh(two_shifted_cells());
        for (int i = 0; i < 4; ++i) writer.frame(frames[i]);
        EXPECT_EQ(segments().size(), 3u);
        const auto before = fs::last_write_time(segments()[0]);
        writer.row(row_at(1));
        EXPECT_EQ(fs::last_write_time(segments()[0]), before);
        expect_frames(4);
    }
    {  // killed, as it were
        const fs::path segment = segments()[0], aside = directory / "aside";
        fs::rename(segment, aside);
        EXPECT_CONTAINS(message_of([&] { read_result(file); }),
                        segment.string() + ", which has some of its frames, is missing");
        fs::copy_file(segments()[0], segment);
        EXPECT_CONTAINS(message_of([&] { read_result(file); }),
                        segment.string() + ", which has some of its frames, belongs to another");
        std::ofstream(segment, std::ios::app) << "x";
        EXPECT_CONTAINS(message_of([&] { ResultWriter::resume(file); }), "cannot be read: its checksums are damaged");
        fs::rename(aside, segment);
        auto writer = ResultWriter::resume(file);
        writer.frame(frames[4]);
        expect_frames(5);
        writer.finish({});
    }
    EXPECT_TRUE(segments().empty());
    expect_frames(5);
    auto other = create();
    other.frame(frames[0]);
    most_rewritten = 0;
    other.row(row_at(0));
    EXPECT_EQ(segments().size(), 1u);
    other.discard();
    EXPECT_TRUE(segments().empty());
    most_rewritten = usual;
}

// ---- resuming

TEST_F(ResultFile, AFinishedResultResumesAndIsNoLongerFinished) {
    {
        auto writer = ResultWriter::create(file, {"", {}}, {{"version", "1"}}, series);
        writer.row(row_at(0));
        writer.frame(record_at(0));
        writer.finish({{"stop", "time-limit"}, {"wall_seconds", 1.5}});
    }
    auto writer = ResultWriter::resume(file);
    writer.frame(record_at(1));
    EXPECT_EQ(read_result(file).about, (About{{"version", "1"}}));
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
    EXPECT_CONTAINS(message, "no frame or checkpoint to resume from");
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
    EXPECT_CONTAINS(make({"", {}}, {{"v", "1"}, {"v", "2"}}, series), "about: v occurs twice");
    EXPECT_CONTAINS(make({"", {}}, {}, {"energy"}), "a series named time is required");
    EXPECT_CONTAINS(make({"", {}}, {}, {"time", "energy", "energy"}), "series: energy occurs twice");
    EXPECT_CONTAINS(make({"", {}}, {}, {"time", "a/b"}), "series: \"a/b\" cannot be a name");
    EXPECT_TRUE(fs::is_empty(directory));

    auto writer = create();
    EXPECT_CONTAINS(message_of([&] {
                        writer.row(std::vector<double>{1, 2});
                    }),
                    "a row has 2 values, but there are 4 series");
    EXPECT_CONTAINS(message_of([&] {
                        writer.frame({0, {}, {{"z", {2, 2}, {1, 2, 3}}}});
                    }),
                    "frame z: its shape requires 4 numbers, but it has 3");
    EXPECT_CONTAINS(message_of([&] { writer.frame({0, {{"time", 1}}, {}}); }), "frame: time occurs twice");
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
        const auto messages = {message_of([&] { read_result(file); }), message_of([&] { ResultWriter::resume(file); }),
                               message_of([&] { create(); })};
        for (const std::string& message : messages) {
            EXPECT_CONTAINS(message, file.string());
            EXPECT_CONTAINS(message, why);
        }
        EXPECT_THROW(read_result(file), std::runtime_error);
    };
    std::ofstream(file) << "tier = \"axisym\"\n";
    expect_refused("is no result of tubule");
    EXPECT_EQ(fs::file_size(file), 16u);

    python("h5py.File(name, 'w').create_group('series')");
    expect_refused("not a Tubule result: /case is missing");
    python("f = h5py.File(name, 'w')\nfor part in 'about series frames'.split(): f.create_group(part)\nf['case'] = ''");
    expect_refused("not a Tubule result: the attribute about_begun is missing");

    fs::remove(file);
    fs::create_directory(file);
    expect_refused("not a regular file");
    fs::remove(file);

    EXPECT_CONTAINS(message_of([&] { read_result(file); }), file.string() + ": No such file or directory");
    EXPECT_CONTAINS(message_of([&] { ResultWriter::resume(file); }), file.string() + ": No such file or directory");
}

TEST_F(ResultFile, ADamagedResultNamesItsLack) {
    auto writer = create();
    for (const double time : {0.0, 1.0, 2.0}) writer.row(row_at(time));
    writer.frame(record_at(1));
    writer.finish({});
    expect_refused({
        {"del f['series/energy']", "energy"},
        {"del f['series/energy']; f['series/energy'] = [1.0, 2.0]", "series time and energy differ in length"},
        {"f.move('frames/000000', 'frames/last')", "000000"},
        {"del f['frames/000000'].attrs['time']; f['frames/000000'].attrs['time'] = 'now'", "time"},
        {"del f['case'].attrs['set']", "set"},
        // The writer refuses these numbers; another program may have changed the file since.
        {"f['series/energy'][2] = np.nan", "series energy is nan in row 2"},
        {"f['series/time'][0] = -np.inf", "series time is -inf in row 0"},
        {"f['frames/000000/X'][1, 0] = np.nan", "000000: X is nan in row 3"},
        {"f['frames/000000'].attrs['length'] = np.nan", "000000: length is nan in row 0"},
    });
}

// ---- h5py

TEST_F(ResultFile, H5pyReadsItDuringTheRunAndAfter) {
    const CaseText c = {"# \xC2\xB5\n", {"a=1", "b=\"x\""}};
    auto writer =
        ResultWriter::create(file, c, {{"version", "0.1.0"}, {"threads", std::int64_t{2}}, {"E_ref", 0.1}}, series);
    writer.row(row_at(0));
    EXPECT_EQ(python("f = h5py.File(name)\nprint(f['case'].asstr()[()] == '# \\u00b5\\n', f['series/time'].shape)"),
              "True (1,)\n");
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

}  // namespace result_test
}  // namespace tubule
