#include "tools/command/python.hpp"

#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <utility>

#include "build_config.hpp"
#include "common/result/result.hpp"
#include "common/solve/message.hpp"
#include "tools/command/commands.hpp"
#include "tools/command/options.hpp"
#include "tools/command/output.hpp"
#include "tools/run/continuation.hpp"
#include "tools/scan/scan_file.hpp"

namespace tubule {

namespace {

constexpr int no_picture = 4;
constexpr const char* python = "/usr/bin/python3";  // PATH's python3 may lack Debian's modules

// While it lives SIGINT waits, also for a program that is started now: Python would print a traceback until its script
// listens (drawing/__main__.py).
class Withheld {
public:
    Withheld() {
        sigset_t interrupt;
        sigemptyset(&interrupt), sigaddset(&interrupt, SIGINT);
        sigprocmask(SIG_BLOCK, &interrupt, &before_);
    }
    ~Withheld() { sigprocmask(SIG_SETMASK, &before_, nullptr); }
    Withheld(const Withheld&) = delete;
    Withheld& operator=(const Withheld&) = delete;

private:
    sigset_t before_;
};

using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

File temporary_file(const std::string& subcommand, const std::string& content) {
    File file(std::tmpfile(), std::fclose);
    if (!file || std::fwrite(content.data(), 1, content.size(), file.get()) != content.size() ||
        std::fflush(file.get()) != 0)
        throw std::runtime_error(fmt::format("tubule {}: cannot write a temporary file", subcommand));
    return file;
}

// Waits for the command, which reads the file from its beginning. Its exit status.
int wait_for(const std::string& subcommand, std::vector<std::string> command, std::FILE* input, int output) {
    std::vector<char*> argv;
    for (std::string& word : command) argv.push_back(word.data());
    argv.push_back(nullptr);
    lseek(fileno(input), 0, SEEK_SET);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, fileno(input), STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&actions, output, STDOUT_FILENO);
    pid_t child = 0;
    const int error = [&] {
        const Withheld interrupts;
        return posix_spawn(&child, argv[0], &actions, nullptr, argv.data(), environ);
    }();
    posix_spawn_file_actions_destroy(&actions);
    int status = 0;
    if (error != 0 || waitpid(child, &status, 0) != child)
        throw std::runtime_error(
            fmt::format("tubule {}: cannot start {}: {}", subcommand, command[0], std::strerror(error)));
    return WIFEXITED(status) ? WEXITSTATUS(status) : no_picture;
}

// The beginning of a command line that runs the script, which may call this program. Throws std::runtime_error in the
// name of the subcommand if Python or the script are missing.
std::vector<std::string> plot_command(const std::string& subcommand, const std::string& script) {
    if (access(python, X_OK) != 0)
        throw std::runtime_error(fmt::format(
            "tubule {} needs {}; install the packages python3 python3-matplotlib python3-h5py", subcommand, python));
    const auto folder = installed(TUBULE_PYTHON_DIR "/tubule/drawing", "tools/python/tubule/drawing");
    if (!std::filesystem::exists(folder / (script + ".py")))
        throw std::runtime_error(fmt::format(
            "tubule {}: its script {}.py is not in {}; install the package python3-tubule, or build tubule again",
            subcommand, script, folder.string()));
    setenv("TUBULE_PROGRAM", std::filesystem::read_symlink("/proc/self/exe").c_str(), 1);
    return {python, "-B", folder, script};
}

// Python takes this process' place. Returns an exit status only if that is impossible.
int become(const std::string& subcommand, std::vector<std::string> command) {
    std::vector<char*> argv;
    for (std::string& argument : command) argv.push_back(argument.data());
    argv.push_back(nullptr);
    std::fflush(nullptr);
    const Withheld interrupts;
    execv(argv[0], argv.data());
    say(stderr, "tubule {}: cannot start {}: {}\n", subcommand, command[0], std::strerror(errno));
    return no_picture;
}

}  // namespace

int draw_by_script(const std::string& subcommand, const std::string& script, const std::vector<std::string>& arguments,
                   const std::string& input) try {
    std::vector<std::string> command = plot_command(subcommand, script);
    command.insert(command.end(), arguments.begin(), arguments.end());
    // A file, not a pipe: a script that ends before it has read everything is then no trouble.
    const File file = temporary_file(subcommand, input);
    return wait_for(subcommand, std::move(command), file.get(), STDERR_FILENO);
} catch (const std::runtime_error& error) {
    say(stderr, "{}\n", error.what());
    return no_picture;
}

std::string described_by_script(const std::string& subcommand) {
    std::vector<std::string> command = plot_command(subcommand, subcommand);
    command.emplace_back("--describe");
    const File nothing = temporary_file(subcommand, ""), words = temporary_file(subcommand, "");
    if (wait_for(subcommand, std::move(command), nothing.get(), fileno(words.get())) != 0)
        throw std::runtime_error(fmt::format("tubule {}: its script cannot describe itself", subcommand));
    std::rewind(words.get());
    std::string out;
    for (int c = 0; (c = std::fgetc(words.get())) != EOF;) out += static_cast<char>(c);
    return out;
}

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
