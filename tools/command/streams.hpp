// The standard streams of the program.
#pragma once

#include <stdexcept>
#include <string_view>

namespace tubule {

// To be called before anything else. Opens /dev/null where a standard stream is closed, since a file opened later would
// take its place and receive our messages. Ignores the signals by which a pipe without a reader and the limit on file
// sizes would end the process: the write that meets them fails instead.
void secure_streams();

// What a command was asked for could not be written: exit status 2.
struct OutputError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

// What a command was asked for, to stdout. Throws OutputError.
void print_answer(std::string_view text);

}  // namespace tubule
