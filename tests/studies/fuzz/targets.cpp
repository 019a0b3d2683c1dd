#include "tests/studies/fuzz/targets.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numbers>
#include <stdexcept>
#include <string_view>

#include "common/case/read.hpp"
#include "common/formula/formula.hpp"
#include "common/shapes/profile_file.hpp"
#include "surface3d/import/import_check.hpp"
#include "surface3d/import/import_fit.hpp"
#include "tests/support/paths.hpp"
#include "tests/surface3d/import_files.hpp"
#include "tools/scan/description.hpp"

namespace fs = std::filesystem;

namespace tubule::fuzz {

fs::path file_of(Input input, const std::string& ending) {
    const fs::path path = fs::temp_directory_path() / fmt::format("tubule_fuzz_{}.{}", getpid(), ending);
    std::ofstream(path, std::ios::binary).write(reinterpret_cast<const char*>(input.data()), std::ssize(input));
    return path;
}

namespace {

std::string text_of(Input input) {
    return {reinterpret_cast<const char*>(input.data()), input.size()};
}

std::vector<std::string> files_of(const fs::path& folder, const std::string& ending) {
    std::vector<std::string> texts;
    for (const auto& entry : fs::directory_iterator(folder)) {
        if (entry.path().extension() != ending) continue;
        std::ifstream file(entry.path(), std::ios::binary);
        texts.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
    }
    return texts;
}

// ---- cases

// What is accepted comes out of its own output unchanged.
void case_text(Input input) {
    try {
        const std::string resolved = effective_toml(parse_case(text_of(input), {}, "case.toml"));
        std::string again;
        try {
            again = effective_toml(parse_case(resolved, {}, "again.toml"));
        } catch (const CaseError& error) {
            throw std::logic_error(fmt::format("the resolved case is refused: {}\n{}", error.what(), resolved));
        }
        if (again != resolved) throw std::logic_error("the resolved case resolves to another:\n" + resolved + again);
    } catch (const CaseError&) {
    }
}

std::vector<std::string> case_seeds() {
    return files_of(test::cases, ".toml");
}

constexpr const char* base_case = R"(tier = "axisym"
energy = {k20 = 0.5, H0 = -1.0}
shape = {kind = "tube", radius = 1.0, length = 3.0, mode = [{amplitude = 0.1, n = 1}]}
accuracy = {energy = 1e-4}
time = {end = 0.2, output = [0.01]}
)";

void override_text(Input input) {
    try {
        parse_case(base_case, {text_of(input)}, "case.toml");
    } catch (const CaseError&) {
    }
}

std::vector<std::string> override_seeds() {
    return {"energy.k42=0.1", "shape.mode.1={amplitude = 0.1, n = 2}", "shape.kind=sphere", "time.output=[0.1, 0.15]",
            "expect.at.0.time=0.1"};
}

// ---- scans

void scan_text(Input input) {
    const std::string text = text_of(input);
    for (const auto& parse :
         {+[](const std::string& t) { parse_axis(t); }, +[](const std::string& t) { parse_table(t, "points.csv"); }}) {
        try {
            parse(text);
        } catch (const CaseError&) {
        }
    }
    ScanChoices choices;
    choices.file = file_of(input, "toml").string();
    try {
        read_scan(choices);
    } catch (const CaseError&) {
    }
}

std::vector<std::string> scan_seeds() {
    std::vector<std::string> seeds = files_of(fs::path(test::cases) / "scans", ".toml");
    seeds.insert(seeds.end(),
                 {"energy.k42=0:0.1:3", "energy.k42=1e-3:1:3:log", "a=1,[2,3],\"x\"", "energy.k42,time.end\n0.1,2\n"});
    return seeds;
}

// ---- meshes

// The first byte chooses the format; the others are the file.
constexpr const char* endings[] = {"obj", "off", "ply", "stl"};

void mesh_file(Input input) {
    if (input.empty()) return;
    const auto choice = std::to_integer<unsigned>(input[0]);
    const fs::path file = file_of(input.subspan(1), endings[choice % std::size(endings)]);
    using namespace surface3d;
    try {
        ImportedMesh mesh = read_mesh(file, choice & 0x40 ? 1e-3 : 0);
        close_mesh(mesh);
        if (mesh.mesh.triangles.size() <= 200) fit_surface(mesh, {.order = 3, .smoothing = choice & 0x80 ? 1 : 0});
    } catch (const MeshError&) {
    }
}

std::vector<std::string> mesh_seeds() {
    using namespace surface3d::samples;
    surface3d::TriangleMesh mesh;
    mesh.points = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    return {'\0' + obj(mesh),
            '\1' + off(mesh),
            '\2' + ply(mesh, "ascii"),
            '\2' + ply(mesh, "binary_little_endian"),
            '\2' + ply(mesh, "binary_big_endian"),
            '\3' + stl_ascii(mesh),
            '\3' + stl_binary(mesh)};
}

// ---- profiles and formulas

void profile_text(Input input) {
    try {
        const FittedProfile profile =
            read_profile("input.csv", std::string(reinterpret_cast<const char*>(input.data()), input.size()), {});
        for (const double value : profile.curve.at(0.3))
            if (!std::isfinite(value)) throw std::logic_error("a curve of nan or inf");
        const double middle = 0.5;
        if (profile.H0 && !std::isfinite(evaluate(*profile.H0, &middle))) throw std::logic_error("an H0 of nan or inf");
    } catch (const ProfileError&) {
    }
}

std::vector<std::string> profile_seeds() {
    std::string ring, cell;
    for (int i = 0; i <= 16; ++i) {
        const double t = std::numbers::pi * i / 8, s = t / 2;
        ring += fmt::format("{} {}\n", 2 + std::cos(i % 16 * std::numbers::pi / 8), std::sin(t) * (i % 8 != 0));
        cell += fmt::format("{};{}\n", i % 16 == 0 ? 0 : std::sin(s), -1.5 * std::cos(s));
    }
    std::string with_H0 = "r z H0\n";
    for (int i = 0; i <= 16; ++i) {
        const double s = std::numbers::pi * i / 16;
        with_H0 += fmt::format("{} {} {}\n", i % 16 == 0 ? 0 : std::sin(s), -std::cos(s), -1 + 0.1 * std::cos(s));
    }
    return {"r, z\n" + cell, "# a ring\n" + ring, with_H0};
}

// Jets of a formula agree with it, and what looks for its limits does not end otherwise than by an answer.
void formula_text(Input input) {
    constexpr std::string_view names[] = {"H", "K", "H0"};
    Formula formula;
    try {
        formula = parse_formula(text_of(input), names);
    } catch (const FormulaError& error) {
        if (error.column < 1 || error.column > input.size() + 1) throw std::logic_error("no such character");
        return;
    }
    FormulaDomain domain(formula);
    for (const double H : {-1.3, 0.0, 0.7}) {
        const double at[] = {H, 0.4, -1};
        domain.look(at, H);
        const double value = evaluate(formula, at), again = evaluate(formula, at);
        if (std::isfinite(value) && value != again) throw std::logic_error("two values at one place");
        using J = Jet<double, 2, 2>;
        const J jets[] = {J::variable(H, 0), J::variable(0.4, 1), J(-1.0)};
        if (const double v = evaluate(formula, jets).v;
            std::isfinite(value) && !(std::abs(v - value) <= 1e-9 * std::abs(value)))
            throw std::logic_error(fmt::format("{} as a number, {} as a jet", value, v));
    }
    if (domain.margin().step != nullptr) words(domain.margin());
}

std::vector<std::string> formula_seeds() {
    return {"0.1*log(1 + (H - H0)^2)", "exp(-K)/sqrt(1+H^2)", "-tanh(H)^3 + sinh(pi*K)*cosh(H)",
            "atan(sin(H)+cos(K))^-2", "H^0.5"};
}

}  // namespace

const std::vector<Target>& targets() {
    static const std::vector<Target> all{
        {"case", case_text, case_seeds},          {"override", override_text, override_seeds},
        {"scan", scan_text, scan_seeds},          {"mesh", mesh_file, mesh_seeds},
        {"profile", profile_text, profile_seeds}, {"formula", formula_text, formula_seeds},
        {"result", result_parts, result_seeds}};
    return all;
}

}  // namespace tubule::fuzz
