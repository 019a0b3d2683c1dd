#include "tools/command/describe.hpp"

#include <CLI/CLI.hpp>
#include <vector>

#include "tools/command/forward.hpp"
#include "tools/command/json.hpp"
#include "tools/command/python.hpp"

namespace tubule {
namespace {

// The words of "{a,b,c}", which is how a list of choices names its type.
std::vector<std::string> choices(const std::string& type) {
    const auto open = type.find('{'), close = type.rfind('}');
    if (open == std::string::npos || close == std::string::npos) return {};
    return CLI::detail::split(type.substr(open + 1, close - open - 1), ',');
}

Json described(const CLI::Option& option) {
    std::vector<std::string> names;
    for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
    for (const std::string& name : option.get_snames()) names.push_back("-" + name);
    const bool positional = names.empty();
    if (positional) names.push_back(option.get_name());
    const bool has_value = option.get_items_expected_max() > 0;
    return {{"names", names},
            {"positional", positional},
            {"type", has_value ? option.get_type_name() : ""},
            {"choices", choices(option.get_type_name())},
            {"default", option.get_default_str()},
            {"repeated", has_value && option.get_items_expected_max() > 1},
            {"required", option.get_required()},
            {"description", option.get_description()}};
}

Json described(const CLI::App& app) {
    Json options = Json::array(), commands = Json::array();
    for (const CLI::Option* option : app.get_options())
        if (!option->get_group().empty()) options.push_back(described(*option));  // others --help does not show either
    for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
        commands.push_back(is_forwarded(command->get_name()) ? Json::parse(described_by_script(command->get_name()))
                                                             : described(*command));
    return {{"name", app.get_name()},
            {"description", app.get_description()},
            {"footer", app.get_footer()},
            {"options", options},
            {"commands", commands}};
}

}  // namespace

std::string description(const CLI::App& app) {
    return line_of(described(app));
}

}  // namespace tubule
