// tubule: membranes as fluid deformable surfaces.
#include <fmt/format.h>
#include <omp.h>

#include <CLI/CLI.hpp>
#include <Eigen/Core>
#include <algorithm>
#include <exception>
#include <sstream>
#include <string>

#include "common/case/read.hpp"
#include "common/solve/message.hpp"
#include "tools/command/build_info.hpp"
#include "tools/command/commands.hpp"
#include "tools/command/help.hpp"
#include "tools/command/streams.hpp"
#include "tools/command/text.hpp"

namespace {

std::string version() {
    std::string text;
    for (const auto& [name, value] : tubule::build_info()) text += fmt::format("{:<12} {}\n", name, value);
    return text;
}

// The exit status.
int run(int argc, char** argv) {
    CLI::App app("Membranes as fluid deformable surfaces whose bending energy is a function of H and K.", "tubule");
    app.require_subcommand(0, 1);
    bool asks_version = false;
    app.add_flag("--version", asks_version, "what this program is made of");
    int status = 0;
#define TUBULE_COMMAND(name) tubule::add_##name(app, status);
    TUBULE_COMMANDS(TUBULE_COMMAND)
#undef TUBULE_COMMAND
    // Last, since subcommands would inherit it.
    tubule::end_help(app, {}, {{0}, {1}, {2}, {3}, {4}, {5}, {130}}, {"case_files", "results"});
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {  // --help, too
        std::ostringstream out, complaint;
        const bool answers = app.exit(error, out, complaint) == 0;
        tubule::put_words(stderr, complaint.str());
        tubule::print_answer(out.str());
        return answers ? 0 : 2;
    }
    if (asks_version)
        tubule::print_answer(version());
    else if (app.get_subcommands().empty())
        tubule::print_answer(app.help());
    return status;
}

}  // namespace

int main(int argc, char** argv) {
    tubule::secure_streams();
    // Whatever the environment asks for: more threads than processors only wait, and too many cannot be started.
    omp_set_num_threads(std::min(omp_get_max_threads(), omp_get_num_procs()));
    // Dense matrices are small here: threads of a product would spend their time waiting for each other.
    Eigen::setNbThreads(1);
    try {
        return run(argc, argv);
    } catch (const tubule::CaseError& error) {
        tubule::say(stderr, "{}\n", error.what());
        return 2;
    } catch (const tubule::OutputError& error) {
        tubule::say(stderr, "tubule: {}\n", error.what());
        return 2;
    } catch (const std::exception& error) {
        tubule::say(stderr, "tubule: {}\n", tubule::explanation(error));
        return 4;
    }
}
