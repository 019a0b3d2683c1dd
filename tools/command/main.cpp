// tubule: membranes as fluid deformable surfaces.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <exception>

#include "common/case/read.hpp"
#include "tools/command/build_info.hpp"
#include "tools/command/commands.hpp"

int main(int argc, char** argv) {
    CLI::App app("Membranes as fluid deformable surfaces with bending energies of any order in H and K.", "tubule");
    app.require_subcommand(0, 1);
    bool version = false;
    app.add_flag("--version", version, "what this program is made of");
    int status = 0;
#define TUBULE_COMMAND(name) tubule::add_##name(app, status);
    TUBULE_COMMANDS(TUBULE_COMMAND)
#undef TUBULE_COMMAND
    try {
        app.parse(argc, argv);
        if (version)
            for (const auto& [name, value] : tubule::build_info()) fmt::print("{:<12} {}\n", name, value);
        else if (app.get_subcommands().empty())
            fmt::print("{}", app.help());
        return status;
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : 2;
    } catch (const tubule::CaseError& error) {
        fmt::print(stderr, "{}\n", error.what());
        return 2;
    } catch (const std::exception& error) {
        fmt::print(stderr, "tubule: {}\n", error.what());
        return 4;
    }
}
