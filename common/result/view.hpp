// view/NAME_000123.hdf beside a result NAME.hdf: a tiny file for each frame that has a mesh, in which VTK's reader
// finds it (by an external link), and view/NAME.hdf.series with their times. For ParaView 5.11; newer ones open
// NAME.hdf.
#pragma once

#include <filesystem>

#include "common/result/contents.hpp"

namespace tubule {

// Writes what is missing or differs, and removes what belongs to frames that no longer exist.
void write_view(const std::filesystem::path& result, const Contents& contents);

}  // namespace tubule
