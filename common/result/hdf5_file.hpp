// Contents as HDF5, the layout of docs/results.md. The one place that sees the HDF5 library.
#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

#include "common/result/contents.hpp"

namespace tubule {

// The bytes of the file, made in memory.
std::vector<std::byte> hdf5_image(const Contents& contents);

// Both throw std::runtime_error naming the file, and what it lacks if it is HDF5 but no result.
Contents read_hdf5(const std::filesystem::path& file);
void require_result(const std::filesystem::path& file);  // looks for the parts without reading them

}  // namespace tubule
