#include "tools/command/python.hpp"

#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "build_config.hpp"
#include "common/solve/message.hpp"
#include "tools/command/installed.hpp"

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

}  // namespace

std::vector<std::string> plot_command(const std::string& subcommand, const std::string& script) {
    if (access(python, X_OK) != 0)
        throw std::runtime_error(fmt::format(
            "tubule {} needs {}; install the packages python3 python3-matplotlib python3-h5py", subcommand, python));
    const auto folder = installed(TUBULE_PYTHON_DIR "/tubule/drawing", "tools/python/tubule/drawing");
    if (!std::filesystem::exists(folder / (script + ".py")))
        throw std::runtime_error(fmt::format(
            "tubule {}: its script {}.py is not in {}; install the package python3-tubule, or build tubule again",
            subcommand, script, folder.string()));
    return {python, "-B", folder, script};
}

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

int become(const std::string& subcommand, std::vector<std::string> command) {
    std::vector<char*> argv;
    for (std::string& argument : command) argv.push_back(argument.data());
    argv.push_back(nullptr);
    std::fflush(nullptr);
    setenv("TUBULE_PROGRAM", std::filesystem::read_symlink("/proc/self/exe").c_str(), 1);
    const Withheld interrupts;
    execv(argv[0], argv.data());
    say(stderr, "tubule {}: cannot start {}: {}\n", subcommand, command[0], std::strerror(errno));
    return no_picture;
}

}  // namespace tubule
