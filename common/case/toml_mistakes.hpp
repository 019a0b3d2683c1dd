// Mistakes that people make in TOML, in their words: a parser only says which character it did not expect.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace tubule {

struct TomlMistake {
    std::size_t line = 0, column = 0;  // from 1; in characters
    std::string words;                 // what is wrong, and what to write
};

// What is wrong where the parser stopped, if it is a common mistake; `description` are the words of TOML++.
std::optional<TomlMistake> toml_mistake(std::string_view text, std::size_t line, std::size_t column,
                                        const std::string& description);

// The position behind the string that begins at `from`; a string that its line does not close ends with the line.
std::size_t end_of_string(std::string_view text, std::size_t from);

}  // namespace tubule
