// A record without one of its fields is refused, whichever it is.
#pragma once

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>

#include "common/result/record.hpp"

namespace tubule {

// Callbacks that lack what they knew begin anew: those of another version, or of a case without them.
inline bool is_of_callback(const std::string& name) {
    return name.find("restart_callback_") != name.npos;
}

// Takes away one field after the other of those whose names begin so; `read` must then throw `Error` that names it.
template <class Error, class Read>
void expect_each_field_is_needed(const Record& record, const std::string& prefix, const Read& read) {
    EXPECT_NO_THROW(read(record));
    int fields = 0;
    const auto expect_refused = [&](const Record& damaged, const std::string& name) {
        ++fields;
        try {
            read(damaged);
            ADD_FAILURE() << "accepted without " << name;
        } catch (const Error& error) {
            // That of a record within the record goes by the name that it has there.
            const std::string words = error.what(), before = words.substr(0, words.find(" is missing"));
            EXPECT_TRUE(name.ends_with(before.substr(before.rfind(' ') + 1))) << words;
        }
    };
    for (std::size_t i = 0; i < record.numbers.size(); ++i) {
        const std::string& name = record.numbers[i].first;
        if (!name.starts_with(prefix) || is_of_callback(name)) continue;
        Record damaged = record;
        damaged.numbers.erase(damaged.numbers.begin() + static_cast<std::ptrdiff_t>(i));
        expect_refused(damaged, name);
    }
    for (std::size_t i = 0; i < record.arrays.size(); ++i) {
        if (!record.arrays[i].name.starts_with(prefix)) continue;
        Record damaged = record;
        damaged.arrays.erase(damaged.arrays.begin() + static_cast<std::ptrdiff_t>(i));
        expect_refused(damaged, record.arrays[i].name);
    }
    EXPECT_GT(fields, 0) << "no field begins with " << prefix;
}

}  // namespace tubule
