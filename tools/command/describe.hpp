// All commands and options of the program, for those who write manual pages and completions of them.
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace tubule {

// As JSON: docs/schemas/describe.json.
std::string description(const CLI::App& app);

}  // namespace tubule
