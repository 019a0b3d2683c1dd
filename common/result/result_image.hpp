// A result as the bytes of its file.
#pragma once

#include <cstddef>
#include <vector>

#include "common/result/result.hpp"

namespace tubule {

// The bytes of a file from which read_result() gives this result.
std::vector<std::byte> result_image(const Result& result);

}  // namespace tubule
