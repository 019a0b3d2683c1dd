#include "tools/command/program.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <omp.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <exception>
#include <regex>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/case/read.hpp"
#include "common/case/text.hpp"
#include "common/solve/memory.hpp"
#include "common/solve/message.hpp"
#include "common/solve/parallel.hpp"
#include "common/solve/pause.hpp"
#include "tools/command/build_info.hpp"
#include "tools/command/commands.hpp"
#include "tools/command/options.hpp"
#include "tools/command/output.hpp"
#include "tools/command/python.hpp"

namespace tubule {

namespace {

std::string version() {
    std::string text;
    for (const auto& [name, value] : build_info()) text += fmt::format("{:<12} {}\n", name, value);
    for (const std::string& part : lacking()) text += fmt::format("{:<12} {}\n", "lacks", part);
    if (!lacking().empty())
        text += fmt::format("{:<12} then cmake --preset release && cmake --build --preset release\n", "");
    return text;
}

// ---- all commands and options as JSON, docs/schemas/describe.json

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

std::string description(const CLI::App& app) {
    return line_of(described(app));
}

// ----

// `tubule help COMMAND` is `tubule COMMAND --help`.
std::vector<const char*> arguments_of(int argc, char** argv, const CLI::App& app) {
    std::vector<const char*> arguments(argv, argv + argc);
    if (argc < 2 || std::string_view(argv[1]) != "help") return arguments;
    arguments.erase(arguments.begin() + 1);
    const auto commands = app.get_subcommands([](const CLI::App*) { return true; });
    const auto known = [&](const CLI::App* one) { return one->get_name() == arguments.back(); };
    if (argc != 3 || std::ranges::any_of(commands, known)) arguments.push_back("--help");
    return arguments;
}

// What may have been meant by a word that the command does not know; else empty.
std::string meant_by(const std::string& word, const CLI::App& command) {
    std::vector<std::string> names;
    if (word.starts_with("-"))
        for (const CLI::Option* option : command.get_options())
            for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    else
        for (const CLI::App* one : command.get_subcommands({})) names.push_back(one->get_name());
    if (std::string near = tubule::meant_by(word, names); !near.empty()) return near;
    if (word.starts_with("\u2013") || word.starts_with("\u2014"))
        return "; an option begins with the hyphen of the keyboard, -";
    if (word.starts_with("-") && !command.get_subcommands({}).empty())
        return "; options follow the name of a command, such as tubule run CASE -o FILE";
    if (word.starts_with("-"))
        return fmt::format(
            "; options are {}{}", fmt::join(names, " "),
            command.get_option_no_throw("--set") ? "; keys of a case are changed by --set key=value" : "");
    if (!names.empty() && word.ends_with(".toml")) return fmt::format("; to run a case: tubule run {}", word);
    if (!names.empty() && word.ends_with(".hdf")) return fmt::format("; to look at a result: tubule show {}", word);
    if (!names.empty()) return fmt::format("; the commands are {}", fmt::join(names, " "));
    return "";
}

// Words that nothing asked for, in the order in which they were given.
std::string unexpected_words(const CLI::App& app) {
    const CLI::App* command = &app;
    while (command->remaining().empty() && !command->get_subcommands().empty())
        command = command->get_subcommands().front();
    const std::string name = command == &app ? "tubule" : "tubule " + command->get_name();
    const std::vector<std::string> words = command->remaining();
    return fmt::format("{}: not expected: {}{}\nRun `{} --help` for more information.\n", name, fmt::join(words, " "),
                       words.empty() ? "" : meant_by(words.front(), *command), name);
}

// The complaint of CLI11 about an option or a file, in plain words, with what is meant by it.
std::string plain_words(const std::string& complaint, const CLI::App& app) {
    constexpr std::pair<const char*, const char*> forms[]{
        {R"((\S+): \d+ required \S+ missing)", "$1: a value is missing after it"},
        {R"((\S+): At least (\d+) required but received (\d+))", "$1: $2 are needed, $3 given"},
        {R"((\S+): Value (\S+) not in range (\S+) to (\S+))", "$1: $2 is not a number from $3 to $4"},
        {R"((\S+) is required)", "$1 is missing"},
        {R"(Could not convert: (\S+) = ?(.*))", "$1: '$2' is not a value that it takes"},
        {R"((\S+) excludes (\S+))", "$1 and $2 cannot be given together"},
        {R"((\S+) requires (\S+))", "$1 needs $2"}};
    const CLI::App& command = app.get_subcommands().empty() ? app : *app.get_subcommands().front();
    std::smatch parts;
    for (const auto& [form, words] : forms) {
        if (!std::regex_match(complaint, parts, std::regex(form))) continue;
        const CLI::Option* option = command.get_option_no_throw(parts[1]);
        return parts.format(words) + (option ? ": " + option->get_description() : "");
    }
    return complaint;
}

// In all commands: -o without a name would be no -o, and a blank is no name that anybody means.
void refuse_blank_outputs(CLI::App& app) {
    const auto blank = [](const std::string& name) {
        return name.find_first_not_of(" \t\n") == name.npos ? "must not be blank: give the file a name" : "";
    };
    for (CLI::App* command : app.get_subcommands({}))
        for (CLI::Option* option : command->get_options())
            if (option->check_lname("output"))
                option->check(
                    CLI::Validator([blank](const std::string& name) { return std::string(blank(name)); }, ""));
}

// The exit status.
int run(int argc, char** argv) {
    CLI::App app("Membranes as fluid deformable surfaces whose bending energy is a function of H and K.", "tubule");
    app.require_subcommand(0, 1);
    bool asks_version = false, asks_description = false;
    app.add_flag("--version", asks_version, "what this program is made of");
    app.add_flag("--describe", asks_description, "all commands and their options as JSON");
    int status = 0;
#define TUBULE_COMMAND(name) add_##name(app, status);
    TUBULE_COMMANDS(TUBULE_COMMAND)
#undef TUBULE_COMMAND
    refuse_blank_outputs(app);
    // Last, since subcommands would inherit it.
    end_help(app, {}, {{0}, {1}, {2}, {3}, {4}, {5}, {130}}, {"case_files", "results"});
    try {
        const std::vector<const char*> arguments = arguments_of(argc, argv, app);
        if (arguments.size() > 1 && is_forwarded(arguments[1]))
            return forward(arguments[1], {arguments.begin() + 2, arguments.end()});
        app.parse(static_cast<int>(arguments.size()), arguments.data());
    } catch (const CLI::ExtrasError&) {
        put_words(stderr, unexpected_words(app));
        return 2;
    } catch (const CLI::ParseError& error) {  // --help, too
        std::ostringstream out, complaint;
        const bool answers = app.exit(error, out, complaint) == 0;
        if (!answers) put_words(stderr, plain_words(error.what(), app) + "\nRun with --help for more information.\n");
        print_answer(out.str());
        return answers ? 0 : 2;
    }
    if (asks_version)
        print_answer(version());
    else if (asks_description)
        print_answer(description(app));
    else if (app.get_subcommands().empty())
        print_answer(app.help());
    return status;
}

// OpenBLAS begins with a thread for each further processor, which we never use (prepare_blas). Each asks for 128
// MB, forever if there are none, and the process waits for it at its end. Where memory is limited it begins anew
// without them.
void do_without_blas_threads(char** argv) {
    if (!limited_memory() || std::getenv("OPENBLAS_NUM_THREADS")) return;
    setenv("OPENBLAS_NUM_THREADS", "1", 1);
    execv("/proc/self/exe", argv);  // returns only where it fails
}

// Each thread has its part of the address space: a stack, a heap, what the BLAS takes.
int threads_in_memory() {
    constexpr double bytes = 256e6;
    return limited_memory() ? static_cast<int>(std::clamp(free_memory() / bytes, 1.0, 1e6)) : 1'000'000;
}

}  // namespace

int program(int argc, char** argv) {
    do_without_blas_threads(argv);
    secure_streams();
    // Whatever the environment asks for: more threads than processors only wait, and too many cannot be started.
    omp_set_num_threads(std::min({omp_get_max_threads(), omp_get_num_procs(), threads_in_memory()}));
    multiply_on_one_thread();
    try {
        return run(argc, argv);
    } catch (const CaseError& error) {
        say(stderr, "{}\n", error.what());
        return 2;
    } catch (const OutputError& error) {
        say(stderr, "tubule: {}\n", error.what());
        return 2;
    } catch (const Paused& pause) {
        say(stderr, "tubule: {}\n", name(pause.reason));
        return exit_code(pause.reason);
    } catch (const std::exception& error) {
        say(stderr, "tubule: {}\n", explanation(error));
        return 4;
    }
}

}  // namespace tubule
