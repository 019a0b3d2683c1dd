// The Python scripts that draw: tools/python/tubule/drawing.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace tubule {

// Runs the script with `input` on its standard input and waits for it. What it prints goes to standard error, for
// standard output is the table's. Its exit status, or 4 where it cannot be run (said on standard error).
int draw_by_script(const std::string& subcommand, const std::string& script, const std::vector<std::string>& arguments,
                   const std::string& input);

// What the script of the subcommand says of its options, as JSON: docs/schemas/describe.json. Throws
// std::runtime_error in the name of the subcommand if Python or the script are missing.
std::string described_by_script(const std::string& subcommand);

// Subcommands that are Python, plot, view, export and chart: it takes this process' place, with the words as they are,
// so that its exit status is ours. forward() returns, with an exit status, only if that fails.
bool is_forwarded(std::string_view command);
int forward(const std::string& command, const std::vector<std::string>& words);

}  // namespace tubule
