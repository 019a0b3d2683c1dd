// Contents as HDF5, the layout of docs/results.md.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "common/result/contents.hpp"
#include "common/result/result.hpp"

namespace tubule {

// The bytes of the file, made in memory. In place of the frames that are in segments it has links to them.
std::vector<std::byte> hdf5_image(const Contents& contents);

// The bytes of a segment with the frames from `first` on, and its CRC.
std::pair<std::vector<std::byte>, std::uint32_t> segment_image(const Contents& contents, std::size_t first);

// The bytes of a file in which VTK finds that frame of `file`, a path relative to the folder of the one to be written.
std::vector<std::byte> view_image(const std::string& file, std::size_t frame);

// All throw std::runtime_error naming the file, and what is missing if it is HDF5 but not a result.
Contents read_hdf5(const std::filesystem::path& file);
CaseText read_hdf5_case(const std::filesystem::path& file);

// The bytes of a file from which read_result() gives this result.
std::vector<std::byte> result_image(const Result& result);

}  // namespace tubule
