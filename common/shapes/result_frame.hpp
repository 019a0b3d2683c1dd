// Shape "result": a frame of a result of either tier.
#pragma once

#include <limits>
#include <string>

namespace tubule {

struct ResultFrame {
    static constexpr const char* kind = "result";
    std::string path;  // relative to the case file
    int frame = -1;    // from 0; negative: from the end
};

template <class Keys>
void keys(Keys& k, ResultFrame& result) {
    constexpr double most = std::numeric_limits<int>::max();
    k.text("path", result.path, k.required);
    k.integer("frame", result.frame, {.from = -most, .to = most});
}

}  // namespace tubule
