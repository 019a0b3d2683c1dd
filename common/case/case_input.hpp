// What a case reads besides itself, as the result of its run keeps it.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace tubule {

struct CaseInput {
    std::string name;        // shape.path; of a result with the number of the frame
    std::uint64_t size = 0;  // bytes of the file, or of the frame
    std::uint32_t crc = 0;
    std::string bytes;  // empty where they are more than a result keeps
};
inline bool same_input(const CaseInput& a, const CaseInput& b) {
    return a.size == b.size && a.crc == b.crc;
}
using CaseInputs = std::vector<std::shared_ptr<const CaseInput>>;

}  // namespace tubule
