#include "tools/command/program.hpp"

#include <fmt/format.h>
#include <omp.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <exception>
#include <sstream>
#include <string>

#include "common/case/read.hpp"
#include "common/solve/message.hpp"
#include "common/solve/parallel.hpp"
#include "tools/command/build_info.hpp"
#include "tools/command/commands.hpp"
#include "tools/command/describe.hpp"
#include "tools/command/help.hpp"
#include "tools/command/streams.hpp"
#include "tools/command/text.hpp"

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
    // Last, since subcommands would inherit it.
    end_help(app, {}, {{0}, {1}, {2}, {3}, {4}, {5}, {130}}, {"case_files", "results"});
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {  // --help, too
        std::ostringstream out, complaint;
        const bool answers = app.exit(error, out, complaint) == 0;
        put_words(stderr, complaint.str());
        print_answer(out.str());
        return answers ? 0 : 2;
    }
    if (asks_version)
        print_answer(version());
    else if (asks_description)
        print_answer(description(app) + "\n");
    else if (app.get_subcommands().empty())
        print_answer(app.help());
    return status;
}

}  // namespace

int program(int argc, char** argv) {
    secure_streams();
    // Whatever the environment asks for: more threads than processors only wait, and too many cannot be started.
    omp_set_num_threads(std::min(omp_get_max_threads(), omp_get_num_procs()));
    multiply_on_one_thread();
    try {
        return run(argc, argv);
    } catch (const CaseError& error) {
        say(stderr, "{}\n", error.what());
        return 2;
    } catch (const OutputError& error) {
        say(stderr, "tubule: {}\n", error.what());
        return 2;
    } catch (const std::exception& error) {
        say(stderr, "tubule: {}\n", explanation(error));
        return 4;
    }
}

}  // namespace tubule
