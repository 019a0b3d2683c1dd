// Damaged results: what is refused, and what is rescued. Expected values are the numbers handed to the writer.
#include "common/result/checksums.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "common/result/durable_io.hpp"
#include "common/result/journal.hpp"
#include "common/result/result.hpp"
#include "tests/support/message_of.hpp"

namespace tubule {
namespace {

namespace fs = std::filesystem;
using test::message_of;

const std::vector<std::string> series = {"time", "energy"};
constexpr std::size_t rows_of_a_chunk = Extent::chunk / sizeof(double);

Record record_at(double time, std::size_t size) {
    Record record{time, {{"energy", -1.0 / 3}}, {{"z", {size}, {}}, {"H", {size}, {}}}};
    for (std::size_t i = 0; i < size; ++i) {
        record.arrays[0].data.push_back(10 + time + static_cast<double>(i) / 7);
        record.arrays[1].data.push_back(10 * (20 + time) + static_cast<double>(i) / 13);
    }
    return record;
}

std::string as_text(const void* data, std::size_t size) {
    return {static_cast<const char*>(data), size};
}

// Two quadratic triangles of a tube, the second one moved by a period.
SurfaceCells cells() {
    return {2, 9, {0, 1, 2, 4, 5, 6, 2, 1, 3, 5, 7, 8}, 2.5, {0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1}};
}
Record surface_at(double time) {
    Record record = record_at(time, 2);
    record.mesh = 0;
    record.arrays.push_back({"points", {9, 3}, {}});
    for (int i = 0; i < 27; ++i) record.arrays[2].data.push_back(500 + time + i / 11.0);
    return record;
}

class Checksums : public testing::Test {
protected:
    void SetUp() override {
        std::string pattern = (fs::temp_directory_path() / "tubule-checksums-XXXXXX").string();
        ASSERT_NE(mkdtemp(pattern.data()), nullptr);
        directory = pattern;
        file = directory / "run.hdf", rescued = directory / "rescued.hdf";
    }
    void TearDown() override { fs::remove_all(directory); }

    // Two frames that are profiles and one on a mesh.
    ResultWriter written(std::size_t rows) const {
        auto writer = ResultWriter::create(file, {"x = 1\n", {"y=2"}}, {{"seed", std::int64_t{3}}}, series);
        for (std::size_t i = 0; i < rows; ++i)
            writer.row(std::vector<double>{static_cast<double>(i), 1 / (1.0 + static_cast<double>(i))});
        writer.frame(record_at(0, 1000));
        writer.frame(record_at(1, 5));
        writer.mesh(cells());
        writer.frame(surface_at(2));
        writer.checkpoint(record_at(1.5, 3));
        return writer;
    }
    std::string bytes() const {
        std::ifstream in(file, std::ios::binary);
        return {std::istreambuf_iterator<char>(in), {}};
    }
    void put(const std::string& contents) const { std::ofstream(file, std::ios::binary) << contents; }
    // Changes one bit of a number that the file holds once.
    void damage(double number) const { damage(as_text(&number, sizeof number)); }
    void damage(const std::string& sought) const {
        std::string contents = bytes();
        const std::size_t at = contents.find(sought);
        ASSERT_NE(at, std::string::npos);
        ASSERT_EQ(contents.find(sought, at + 1), std::string::npos);
        contents[at] ^= 4;
        put(contents);
    }

