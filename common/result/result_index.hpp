// The index behind a result's HDF5 part (checksums.hpp): all of the contents but the numbers of the datasets, and where
// these are. With it the good part of a damaged result is read without HDF5.
#pragma once

#include <string>
#include <vector>

#include "common/result/checksums.hpp"
#include "common/result/contents.hpp"

namespace tubule {

// `extents`: of each series; of each mesh the connectivity and, of tubes, the node and the shift of its points; of each
// array of each frame and of the checkpoint.
Bytes index_of(const Contents& contents, const std::vector<Extent>& extents);

// Contents of which `file`, all its bytes, may be damaged. Numbers that are not as they were written are NaN; a mesh of
// which something is lost has no cells. Throws std::runtime_error where this is not the index of a result.
Contents contents_by_index(std::span<const std::byte> index, std::span<const std::byte> file);

// What is lost: rows and frames that lack a number go, and meshes that no frame needs any more; in words, a line each.
std::vector<std::string> drop_what_is_lost(Contents& contents);

}  // namespace tubule
