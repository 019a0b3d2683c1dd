// The subcommands of `tubule`, one file each. add_X registers subcommand X; its callback sets the exit status.
#pragma once

namespace CLI {
class App;
}

namespace tubule {

void add_run(CLI::App& app, int& exit_status);
void add_check(CLI::App& app, int& exit_status);
void add_show(CLI::App& app, int& exit_status);
void add_plot(CLI::App& app, int& exit_status);

}  // namespace tubule
