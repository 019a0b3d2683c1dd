// Damaged results are refused. Expected values are the numbers handed to the writer.
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
#include "common/result/result.hpp"
#include "tests/support/message_of.hpp"

namespace tubule {
namespace checksums_test {

namespace fs = std::filesystem;
using test::message_of;

constexpr std::size_t trailer = 64;
const std::vector<std::string> series = {"time", "energy"};

class Checksums : public testing::Test {
protected:
    void SetUp() override {
        std::string pattern = (fs::temp_directory_path() / "tubule-checksums-XXXXXX").string();
        ASSERT_NE(mkdtemp(pattern.data()), nullptr);
        directory = pattern;
        file = directory / "run.hdf";
        auto writer = ResultWriter::create(file, {"x = 1\n", {"y=2"}}, {{"seed", std::int64_t{3}}}, series);
        for (const double time : {0.0, 1.0, 2.0}) writer.row(std::vector<double>{time, 1 / (1 + time)});
        writer.frame({1, {{"energy", 0.5}}, {{"z", {3}, {1, 2, 3}}}});
        writer.finish({{"stop", "finished"}});
        std::ifstream in(file, std::ios::binary);
        sound = {std::istreambuf_iterator<char>(in), {}};
    }
    void TearDown() override { fs::remove_all(directory); }
    void put(const std::string& contents) const { std::ofstream(file, std::ios::binary) << contents; }

    fs::path directory, file;
    std::string sound;
};

TEST_F(Checksums, FlippedBitsAreFound) {
    const durable::File open(file, O_RDWR);
    std::size_t accepted = 0;
    // Each byte of the trailer, every seventh of the rest, to save time.
    for (std::size_t i = 0; i < sound.size(); i += i < sound.size() - trailer ? 7 : 1) {
        const char spoilt = static_cast<char>(sound[i] ^ (1 << i % 8));
        ASSERT_EQ(::pwrite(open.descriptor(), &spoilt, 1, static_cast<off_t>(i)), 1);
        accepted += examine(open.descriptor()).kind != Wholeness::Kind::damaged;
        ASSERT_EQ(::pwrite(open.descriptor(), &sound[i], 1, static_cast<off_t>(i)), 1);
    }
    EXPECT_EQ(accepted, 0u);
    EXPECT_EQ(examine(file).kind, Wholeness::Kind::whole);
}

TEST_F(Checksums, NothingReadsOrReplacesADamagedResult) {
    sound[sound.size() / 2] ^= 4;
    put(sound);
    for (const std::string& message :
         {message_of([&] { read_result(file); }), message_of([&] { ResultWriter::resume(file); }), message_of([&] {
              ResultWriter::create(file, {"", {}}, {}, series);
          })})
        EXPECT_CONTAINS(message, file.string() + ": it is damaged: its checksum is wrong; bring back a copy");
}

TEST_F(Checksums, CutOffAndLengthenedFilesAreDamaged) {
    const std::size_t hdf5 = sound.size() - trailer;
    put(sound.substr(0, hdf5 - 1));
    EXPECT_CONTAINS(examine(file).damage, "cut off");
    for (const std::size_t size : {hdf5 + 1, hdf5 + 40, sound.size() - 1}) {
        put(sound.substr(0, size));
        EXPECT_EQ(examine(file).damage, "its checksums are damaged") << size;
    }
    put(sound + "x");
    EXPECT_EQ(examine(file).damage, "its checksums are damaged");
}

TEST_F(Checksums, AResultWithoutThemIsRead) {
    put(sound.substr(0, sound.size() - trailer));
    EXPECT_EQ(examine(file).kind, Wholeness::Kind::unsealed);
    testing::internal::CaptureStderr();
    EXPECT_EQ(read_result(file).series.at("time"), (std::vector<double>{0, 1, 2}));
    EXPECT_EQ(read_result(file).series.at("time"), (std::vector<double>{0, 1, 2}));
    const std::string warning = testing::internal::GetCapturedStderr();
    EXPECT_EQ(warning.find("run.hdf has no checksums"), warning.rfind("run.hdf has no checksums")) << warning;  // once
}

TEST(Crc32, CheckValue) {
    // The check value of CRC-32/ISO-HDLC in the catalogue of parametrised CRC algorithms.
    const std::string digits = "123456789";
    EXPECT_EQ(crc32(0, std::as_bytes(std::span(digits))), 0xCBF43926u);
    // Continued over two parts it is the same.
    const std::uint32_t first = crc32(0, std::as_bytes(std::span(digits).first(4)));
    EXPECT_EQ(crc32(first, std::as_bytes(std::span(digits).subspan(4))), 0xCBF43926u);
}

}  // namespace checksums_test
}  // namespace tubule
