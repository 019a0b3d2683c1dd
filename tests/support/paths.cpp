#include "tests/support/paths.hpp"

namespace tubule::test {

const std::string program = TUBULE_PROGRAM;
const std::string sources = TUBULE_SOURCES;
const std::string cases = TUBULE_SOURCES "/cases";

}  // namespace tubule::test
