#include "tools/command/json.hpp"

#include <cmath>

#include "common/case/text.hpp"

namespace tubule {

std::string json(const std::string& text) {
    std::string quoted = "\"";
    for (const char c : valid_utf8(text)) {
        if (c == '"' || c == '\\')
            quoted += {'\\', c};
        else if (static_cast<unsigned char>(c) < 0x20)
            quoted += fmt::format("\\u{:04x}", static_cast<int>(c));
        else
            quoted += c;
    }
    return quoted + '"';
}
// The shortest that reads back the same, with a point or exponent, so that 1.0 stays a floating-point number. -0 is 0.
std::string json(double value) {
    if (!std::isfinite(value)) return "null";
    const std::string digits = fmt::format("{}", value + 0.0);
    return digits.find_first_of(".e") == std::string::npos ? digits + ".0" : digits;
}
std::string json(std::int64_t value) {
    return fmt::format("{}", value);
}
std::string json(int value) {
    return fmt::format("{}", value);
}
std::string json(std::size_t value) {
    return fmt::format("{}", value);
}
std::string json(const Value& value) {
    return std::visit([](const auto& v) { return json(v); }, value);
}

}  // namespace tubule
