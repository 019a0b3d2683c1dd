// tubule plot, view, export, chart: the scripts of tools/python/tubule/drawing read their arguments, which pass through
// unread.
#include "tools/command/forward.hpp"

#include <CLI/CLI.hpp>
#include <stdexcept>

#include "common/result/result.hpp"
#include "common/solve/message.hpp"
#include "tools/command/commands.hpp"
#include "tools/command/python.hpp"
#include "tools/command/text.hpp"
#include "tools/run/continuation.hpp"
#include "tools/scan/scan_file.hpp"

namespace tubule {
namespace {

// HDF5 may crash over a damaged file: Python reads none.
void refuse_damaged(const std::vector<std::string>& words) {
    for (const std::string& word : words) {
        const std::string file = word.starts_with("-") ? word.substr(word.find('=') + 1) : word;
        if (is_hdf5(file) && !is_scan(file)) require_result(file);
    }
}

}  // namespace

bool is_forwarded(std::string_view command) {
    return command == "plot" || command == "view" || command == "export" || command == "chart";
}

int forward(const std::string& command, const std::vector<std::string>& words) {
    int failed = 2;
    try {
        refuse_damaged(words);
        failed = 4;
        std::vector<std::string> all = plot_command(command, command);
        all.insert(all.end(), words.begin(), words.end());
        return become(command, all);
    } catch (const std::runtime_error& error) {
        say(stderr, "{}\n", explanation(error));
        return failed;
    }
}

void add_plot(CLI::App& app, int&) {
    app.add_subcommand("plot", "Draw shapes and cuts through them at the output times, and energies over time");
}

void add_view(CLI::App& app, int&) {
    app.add_subcommand(
        "view", "Write one HTML page with the shapes of a result, to turn in a browser, or with the map of a scan");
}

void add_export(CLI::App& app, int&) {
    app.add_subcommand("export", "Write a shape of a result as flat triangles: STL, PLY or OBJ");
}

void add_chart(CLI::App& app, int&) {
    app.add_subcommand("chart", "Run a case with many settings, and draw error against CPU time");
}

}  // namespace tubule
