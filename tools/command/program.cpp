#include "tools/command/program.hpp"

#include <fmt/format.h>
#include <omp.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <exception>
#include <sstream>
#include <string>

#include "common/case/read.hpp"
#include "common/solve/memory.hpp"
#include "common/solve/message.hpp"
#include "common/solve/parallel.hpp"
#include "common/solve/pause.hpp"
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

// OpenBLAS begins with a thread for each further processor, which we never use (use_one_blas_thread). Each asks for 128
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
