#include "tools/command/describe.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <vector>

#include "tools/command/forward.hpp"
#include "tools/command/json.hpp"
#include "tools/command/python.hpp"
#include "tools/command/text.hpp"

namespace tubule {
namespace {

// The words of "{a,b,c}", which is how a list of choices names its type.
std::vector<std::string> choices(const std::string& type) {
    const auto open = type.find('{'), close = type.rfind('}');
    if (open == std::string::npos || close == std::string::npos) return {};
    return CLI::detail::split(type.substr(open + 1, close - open - 1), ',');
}

std::string described(const CLI::Option& option) {
    std::vector<std::string> names;
    for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
    for (const std::string& name : option.get_snames()) names.push_back("-" + name);
    const bool positional = names.empty();
    if (positional) names.push_back(option.get_name());
    const bool has_value = option.get_items_expected_max() > 0;
    return fmt::format(
        R"({{"names": {}, "positional": {}, "type": {}, "choices": {}, "default": {}, "repeated": {}, "required": {}, )"
        R"("description": {}}})",
        json(names), positional, json(has_value ? option.get_type_name() : ""), json(choices(option.get_type_name())),
        json(option.get_default_str()), has_value && option.get_items_expected_max() > 1, option.get_required(),
        json(option.get_description()));
}

}  // namespace

std::string description(const CLI::App& app) {
    std::string options, commands;
    for (const CLI::Option* option : app.get_options()) {
        if (option->get_group().empty()) continue;  // not shown by --help either
        add(options, "{}\n  {}", options.empty() ? "" : ",", described(*option));
    }
    for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
        add(commands, "{}\n{}", commands.empty() ? "" : ",",
            is_forwarded(command->get_name()) ? described_by_script(command->get_name()) : description(*command));
    return fmt::format(R"({{"name": {}, "description": {}, "footer": {}, "options": [{}], "commands": [{}]}})",
                       json(app.get_name()), json(app.get_description()), json(app.get_footer()), options, commands);
}

}  // namespace tubule
