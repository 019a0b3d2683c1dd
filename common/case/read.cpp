#include "common/case/read.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>

#include "common/case/overrides.hpp"
#include "common/case/reader.hpp"

namespace tubule {

Case parse_case(const std::string& text, const std::vector<std::string>& sets, const std::string& path) {
    toml::table root;
    try {
        root = toml::parse(text, std::string_view(path));
    } catch (const toml::parse_error& error) {
        throw CaseError(fmt::format("{}: not valid TOML: {}", place(error.source()), error.description()));
    }
    for (const std::string& set : sets) apply_override(root, set);

    Case c;
    c.path = path;
    c.text = text;
    c.sets = sets;
    try {
        Reader::read(root, "", path + ":1:1", [&](Reader& k) { keys(k, c); });
    } catch (const CaseError& error) {
        // Several keys may cause the error, among them an override.
        const std::string message = error.what();
        if (sets.empty() || message.starts_with("--set ")) throw;
        throw CaseError(fmt::format("{} (with --set {})", message, fmt::join(sets, " --set ")));
    }
    if (!c.model.keeps_volume && !c.equilibrium) c.model.keeps_volume = motion_law(c.model).keeps_volume;
    if (c.tier != Tier::axisym && !root.at_path("accuracy.r_min")) c.accuracy.r_min = 1e-2;
    if (root.contains("expect") && !c.expect.stop) c.expect.stop = Stop::finished;
    return c;
}

Case read_case(const std::filesystem::path& path, const std::vector<std::string>& sets) {
    std::error_code none;
    if (std::filesystem::is_directory(path, none)) throw CaseError(path.string() + ": is a directory, not a case file");
    std::ifstream file(path, std::ios::binary);
    if (!file) throw CaseError(fmt::format("{}: cannot be opened: {}", path.string(), std::strerror(errno)));
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    return parse_case(text, sets, path.string());
}

}  // namespace tubule