    fs::path directory, file, rescued;
};

TEST_F(Checksums, FlippedBitsAreFound) {
    written(3).finish({{"stop", "finished"}});
    const std::string sound = bytes();
    const durable::File open(file, O_RDWR);
    std::size_t accepted = 0;
    // Each byte of the checksums and the index, every seventh of the rest, to save time.
    for (std::size_t i = 0, hdf5 = *examine(file).hdf5_size; i < sound.size(); i += i < hdf5 ? 7 : 1) {
        const char spoilt = static_cast<char>(sound[i] ^ (1 << i % 8));
        ASSERT_EQ(::pwrite(open.descriptor(), &spoilt, 1, static_cast<off_t>(i)), 1);
        accepted += examine(open.descriptor()).kind != Wholeness::Kind::damaged;
        ASSERT_EQ(::pwrite(open.descriptor(), &sound[i], 1, static_cast<off_t>(i)), 1);
    }
    EXPECT_EQ(accepted, 0u);
    EXPECT_EQ(examine(file).kind, Wholeness::Kind::whole);
}

TEST_F(Checksums, NothingReadsOrReplacesADamagedResult) {
    written(3).finish({{"stop", "finished"}});
    damage(0.5);
    for (const std::string& message :
         {message_of([&] { read_result(file); }), message_of([&] { ResultWriter::resume(file); }),
          message_of([&] { repair_result(file); }), message_of([&] {
              ResultWriter::create(file, {"", {}}, {}, series);
          })}) {
        EXPECT_NE(message.find(file.string() + ": it is damaged: its checksum is wrong"), std::string::npos) << message;
        EXPECT_NE(message.find("show --verify"), std::string::npos) << message;
    }
}

TEST_F(Checksums, CutOffAndLengthenedFilesAreDamaged) {
    written(3).finish({{"stop", "finished"}});
    const std::string sound = bytes();
    const std::uint64_t hdf5 = *examine(file).hdf5_size;
    put(sound.substr(0, hdf5 - 1));
    EXPECT_NE(examine(file).damage.find("cut off"), std::string::npos);
    for (const std::size_t size : {hdf5 + 1, hdf5 + 40, sound.size() - 1}) {
        put(sound.substr(0, size));
        EXPECT_EQ(examine(file).damage, "its checksums are damaged") << size;
    }
    put(sound + "x");
    EXPECT_EQ(examine(file).damage, "its checksums are damaged");
}

TEST_F(Checksums, AResultWithoutThemIsRead) {
    written(3).finish({{"stop", "finished"}});
    put(bytes().substr(0, *examine(file).hdf5_size));
    EXPECT_EQ(examine(file).kind, Wholeness::Kind::unsealed);
    testing::internal::CaptureStderr();
    EXPECT_EQ(read_result(file).series.at("time"), (std::vector<double>{0, 1, 2}));
    EXPECT_EQ(read_result(file).series.at("time"), (std::vector<double>{0, 1, 2}));
    const std::string warning = testing::internal::GetCapturedStderr();
    EXPECT_EQ(warning.find("run.hdf has no checksums"), warning.rfind("run.hdf has no checksums")) << warning;  // once
    EXPECT_FALSE(verify_result(file).has_checksums);
}

TEST_F(Checksums, AWholeResultIsGood) {
    auto writer = written(3);
    for (const bool finished : {false, true}) {
        if (finished) writer.finish({{"stop", "finished"}});
        const Verification found = verify_result(file);
        EXPECT_TRUE(found.has_checksums);
        EXPECT_EQ(found.damage, "");
        EXPECT_EQ(found.rows, 3u);
        EXPECT_EQ(found.frames, 3u);
        EXPECT_TRUE(found.lost.empty());
    }
}

TEST_F(Checksums, RowsOfGoodChunksAreRescued) {
    const std::size_t rows = 2 * rows_of_a_chunk + 10;
    written(rows).finish({{"stop", "finished"}});
    damage(1 / (1.0 + rows_of_a_chunk + 5));
    const Verification found = verify_result(file, rescued);
    EXPECT_EQ(found.damage, "it is damaged: its checksum is wrong");
    EXPECT_EQ(found.lost, std::vector<std::string>{"rows 512 to 1023: energy"});
    EXPECT_EQ(found.rows, rows - rows_of_a_chunk);
    const Result result = read_result(rescued);
    std::vector<double> energy;
    for (std::size_t i = 0; i < rows; ++i)
        if (i / rows_of_a_chunk != 1) energy.push_back(1 / (1.0 + static_cast<double>(i)));
    EXPECT_EQ(result.series.at("energy"), energy);
    EXPECT_EQ(result.case_text.text, "x = 1\n");
    EXPECT_EQ(result.case_text.sets, std::vector<std::string>{"y=2"});
    EXPECT_EQ(result.about,
              (About{{"seed", std::int64_t{3}}, {"stop", "finished"}, {"lost", "rows 512 to 1023: energy"}}));
    ASSERT_EQ(result.frames.size(), 3u);
    EXPECT_EQ(result.frames[0].arrays[1].data, record_at(0, 1000).arrays[1].data);
    EXPECT_EQ(result.frames[2].arrays[2].data, surface_at(2).arrays[2].data);
    EXPECT_EQ(result.meshes, std::vector<SurfaceCells>{cells()});
    EXPECT_EQ(result.checkpoint->arrays[0].data, record_at(1.5, 3).arrays[0].data);
    EXPECT_NE(message_of([&] { verify_result(file, rescued); }).find("exists already"), std::string::npos);
}

TEST_F(Checksums, ASeriesThatIsLostCostsNoRows) {
    written(3).finish({{"stop", "finished"}});
    damage(1.0 / 3);
    const Verification found = verify_result(file, rescued);
    EXPECT_EQ(found.lost, (std::vector<std::string>{"series energy: 3 of 3 rows",
                                                    "checkpoint: a run goes on with all of its series only"}));
    EXPECT_EQ(found.rows, 3u);
    const Result result = read_result(rescued);
    EXPECT_EQ(result.series_names, std::vector<std::string>{"time"});
    EXPECT_EQ(result.series.at("time"), (std::vector<double>{0, 1, 2}));
    EXPECT_FALSE(result.checkpoint);
    EXPECT_EQ(result.frames.size(), 3u);
}

// HDF5 structures of all kinds are gone; the numbers are where they were.
TEST_F(Checksums, HDF5IsNotNeeded) {
    written(3).finish({{"stop", "finished"}});
    std::string contents = bytes();
    contents.replace(0, 512, 512, '\xff');
    put(contents);
    const Verification found = verify_result(file, rescued);
    EXPECT_TRUE(found.lost.empty());
    EXPECT_EQ(read_result(rescued).series.at("time"), (std::vector<double>{0, 1, 2}));
    EXPECT_EQ(read_result(rescued).frames[1].arrays[0].data, record_at(1, 5).arrays[0].data);
}

TEST_F(Checksums, FramesThatLackSomethingAreLost) {
    written(3).finish({{"stop", "finished"}});
    const std::string sound = bytes();
    const auto lost = [&](const auto& part) {
        put(sound);
        damage(part);
        const Verification found = verify_result(file);
        EXPECT_EQ(found.rows, 3u);
        return std::pair(found.frames, found.lost);
    };
    using Lost = std::pair<std::size_t, std::vector<std::string>>;
    EXPECT_EQ(lost(record_at(0, 1000).arrays[1].data[700]), Lost(2, {"frame 0: H"}));
    EXPECT_EQ(lost(surface_at(2).arrays[2].data[0]), Lost(2, {"frame 2: points"}));
    EXPECT_EQ(lost(record_at(1.5, 3).arrays[0].data[1]), Lost(3, {"checkpoint: z"}));
    const std::vector<std::int64_t> connectivity = {0, 1, 2, 4, 5, 6};
    EXPECT_EQ(lost(as_text(connectivity.data(), 48)), Lost(2, {"frame 2: mesh 0"}));
}

TEST_F(Checksums, IfOnlyTheChecksumsAreDamagedAllIsGood) {
    written(3).finish({{"stop", "finished"}});
    std::string contents = bytes();
    contents[*examine(file).hdf5_size + 100] ^= 1;  // in the index
    put(contents);
    const Verification found = verify_result(file, rescued);
    EXPECT_EQ(found.damage, "its checksums are damaged");
    EXPECT_TRUE(found.lost.empty());
    EXPECT_EQ(read_result(rescued).series.at("time"), (std::vector<double>{0, 1, 2}));
    contents[0] ^= 1;  // and the rest
    put(contents);
    EXPECT_NE(message_of([&] { verify_result(file); }).find("nothing of it can be rescued"), std::string::npos);
}

TEST_F(Checksums, TheJournalOfARunIsIncluded) {
    { written(3); }
    ASSERT_TRUE(fs::exists(journal_path(file)));
    EXPECT_EQ(read_result(file).frames.size(), 3u);
    damage(1.0);  // the energy of the first row: what follows is in the journal
    const Verification found = verify_result(file, rescued);
    EXPECT_EQ(found.lost, std::vector<std::string>{"rows 0 to 0: energy"});
    EXPECT_EQ(read_result(rescued).series.at("time"), (std::vector<double>{1, 2}));
    EXPECT_EQ(read_result(rescued).frames.size(), 3u);
}

}  // namespace
}  // namespace tubule
