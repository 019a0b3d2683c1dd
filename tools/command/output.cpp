#include "tools/command/output.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>

#include "common/solve/message.hpp"

namespace tubule {

void secure_streams() {
    // Each is opened the wrong way round, so that using it fails as it would have if it had stayed closed.
    for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
        if (fcntl(stream, F_GETFD) < 0 && errno == EBADF)
            open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY);  // gets the lowest free number: this one
    std::signal(SIGPIPE, SIG_IGN);
    std::signal(SIGXFSZ, SIG_IGN);
}

int refuse_file(const std::string& file, const std::string& words) {
    const bool named = words.find(file) != std::string::npos;
    say(stderr, "{}{}{}\n", named ? "" : file, named ? "" : ": ", words);
    return 2;
}

void print_answer(std::string_view text) {
    if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0)
        throw OutputError(fmt::format("cannot write the output: {}", std::strerror(errno)));
}

namespace {

void drop_signs_of_zero(Json& json) {
    if (json.is_structured())
        for (Json& part : json) drop_signs_of_zero(part);
    else if (json.is_number_float() && json.get<double>() == 0)
        json = 0.0;
}

}  // namespace

std::string csv_of(const std::vector<std::string>& columns, const Json& rows) {
    std::string out = fmt::format("{}\n", fmt::join(columns, ","));
    for (const Json& row : rows)
        for (const std::string& column : columns) {
            const Json value = row.contains(column) ? row[column] : Json();
            if (value.is_string())
                out += value.get<std::string>();
            else if (value.is_number_float())
                add(out, "{:.17g}", value.get<double>());
            else if (!value.is_null())
                out += value.dump();
            out += &column == &columns.back() ? "\n" : ",";
        }
    return out;
}

std::string line_of(Json json) {
    drop_signs_of_zero(json);
    return json.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace tubule
