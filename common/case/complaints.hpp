// All that is wrong with a case, key by key.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/case/read.hpp"

namespace tubule {

struct Complaint {
    std::string place;       // "file:line:column", or "--set key=value"
    std::string key;         // as in --set; "" for the whole file
    std::string what;        // in words, the key included
    std::string suggestion;  // what was probably meant instead of the last part of the key, or of its value; or ""
};

// The message has a line for each complaint.
struct CaseErrors : CaseError {
    explicit CaseErrors(std::vector<Complaint> all);
    std::vector<Complaint> complaints;
};

// Collects complaints while a case is read. What follows from a wrong key only is none: after the first complaint,
// conditions on several keys are left out; after one that decides which keys there are, keys that look unknown are,
// too.
struct Complaints {
    std::vector<Complaint> found;
    bool keys_in_doubt = false;

    bool any() const { return !found.empty(); }
};

}  // namespace tubule
