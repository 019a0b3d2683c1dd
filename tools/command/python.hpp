// The Python scripts that draw: tools/python/tubule/drawing.
#pragma once

#include <string>
#include <vector>

namespace tubule {

// The beginning of a command line that runs the script. Throws std::runtime_error in the name of the subcommand if
// Python or the script are missing.
std::vector<std::string> plot_command(const std::string& subcommand, const std::string& script);

// Runs the script with `input` on its standard input and waits for it. What it prints goes to standard error, for
// standard output is the table's. Its exit status, or 4 where it cannot be run (said on standard error).
int draw_by_script(const std::string& subcommand, const std::string& script, const std::vector<std::string>& arguments,
                   const std::string& input);

// What the script of the subcommand says of its options, as JSON: docs/schemas/describe.json. Throws as above.
std::string described_by_script(const std::string& subcommand);

// Python takes this process' place, so that its exit status is ours. Returns an exit status only if that is impossible.
int become(const std::string& subcommand, std::vector<std::string> command);

}  // namespace tubule
