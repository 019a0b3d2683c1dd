#include "common/case/read.hpp"

#include <fmt/format.h>

#include <utility>

#include "common/case/complaints.hpp"
#include "common/case/input_file.hpp"
#include "common/case/overrides.hpp"
#include "common/case/reader.hpp"
#include "common/case/requirements.hpp"

namespace tubule {
namespace {

constexpr std::size_t most_of_profile = 32 * megabyte;

// Terms of the case that are those of the list, with the branch that varies one of them. Messages find them where they
// stand.
void merge_terms(Case& c) {
    for (const EnergyTerm& listed : c.energy.terms)
        if (const std::size_t number = listed_as(listed); number < n_bending_terms)
            c.places[term_key(c.energy, number)] = c.places[fmt::format("energy.term.{}.modulus", listed.entry)];
    std::optional<int> none, &varied = c.equilibrium ? c.equilibrium->branch.parameter : none;
    std::optional<EnergyTerm> term;
    if (varied >= static_cast<int>(n_bending_terms)) term = c.energy.terms[*varied - n_bending_terms];
    merge_listed_terms(c.energy);
    if (!term) return;
    std::size_t number = listed_as(*term);
    while (number >= n_bending_terms && c.energy.terms[number - n_bending_terms].entry != term->entry) ++number;
    varied = static_cast<int>(number);
}

// The first requirement of a given key that the case does not meet.
void check_requirements(const toml::table& root, const Case& c, Complaints& complaints) {
    const Problem problem(c);
    for (const Requirement& row : requirements()) {
        const bool from_points = row.key == "energy.H0" && c.energy.H0_from_points();
        const std::string key = from_points ? "shape.path" : row.key;
        const toml::node_view given = root.at_path(key);
        const Property* missing = given ? missing_property(row, problem) : nullptr;
        if (!missing) continue;
        const std::string value = toml_string(given.value_or<std::string>(""));
        complaints.found.push_back(
            {place(given.node()->source()), key,
             fmt::format("{} {}must {} only valid with {}{}{}", key, from_points ? "has a column H0, but H0 " : "",
                         fmt::format(fmt::runtime(row.instead), value), missing->words, row.reason.empty() ? "" : "; ",
                         row.reason),
             ""});
        return;
    }
}

// What its keys say; all that is wrong is thrown. `H0`: from the points of its profile.
Case read_keys(const toml::table& root, const std::vector<std::string>& sets, const std::string& path,
               std::shared_ptr<const Formula> H0) {
    Case c;
    c.energy.H0_formula = std::move(H0);
    Complaints complaints;
    Reader::read(root, "", path + ":1:1", complaints, [&](Reader& k) { keys(k, c); });
    if (!complaints.any()) check_requirements(root, c, complaints);
    if (!complaints.any()) return c;
    for (Complaint& one : complaints.found)  // several keys may cause it, among them an override
        if (!sets.empty() && !one.place.starts_with("--set "))
            one.what += fmt::format(" (with --set {})", fmt::join(sets, " --set "));
    throw CaseErrors(std::move(complaints.found));
}

// That of the points of a profile, if its file has it; where the file cannot be read, the run says so.
std::shared_ptr<const Formula> H0_of_points(const Case& c, const toml::table& root) {
    const auto* file = std::get_if<ProfileFile>(&c.shape);
    if (!file) return nullptr;
    std::string column;
    try {
        column = place_of_H0(beside(c, file->path), shape_bytes(c, file->path, most_of_profile));
    } catch (const CaseError&) {
    }
    if (column.empty()) return nullptr;
    if (const toml::node_view given = root.at_path("energy.H0"))
        throw CaseErrors(
            {{place(given.node()->source()), "energy.H0",
              fmt::format("energy.H0 must be absent: {} has H0 in a column; or take that out", column), ""}});
    return start_profile(c, *file).H0;
}

}  // namespace

Case parse_case(const std::string& text, const std::vector<std::string>& sets, const std::string& path,
                const CaseInputs& inputs) {
    toml::table root = parse_toml(text, path);
    for (const std::string& set : sets) apply_override(root, set);

    Case c = read_keys(root, sets, path, nullptr);
    const auto place = [&] {
        c.path = path;
        for (const auto& input : inputs)
            if (input->name == input_name(c.shape)) c.input = input;
    };
    place();
    if (auto H0 = H0_of_points(c, root))
        c = read_keys(root, sets, path, std::move(H0)), place();  // other conditions hold
    c.text = text;
    c.sets = sets;
    walk(root, "", [&](const std::string& key, const toml::node& node) {
        if (!key.empty()) c.places[key] = tubule::place(node.source());
        return true;
    });
    merge_terms(c);
    std::visit(
        [](auto& shape) {
            if constexpr (requires { make_noise(shape); }) make_noise(shape);
        },
        c.shape);
    if (c.model.chosen) c.model.kind = *std::exchange(c.model.chosen, {});
    if (const ModelEntry& has = model_entry(c.model.kind); has.inextensible && !c.model.gamma)
        c.model.gamma = default_friction(has);
    if (!c.model.keeps_volume && !c.equilibrium) c.model.keeps_volume = motion_law(c.model).keeps_volume;
    if (!c.model.area && !c.equilibrium) c.model.area = area_rule(c.model);
    if (c.tier != Tier::axisym && !root.at_path("accuracy.r_min")) c.accuracy.r_min = 1e-2;
    if (c.tier != Tier::axisym && c.moves() && !root.at_path("accuracy.energy")) c.accuracy.energy = 1e-3;
    if (root.contains("expect") && !c.expect.stop) c.expect.stop = Stop::finished;
    if (c.units) scales_of(c);  // refuses what contradicts the case
    return c;
}

Case read_case(const std::filesystem::path& path, const std::vector<std::string>& sets, const CaseInputs& inputs) {
    return parse_case(read_input(path, megabyte), sets, path.string(), inputs);
}

CaseInputs inputs_of(const Case& c) {
    return c.input ? CaseInputs{c.input} : CaseInputs{};
}

std::string input_name(const Shape& shape) {
    if (const auto* result = std::get_if<ResultFrame>(&shape))
        return fmt::format("{}, frame {}", result->path, result->frame);
    if (const auto* profile = std::get_if<ProfileFile>(&shape)) return profile->path;
    if (const auto* mesh = std::get_if<MeshFile>(&shape)) return mesh->path;
    return {};
}

std::filesystem::path beside(const Case& c, const std::string& path) {
    return std::filesystem::path(c.path).parent_path() / path;
}

std::string shape_bytes(const Case& c, const std::string& path, std::size_t most) {
    return c.input && !c.input->bytes.empty() ? c.input->bytes : read_input(beside(c, path), most);
}

FittedProfile start_profile(const Case& c, const ProfileFile& file) {
    const std::filesystem::path path = beside(c, file.path);
    std::error_code error;
    if (!(c.input && !c.input->bytes.empty()) && !std::filesystem::is_regular_file(path, error))
        throw complaint(c, "shape.path", fmt::format("cannot be used: {}: there is no such file", path.string()));
    const std::string bytes = shape_bytes(c, file.path, most_of_profile);
    if (const auto other = no_plain_text(bytes); !other.empty())
        throw CaseError(fmt::format("{}: is {}: save the points as CSV, plain text in UTF-8", path.string(), other));
    try {
        return read_profile(path, bytes, file);
    } catch (const ProfileError& error) {
        throw CaseError(error.what());
    }
}

CaseError complaint(const Case& c, const std::string& key, const std::string& what) {
    std::string held = key;
    while (!held.empty() && !c.places.contains(held)) held.erase(held.find('.') == held.npos ? 0 : held.rfind('.'));
    return CaseError(fmt::format("{}: {} {}", held.empty() ? c.path : c.places.at(held), key, what));
}

CaseError complaint_about_H0(const Case& c, const std::string& what) {
    return c.energy.H0_from_points() ? complaint(c, "shape.path", "has a column H0, but H0 " + what)
                                     : complaint(c, "energy.H0", what);
}

}  // namespace tubule
