// The Python scripts of tools/plot, for the subcommands that draw.
#pragma once

#include <string>
#include <vector>

namespace tubule {

// The beginning of a command line that runs the script. Throws std::runtime_error in the name of the subcommand if
// Python or the script are missing.
std::vector<std::string> plot_command(const std::string& subcommand, const std::string& script);

}  // namespace tubule
