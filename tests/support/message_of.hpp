// What a call is refused with, and words within a text.
#pragma once

#include <gtest/gtest.h>

#include <exception>
#include <string>

#define EXPECT_CONTAINS(text, part) EXPECT_NE(std::string(text).find(part), std::string::npos) << (text)

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
