// Where tests find what they need.
#pragma once

#include <string>

namespace tubule::test {

extern const std::string program;  // the program `tubule`
extern const std::string sources;  // the folder of the repository
extern const std::string cases;    // the folder cases/

}  // namespace tubule::test
