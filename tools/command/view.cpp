// tubule view RESULT: writes a page for a browser by the Python scripts of tools/python/tubule/drawing.
#include <CLI/CLI.hpp>
#include <memory>
#include <stdexcept>
#include <string>

#include "common/result/result.hpp"
#include "common/solve/message.hpp"
#include "tools/command/commands.hpp"
#include "tools/command/help.hpp"
#include "tools/command/python.hpp"
#include "tools/command/text.hpp"
#include "tools/scan/scan_file.hpp"

namespace tubule {
namespace {

struct ViewOptions {
    std::string result, output;
};

int view(const ViewOptions& options) {
    try {
        if (!is_scan(options.result)) require_result(options.result);
    } catch (const std::runtime_error& error) {
        say(stderr, "{}\n", explanation(error));
        return 2;
    }
    try {
        std::vector<std::string> arguments = plot_command("view", "view");
        if (!options.output.empty()) arguments.push_back("--output=" + options.output);
        arguments.insert(arguments.end(), {"--", options.result});
        return become("view", arguments);
    } catch (const std::runtime_error& error) {
        say(stderr, "{}\n", explanation(error));
        return 4;
    }
}

}  // namespace

void add_view(CLI::App& app, int& exit_status) {
    CLI::App* command = app.add_subcommand(
        "view", "Write one HTML page with the shapes of a result, to turn in a browser, or with the map of a scan");
    const auto options = std::make_shared<ViewOptions>();
    command->add_option("RESULT", options->result, "result of run, equilibrium or scan")->required();
    command->add_option("-o,--output", options->output, "page to write (default: RESULT.html)");
    end_help(*command, {"tubule view figure.hdf"}, {{0}, {2}, {4, "the page could not be made"}}, {"pictures"});
    command->callback([options, &exit_status] { exit_status = view(*options); });
}

}  // namespace tubule
