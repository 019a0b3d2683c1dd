// Subcommands that are Python: tools/python/tubule/drawing.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace tubule {

bool is_forwarded(std::string_view command);

// Python takes this process' place, with the words as they are. Returns only if that fails: the exit status.
int forward(const std::string& command, const std::vector<std::string>& words);

}  // namespace tubule
