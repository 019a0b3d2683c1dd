// What a call is refused with.
#pragma once

#include <exception>
#include <string>

namespace tubule::test {

// The message of the Error that `call` throws, "accepted" if it throws none; other exceptions pass.
template <class Error = std::exception, class Call>
std::string message_of(Call&& call) {
    try {
        call();
    } catch (const Error& error) {
        return error.what();
    }
    return "accepted";
}

}  // namespace tubule::test
