// Case files: every refusal with its place and its words, the accepted forms, overrides, writing back; and the
// tube that a case describes. Lines and columns are counted by hand in the text below.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <complex>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <numbers>

#include "common/case/complaints.hpp"
#include "common/case/read.hpp"
#include "common/case/text.hpp"
#include "tests/support/message_of.hpp"
#include "tests/support/paths.hpp"

namespace tubule {
namespace {

const std::string good =
    "tier = \"axisym\"\n"                   // 1
    "[about]\n"                             // 2
    "title = \"test\"\n"                    // 3
    "[energy]\n"                            // 4
    "k20 = 1.0\n"                           // 5
    "k42 = 0.06\n"                          // 6
    "[model]\n"                             // 7
    "kind = \"gradient-flow\"\n"            // 8
    "[shape]\n"                             // 9
    "kind = \"tube\"\n"                     // 10
    "radius = 1.0\n"                        // 11
    "length = 2.0\n"                        // 12
    "[[shape.mode]]\n"                      // 13
    "amplitude = 0.3\n"                     // 14
    "n = 1\n"                               // 15
    "[accuracy]\n"                          // 16
    "energy = 1e-6\n"                       // 17
    "[discretisation]\n"                    // 18
    "order = 5\n"                           // 19
    "[time]\n"                              // 20
    "end = 1.4\n"                           // 21
    "output = [0.1, 0.2]\n"                 // 22
    "[expect]\n"                            // 23
    "energy = {value = 1.0, rel = 1e-6}\n"  // 24
    "[[expect.at]]\n"                       // 25
    "time = 0.1\n"                          // 26
    "r_min = {value = 0.7, abs = 1e-3}\n";  // 27

// The good case with one piece of text replaced.
std::string with(const std::string& old_text, const std::string& new_text) {
    std::string text = good;
    const std::size_t at = text.find(old_text);
    EXPECT_NE(at, std::string::npos) << "no '" << old_text << "' in the good case";
    return text.replace(at, old_text.size(), new_text);
}

// As messages list them: those of the alternatives of Shape.
template <class... Shapes>
std::string kinds_of(const std::variant<Shapes...>&) {
    std::string list;
    for (const char* kind : {Shapes::kind...}) list += (list.empty() ? "one of \"" : ", \"") + std::string(kind) + "\"";
    return list;
}
std::string shape_kinds() {
    return kinds_of(Shape{});
}

std::string refusal(const std::string& text, const std::vector<std::string>& sets = {}) {
    return test::message_of<CaseError>([&] { parse_case(text, sets, "case.toml"); });
}

// A piece of the good case, what to write instead, and what that must be answered.
struct Edit {
    std::string old_text, new_text, message;
};
void expect_refused(const std::vector<Edit>& edits) {
    for (const Edit& edit : edits)
        EXPECT_EQ(refusal(with(edit.old_text, edit.new_text)), "case.toml:" + edit.message) << edit.new_text;
}

// An override of the good case and the words that must follow it.
struct Override {
    std::string set, message;
};
void expect_refused(const std::vector<Override>& overrides) {
    for (const auto& [set, message] : overrides)
        EXPECT_EQ(refusal(good, {set}), "--set " + printable(set) + ": " + message);
}

TEST(CaseRefusal, ContentsOfAnotherKind) {
    const std::string text = ": a case is TOML, plain text saved as UTF-8";
    EXPECT_EQ(refusal("PK\x03\x04..."), "case.toml:1:1: is a zip archive, such as a spreadsheet" + text);
    EXPECT_EQ(refusal({'t', '\0', 'i', '\0'}), "case.toml:1:1: is text in UTF-16" + text);
    EXPECT_EQ(refusal("// a cube\nvertices\n1 0 0 0\nedges\n1 1 2\n").substr(0, 43),
              "case.toml:1:1: is a file of Surface Evolver");
    EXPECT_EQ(refusal("tier = \"a\x1b[31m\xff\"\n").find_first_of("\x1b\xff"), std::string::npos);
}

TEST(CaseRefusal, KeysThatStandElsewhere) {
    std::string late = good.substr(good.find('\n') + 1) + "tier = \"axisym\"\n";
    EXPECT_EQ(refusal(late.replace(late.find("[expect]"), 0, "tier = \"axisym\"\n").substr(0, late.size() - 16)),
              "case.toml:22:1: tier stands within [time]; it belongs before the first table");
    expect_refused({Override{"shape.mode.1.amplitude=0.3",
                             "missing key shape.mode.1.n: an integer >= 0 and <= 10000; "
                             "entries count from 0, so shape.mode.1 is a new one"},
                    Override{"energy.k42=0,1",
                             "energy.k42 must be a finite number, not the string \"0,1\"; decimals "
                             "have a point: 0.1"}});
    EXPECT_EQ(refusal(with("[shape]", "[velocity]\ninitial = \"rotation\"\nomega = 1.0\n[shape]")),
              "case.toml:10:11: velocity.initial must be absent: only model.kind = \"fluid\" or \"auto\" has a "
              "velocity at the start");
}

TEST(CaseRefusal, TextThatIsNoToml) {
    const std::string separate = "not valid TOML: a key and its value are joined by a single =, ";
    expect_refused({
        Edit{"k20 = 1.0", "k20 = 1\x01",
             "5:8: not valid TOML: Error while parsing decimal integer: expected digit, saw "
             "'\\u0001'"},
        Edit{"k20 = 1.0", "k20 = 1,0", "5:7: not valid TOML: decimals have a point, not a comma: 1.0"},
        Edit{"k20 = 1.0", "k20 = .5", "5:7: not valid TOML: a number begins with a digit: 0.5"},
        Edit{"k20 = 1.0", "k20 = -3.", "5:9: not valid TOML: digits follow the point of a number: -3.0"},
        Edit{"k20 = 1.0", "k20 = 1/3",
             "5:8: not valid TOML: a value is one number, nothing is computed; a formula, where one is allowed, stands "
             "in quotes"},
        Edit{"k20 = 1.0", "k20 = 2 pi", "5:9: not valid TOML: numbers are written as digits: pi is 3.141592653589793"},
        Edit{"k20 = 1.0", "k20 = 20 kT", "5:10: not valid TOML: a number has no unit: all are dimensionless"},
        Edit{"k20 = 1.0", "k20 = 1e-3.5",
             "5:11: not valid TOML: the exponent of a number is a whole number, as in 1e-3"},
        Edit{"k20 = 1.0", "k20 = \u22121", "5:7: not valid TOML: a minus is the sign - of a keyboard"},
        Edit{"k20 = 1.0", "k20: 1.0", "5:4: " + separate + "k20 = ..."},
        Edit{"k20 = 1.0", "k20 == 1.0", "5:5: " + separate + "k20 = ..."},
        Edit{"k20 = 1.0", "k20 1.0", "5:5: not valid TOML: between k20 and its value = is missing"},
        Edit{"k20 = 1.0", "k20 =", "5:1: not valid TOML: k20 has no value: k20 = and a value is needed"},
        Edit{"k20 = 1.0", "k20 = 1.0, H0 = -1", "5:10: not valid TOML: each key stands in a line of its own"},
        Edit{"k20 = 1.0", "k20 = 1.0;", "5:10: not valid TOML: a line ends without ;"},
        Edit{"k20 = 1.0", "k20 = 1.0 // kappa/2", "5:11: not valid TOML: a comment begins with #"},
        Edit{"[energy]", "[energy", "4:1: not valid TOML: the name of a table ends with ], such as [shape]"},
        Edit{"[expect]", "[energy]",
             "23:1: not valid TOML: energy is given twice, first in line 4: keep one of the two"},
        Edit{"[energy]", "energy]", "4:7: not valid TOML: the name of a table begins with [, such as [energy]"},
        Edit{"[[shape.mode]]", "[[shape.mode]",
             "13:3: not valid TOML: the name of a list of tables has two brackets on both sides: [[shape.mode]]"},
        Edit{"[energy]\n", "[energy] ", "4:10: not valid TOML: what follows the name of a table stands in a new line"},
        Edit{"\"tube\"", "tube", "10:8: not valid TOML: text stands in quotes: \"tube\""},
        Edit{"\"tube\"", "\u201ctube\u201d", "10:8: not valid TOML: quotes are straight: \"text\""},
        Edit{"\"tube\"", "\"tube", "10:8: not valid TOML: this quote is not closed"},
        Edit{"\"test\"", "\"C:\\data\"",
             "3:12: not valid TOML: \\ begins an escape within \"...\": write \\\\, or '...', which takes text as it "
             "is"},
        Edit{"title = \"test\"", "title = \"C:\\users\"",
             "3:12: not valid TOML: \\ begins an escape within \"...\": write \\\\, or '...', which takes text as it "
             "is"},
        Edit{"[0.1, 0.2]", "[0.1 0.2]", "22:14: not valid TOML: numbers of a list are separated by commas: [1, 2]"},
        Edit{"[0.1, 0.2]", "(0.1, 0.2)", "22:11: not valid TOML: a list stands in square brackets: [0.1, 0.2]"},
        Edit{"[0.1, 0.2]", "0:1:10", "22:10: not valid TOML: a range stands in quotes: \"0:1:10\""},
        Edit{"k20 = 1.0", "k20 = $K",
             "5:7: not valid TOML: a value is a number, text in quotes, true, false, a list [1, 2] or a table"},
        Edit{"[0.1, 0.2]", "[0.1, 0.2", "22:10: not valid TOML: this [ is not closed by ]"},
        Edit{"order = 5", "symmetry = False",
             "19:12: not valid TOML: write false in small letters, without quotes: false"},
        Edit{"1.0, rel", "1.0,\n rel",
             "24:10: not valid TOML: a table in braces stands on one line; or give it a name in "
             "brackets, [name], and each key a line of its own"},
        Edit{"length = 2.0", "radius = 2.0",
             "12:1: not valid TOML: radius is given twice, first in line 11: keep one of the two"},
        Edit{"[time]", "[accuracy]",
             "20:1: not valid TOML: accuracy is given twice, first in line 16: keep one of the two"},
        Edit{"tier", "{\"tier\"",
             "1:1: not valid TOML: a case is written in TOML, not in JSON: a line [energy], then a line "
             "k20 = 0.5"},
    });
}

TEST(CaseRefusal, NamesOfOtherPrograms) {
    const std::string energy = " Allowed here: k20, k40, k42, H0, term",
                      time = " Allowed here: end, output, stationary, limit, integrator, max_order";
    expect_refused({
        Edit{"k42", "kappa",
             "6:1: unknown key energy.kappa: write k20 = kappa/2: the energy is INT k20 (H - H0)^2 dS, H the "
             "sum of the principal curvatures." +
                 energy},
        Edit{"k42", "energy.k42",
             "6:1: unknown key energy.energy: under [energy], keys have no energy. before them." + energy},
        Edit{"k42", "C0",
             "6:1: unknown key energy.C0: write H0 = -c0: spheres and tubes have H < 0, -2/R and -1/R, where "
             "papers have c0 > 0." +
                 energy},
        Edit{"output", "dt",
             "22:1: unknown key time.dt: the step follows from accuracy.energy; output has the times of "
             "frames." +
                 time},
        // The required key is not said to be missing as well.
        Edit{"end", "t_max", "21:1: unknown key time.t_max: write end." + time},
    });
}

TEST(CaseRefusal, UnknownKeysAndTables) {
    const std::string tables =
        "tier, about, energy, auto, model, equilibrium, velocity, shape, accuracy, discretisation, time, expect";
    expect_refused({
        Edit{"tier =", "teir =", "1:1: unknown key teir; did you mean 'tier'? Allowed here: " + tables},
        Edit{"[discretisation]", "[speed]", "18:2: unknown key speed. Allowed here: " + tables},
        Edit{"[[shape.mode]]", "[time.mode]",
             "13:7: unknown key time.mode. Allowed here: end, output, stationary, limit, integrator, max_order"},
        Edit{"title", "tilte", "3:1: unknown key about.tilte; did you mean 'title'? Allowed here: title, source"},
        Edit{"k42", "k24", "6:1: unknown key energy.k24; did you mean 'k42'? Allowed here: k20, k40, k42, H0, term"},
        Edit{"k42", "h0", "6:1: unknown key energy.h0; did you mean 'H0'? Allowed here: k20, k40, k42, H0, term"},
        Edit{"kind = \"gr", "Re = 1\nkind = \"gr",
             "8:6: model.Re must be absent: only valid with kind = \"stokes\" or \"fluid\" or \"auto\""},
        // Reported as misspelt, not as the missing radius:
        Edit{"radius", "  raduis",
             "11:3: unknown key shape.raduis; did you mean 'radius'? Allowed here: kind, radius, "
             "length, mode, noise"},
        Edit{"kind = \"tube\"", "knd = \"tube\"",
             "10:1: unknown key shape.knd; did you mean 'kind'? Allowed here: kind, radius, length, mode, noise"},
        Edit{"n = 1", "l = 1",
             "15:1: unknown key shape.mode.0.l; did you mean 'n'? Allowed here: amplitude, n, m, phase"},
        Edit{"energy = 1e-6", "rmin = 1e-6",
             "17:1: unknown key accuracy.rmin; did you mean 'r_min'? Allowed here: "
             "energy, relative_to, estimate, r_min"},
        Edit{"order = 5", "scheme = \"bdf2\"",
             "19:1: unknown key discretisation.scheme: only tier \"surface3d\" has it. Allowed here: elements, order, "
             "smoothness, time_tolerance, symmetry, parametrisation"},
        Edit{"order", "oder",
             "19:1: unknown key discretisation.oder; did you mean 'order'? Allowed here: elements, "
             "order, smoothness, time_tolerance, symmetry, parametrisation"},
        Edit{"end =", "ende =",
             "21:1: unknown key time.ende; did you mean 'end'? Allowed here: end, output, "
             "stationary, limit, integrator, max_order"},
    });
}

TEST(CaseRefusal, UnknownSeries) {
    const std::string series =
        "energy, energy_20, energy_40, energy_42, energy_formula, free_energy, work, dissipation, identity_defect, "
        "area, volume, "
        "volume_drift, "
        "reduced_volume, r_min, "
        "r_max, mode_<n>, kinetic_energy, speed, momentum_x, momentum_y, momentum_z, angular_momentum_x, "
        "angular_momentum_y, angular_momentum_z, lambda, tension, pressure, force, stretching, correction_energy, "
        "integral_H2, integral_K, "
        "gauss_bonnet_defect, quality, turn, parameter, special, negative_directions, growth_<m>, "
        "meridian_length, height, r_middle, pole_curvature, distance_to_start, energy_error, elements, tier";
    const std::string at_end = " Allowed here: stop, time, " + series + ", stop_time, at";
    expect_refused({
        Edit{"energy = {", "enrgy = {", "24:1: unknown key expect.enrgy; did you mean 'energy'?" + at_end},
        Edit{"energy = {", "mode_01 = {", "24:1: unknown key expect.mode_01." + at_end},
        Edit{"energy = {", "mode_-1 = {", "24:1: unknown key expect.mode_-1." + at_end},
        Edit{"energy = {", "mode_ = {", "24:1: unknown key expect.mode_." + at_end},
        Edit{"r_min", "rmin",
             "27:1: unknown key expect.at.0.rmin; did you mean 'r_min'? Allowed here: time, " + series},
        Edit{"rel", "tol", "24:24: unknown key expect.energy.tol. Allowed here: value, rel, abs"},
    });
}

TEST(CaseRefusal, MissingKeys) {
    expect_refused({
        Edit{"tier = \"axisym\"", "", "1:1: missing key tier: one of \"axisym\", \"surface3d\", \"auto\""},
        Edit{"kind = \"tube\"", "",
             "9:1: missing key shape.kind: one of \"tube\", \"sphere\", \"ellipsoid\", \"torus\", "
             "\"capsule\", \"dumbbell\", \"formula\", \"profile\", \"file\", \"result\""},
        Edit{"radius = 1.0", "", "9:1: missing key shape.radius: a number > 0"},
        Edit{"length = 2.0", "", "9:1: missing key shape.length: a number > 0"},
        Edit{"amplitude = 0.3", "", "13:1: missing key shape.mode.0.amplitude: a finite number"},
        Edit{"n = 1\n", "\n", "13:1: missing key shape.mode.0.n: an integer >= 0 and <= 10000"},
        Edit{"end = 1.4", "", "20:1: missing key time.end: a number > 0"},
        Edit{"[time]\nend = 1.4\noutput = [0.1, 0.2]", "", "1:1: missing key time.end: a number > 0"},
        Edit{"value = 1.0, ", "", "24:10: missing key expect.energy.value: a finite number"},
        Edit{"time = 0.1\n", "", "25:1: missing key expect.at.0.time: a number >= 0 and <= 1.4 (time.end)"},
    });
    EXPECT_EQ(refusal(""), "case.toml:1:1: missing key tier: one of \"axisym\", \"surface3d\", \"auto\"");
}

TEST(CaseRefusal, WrongTypes) {
    expect_refused({
        Edit{"\"axisym\"", "1", "1:8: tier must be one of \"axisym\", \"surface3d\", \"auto\", not 1"},
        Edit{"\"test\"", "2024-01-01", "3:9: about.title must be a string, not a date or time"},
        Edit{"title = \"test\"", "source = true", "3:10: about.source must be a string, not true"},
        Edit{"0.06", "\"0.06\"", "6:7: energy.k42 must be a finite number, not the string \"0.06\""},
        Edit{"k42 = 0.06", "H0 = [1]", "6:6: energy.H0 must be a number, or a formula of area, r, z, not a list"},
        Edit{"[about]\ntitle = \"test\"", "about = 0.5", "2:9: about must be a table, not 0.5"},
        Edit{"[[shape.mode]]", "[shape.mode]",
             "13:1: shape.mode must be a list of tables, [[shape.mode]], not a table"},
        Edit{"[[shape.mode]]\namplitude = 0.3\nn = 1", "mode = [3]", "13:9: shape.mode.0 must be a table, not 3"},
        Edit{"n = 1", "n = 1.0", "15:5: shape.mode.0.n must be an integer >= 0 and <= 10000, not 1.0"},
        Edit{"n = 1", "n = 1\nphase = {}", "16:9: shape.mode.0.phase must be a finite number, not a table"},
        Edit{"order = 5", "elements = 64.5",
             "19:12: discretisation.elements must be an integer >= 4 and <= 100000, not "
             "64.5"},
        Edit{"order = 5", "symmetry = 1", "19:12: discretisation.symmetry must be true or false, not 1"},
        Edit{"[0.1, 0.2]", "0.1", "22:10: time.output must be a list of increasing numbers, not 0.1"},
        Edit{"[0.1, 0.2]", "[0.1, \"b\"]",
             "22:16: time.output.1 must be a number >= 0 and <= 1.4 (time.end), not the "
             "string \"b\""},
        Edit{"{value = 1.0, rel = 1e-6}", "1.0",
             "24:10: expect.energy must be a table, such as {value = 1.5, rel = 1e-3}, not 1.0"},
        Edit{"[[expect.at]]", "[expect.at]", "25:1: expect.at must be a list of tables, [[expect.at]], not a table"},
    });
}

TEST(CaseRefusal, UnknownChoices) {
    std::string stops;
    for (const StopKind& kind : stop_kinds)
        stops += (stops.empty() ? "one of \"" : ", \"") + std::string(kind.name) + "\"";
    expect_refused({
        Edit{"\"axisym\"", "\"Axisim\"",
             "1:8: tier must be one of \"axisym\", \"surface3d\", \"auto\", not \"Axisim\"; did you mean 'axisym'?"},
        Edit{"\"gradient-flow\"", "\"water\"",
             "8:8: model.kind must be one of \"gradient-flow\", \"overdamped\", \"stokes\", \"fluid\", \"auto\", not "
             "\"water\""},
        Edit{"\"gradient-flow\"", "\"gradient-flow\"\nvolume = \"kept\"",
             "9:10: model.volume must be one of \"free\", \"fixed\", not \"kept\""},
        Edit{"\"tube\"", "\"cube\"",
             "10:8: shape.kind must be " + shape_kinds() + ", not \"cube\"; did you mean 'tube'?"},
        Edit{"[expect]", "[expect]\nstop = \"pinchoff\"",
             "24:8: expect.stop must be " + stops + ", not \"pinchoff\"; did you mean 'pinch-off'?"},
    });
}

TEST(CaseRefusal, NumbersOutOfRange) {
    expect_refused({
        Edit{"k20 = 1.0", "k20 = inf", "5:7: energy.k20 must be a finite number, not inf"},
        Edit{"k20 = 1.0", "H0 = nan", "5:6: energy.H0 must be a finite number, not nan"},
        Edit{"radius = 1.0", "radius = 0", "11:10: shape.radius must be a number > 0, not 0"},
        Edit{"radius = 1.0", "radius = inf", "11:10: shape.radius must be a number > 0, not inf"},
        Edit{"length = 2.0", "length = -2", "12:10: shape.length must be a number > 0, not -2"},
        Edit{"0.3", "-inf", "14:13: shape.mode.0.amplitude must be a finite number, not -inf"},
        Edit{"n = 1\n", "n = -1\n", "15:5: shape.mode.0.n must be an integer >= 0 and <= 10000, not -1"},
        Edit{"n = 1\n", "n = 10001\n", "15:5: shape.mode.0.n must be an integer >= 0 and <= 10000, not 10001"},
        Edit{"n = 1\n", "n = 1\nm = 10001\n",
             "16:5: shape.mode.0.m must be an integer >= -10000 and <= 10000, not 10001"},
        Edit{"n = 1\n", "n = 1\nm = -10001\n",
             "16:5: shape.mode.0.m must be an integer >= -10000 and <= 10000, not -10001"},
        Edit{"energy = 1e-6", "energy = 1e-12",
             "17:10: accuracy.energy must be a number > 1e-12 and <= 0.1, not 1e-12"},
        Edit{"energy = 1e-6", "energy = 0.11", "17:10: accuracy.energy must be a number > 1e-12 and <= 0.1, not 0.11"},
        Edit{"energy = 1e-6", "r_min = 0.0", "17:9: accuracy.r_min must be a number > 0, not 0.0"},
        Edit{"order = 5", "order = 4", "19:9: discretisation.order must be one of 3, 5, 7, not 4"},
        Edit{"order = 5", "order = 9", "19:9: discretisation.order must be one of 3, 5, 7, not 9"},
        Edit{"order = 5", "order = 5\nsmoothness = 5",
             "20:14: discretisation.smoothness must be an integer >= 1 and <= 4 (order - 1), not 5"},
        Edit{"order = 5", "smoothness = 0",
             "19:14: discretisation.smoothness must be an integer >= 1 and <= 4 (order - 1), not 0"},
        Edit{"order = 5", "elements = 3",
             "19:12: discretisation.elements must be an integer >= 4 and <= 100000, not 3"},
        Edit{"order = 5", "elements = 100001",
             "19:12: discretisation.elements must be an integer >= 4 and <= 100000, not 100001"},
        Edit{"order = 5", "elements = 9000000000000000000",
             "19:12: discretisation.elements must be an integer >= 4 and <= 100000, not 9000000000000000000"},
        Edit{"order = 5", "time_tolerance = 1e-14",
             "19:18: discretisation.time_tolerance must be a number > 1e-14 and <= 0.1, not 1e-14"},
        Edit{"order = 5", "time_tolerance = 0.2",
             "19:18: discretisation.time_tolerance must be a number > 1e-14 and <= 0.1, not 0.2"},
        Edit{"order = 5", "time_order = 0", "19:14: time.max_order must be an integer >= 1 and <= 5, not 0"},
        Edit{"order = 5", "time_order = 6", "19:14: time.max_order must be an integer >= 1 and <= 5, not 6"},
        Edit{"[0.1, 0.2]", "[]\nmax_order = 2\nintegrator = \"rosenbrock\"",
             "23:13: time.max_order must be absent: only valid with integrator = \"ida\""},
        Edit{"[0.1, 0.2]", "[]\nintegrator = \"rodas\"",
             "23:14: time.integrator must be one of \"ida\", \"rosenbrock\", not \"rodas\""},
        Edit{"end = 1.4", "end = 0", "21:7: time.end must be a number > 0, not 0"},
        Edit{"[0.1, 0.2]", "[-0.1]", "22:11: time.output.0 must be a number >= 0 and <= 1.4 (time.end), not -0.1"},
        Edit{"[0.1, 0.2]", "[1.5]", "22:11: time.output.0 must be a number >= 0 and <= 1.4 (time.end), not 1.5"},
        Edit{"[0.1, 0.2]", "[]\nlimit = 0", "23:9: time.limit must be a number > 0, not 0"},
        Edit{"[0.1, 0.2]", "[]\nstationary = 0.0", "23:14: time.stationary must be a number > 0, not 0.0"},
        Edit{"rel = 1e-6", "rel = 0", "24:30: expect.energy.rel must be a number > 0, not 0"},
        Edit{"rel = 1e-6", "abs = -1", "24:30: expect.energy.abs must be a number > 0, not -1"},
        Edit{"value = 1.0", "value = nan", "24:19: expect.energy.value must be a finite number, not nan"},
        Edit{"energy = {value = 1.0", "stop_time = {value = 1.5",
             "24:22: expect.stop_time.value must be a number >= 0 and <= 1.4 (time.end), not 1.5"},
        Edit{"energy = {value = 1.0", "time = {value = 1.5",
             "24:17: expect.time.value must be a number >= 0 and <= 1.4 (time.end), not 1.5"},
        Edit{"time = 0.1\n", "time = 1.5\n",
             "26:8: expect.at.0.time must be a number >= 0 and <= 1.4 (time.end), not 1.5"},
    });
}

TEST(CaseRefusal, OutputTimesOutOfOrder) {
    const std::string rule = "time.output is a list of increasing numbers";
    expect_refused({
        Edit{"[0.1, 0.2]", "[0.2, 0.1]",
             "22:16: time.output.1 must be larger than the 0.2 before it, not 0.1: " + rule},
        Edit{"[0.1, 0.2]", "[0.2, 0.2]",
             "22:16: time.output.1 must be larger than the 0.2 before it, not 0.2: " + rule},
    });
}

TEST(CaseRefusal, ValuesThatDoNotGoTogether) {
    const std::string no_energy =
        "energy needs a modulus other than zero: k20, k40, k42, or that of a term [[energy.term]]";
    expect_refused({
        Edit{"order = 5\n[time]\n", "parametrisation = \"even\"\n[time]\nintegrator = \"rosenbrock\"\n",
             "21:14: time.integrator must not be \"rosenbrock\": it integrates graphs r(z) alone, the gradient flow of "
             "a "
             "tube with free volume and area under constant loads; omit it"},
        Edit{"k20 = 1.0\nk42 = 0.06", "H0 = 1", "4:1: " + no_energy},
        Edit{"[energy]\nk20 = 1.0\nk42 = 0.06", "", "1:1: " + no_energy},
        // 1 + 1.25 cos(pi z) is smallest at z = 1
        Edit{"0.3", "1.25", "9:1: shape must have r0(z) > 0 everywhere, but r0 = -0.25 at z = 1"},
        // touches the axis: r0 = 0 is refused, too
        Edit{"0.3", "1.0", "9:1: shape must have r0(z) > 0 everywhere, but r0 = 0 at z = 1"},
        // negative only for |z - 0.984085| < 1.4e-4, far between samples; z = 1 - 0.05/pi
        Edit{"0.3", "1.0000001\nphase = 0.05",
             "9:1: shape must have r0(z) > 0 everywhere, but r0 = -1e-07 at z = 0.984085"},
        // a mode of n = 0 shifts the radius
        Edit{"0.3\nn = 1", "-1\nn = 0", "9:1: shape must have r0(z) > 0 everywhere, but r0 = 0 at z = 0"},
        Edit{"n = 1\n", "n = 1\nm = 2\n",
             "16:5: shape.mode.0.m must be 0, not 2: tier \"axisym\" is axisymmetric and has no waves around the axis"},
        Edit{"energy = 1e-6", "r_min = 0.7",
             "17:9: accuracy.r_min must be below the smallest radius of the start (0.7 at z = 1), not 0.7"},
        // the default of r_min, too
        Edit{"radius = 1.0", "radius = 0.3005",
             "16:1: accuracy.r_min must be below the smallest radius of the start (0.0005 at z = 1), not 0.001"},
        Edit{"energy = 1e-6", "relative_to = \"size\"",
             "17:15: accuracy.relative_to must be one of \"magnitude\", \"energy\", not \"size\""},
        Edit{", rel = 1e-6", "", "24:10: expect.energy needs a tolerance: rel, abs or both"},
        Edit{"value = 1.0", "value = 0",
             "24:10: expect.energy needs abs: a relative tolerance is meaningless for the value 0"},
        Edit{"r_min = {value = 0.7, abs = 1e-3}", "",
             "25:1: expect.at.0 is empty: add a series and its expected value"},
    });
}

// What a case gives must be free, and what it asks for must be a motion with a state of rest.
TEST(CaseRefusal, LoadsOnWhatIsFixed) {
    const std::string flow = "kind = \"gradient-flow\"";
    const auto model = [&](const std::string& keys, const std::string& message) { return Edit{flow, keys, message}; };
    expect_refused({
        model(flow + "\narea = \"fixed\"\ntension = 0.1",
              "10:11: model.tension must be absent: only valid with area = \"free\"; what a fixed area needs is the "
              "series tension"),
        model("kind = \"stokes\"\ntension = 0.1",
              "9:11: model.tension must be absent: only valid with area = \"reservoir\"; what a fixed area needs is "
              "the series tension"),
        model(flow + "\nvolume = \"fixed\"\npressure = 0",
              "10:12: model.pressure must be absent: only valid with volume = \"free\"; what a fixed volume needs is "
              "the series pressure"),
        model("kind = \"fluid\"\npressure = 0",
              "9:12: model.pressure must be absent: only valid with volume = \"free\"; what a fixed volume needs is "
              "the series pressure"),
        model(flow + "\nvolume = \"fixed\"\nforce = 1",
              "10:9: model.force must be absent: only valid with period = \"free\"; what a fixed period needs is the "
              "series force"),
        model(flow + "\narea = \"reservoir\"", "9:8: model.area must be one of \"fixed\", \"free\", not \"reservoir\""),
        model("kind = \"fluid\"\narea = \"free\"",
              "9:8: model.area must be one of \"fixed\", \"reservoir\", not \"free\""),
        model(flow + "\nperiod = \"free\"",
              "9:10: model.period must not be \"free\" with free volume and area: E + tension A - pressure V - force "
              "L of a straight tube is linear in L and has no rest state; fix area or volume"),
        model("kind = \"overdamped\"\nvolume = \"free\"\narea = \"reservoir\"\nperiod = \"free\"",
              "11:10: model.period must not be \"free\" with free volume and area: E + tension A - pressure V - force "
              "L of a straight tube is linear in L and has no rest state; fix area or volume"),
    });
    const std::string sphere =
        "tier = \"axisym\"\nenergy.k20 = 1\ntime.end = 1\nshape = {kind = \"sphere\", radius = 1}\n"
        "[model]\nvolume = \"fixed\"\nperiod = \"free\"\n";
    EXPECT_EQ(refusal(sphere), "case.toml:7:10: model.period must not be \"free\": only a tube has a period");
}

TEST(CaseRefusal, RampsThatAreNone) {
    const std::string flow = "kind = \"gradient-flow\"", numbers = "a number, or {time = [...], value = [...]}";
    const auto tension = [&](const std::string& value, const std::string& message) {
        return Edit{flow, flow + "\ntension = " + value, message};
    };
    expect_refused({
        tension("\"high\"", "9:11: model.tension must be " + numbers + ", not the string \"high\""),
        tension("[0, 1]", "9:11: model.tension must be " + numbers + ", not a list"),
        tension("inf", "9:11: model.tension must be a finite number, not inf"),
        tension("{time = [0, 1]}", "9:11: missing key model.tension.value: a list of numbers"),
        tension("{value = [0, 1]}", "9:11: missing key model.tension.time: a list of increasing numbers"),
        tension("{time = [0, 2, 1], value = [0, 0.5, 1]}",
                "9:26: model.tension.time.2 must be larger than the 2 before it, not 1: model.tension.time is a list "
                "of increasing numbers"),
        tension("{time = [0, 1, 1], value = [0, 0.5, 1]}",
                "9:26: model.tension.time.2 must be larger than the 1 before it, not 1: model.tension.time is a list "
                "of increasing numbers"),
        tension("{time = [-1, 1], value = [0, 1]}", "9:20: model.tension.time.0 must be a number >= 0, not -1"),
        tension("{time = [0, 1], value = [0, 1, 2]}",
                "9:35: model.tension.value must be as many numbers as there are times"),
        tension("{time = [0.1, 0.10000000001], value = [0, 1]}",
                "9:19: model.tension.time must increase by a millionth at least: a jump needs a duration that steps "
                "resolve"),
        tension("{time = [], value = []}", "9:31: model.tension.value needs at least one time"),
        tension("{time = [0, 1], value = [0, \"a\"]}",
                "9:39: model.tension.value.1 must be a finite number, not the string \"a\""),
        tension("{time = [0], values = [0]}",
                "9:24: unknown key model.tension.values; did you mean 'value'? Allowed here: time, value"),
    });
}

TEST(CaseRefusal, Files) {
    const auto message = [](const std::filesystem::path& path) -> std::string {
        try {
            read_case(path);
        } catch (const CaseError& error) {
            return error.what();
        }
        return "accepted";
    };
    const std::filesystem::path folder = testing::TempDir();
    EXPECT_EQ(message(folder), folder.string() + ": is a directory: give a file in it");
    EXPECT_EQ(message("/dev/zero"), "/dev/zero: is a pipe or a device, not a file: save its contents to a file first");
    const std::filesystem::path pipe = folder / "pipe.toml", huge = folder / "huge.toml";
    ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
    EXPECT_EQ(message(pipe), pipe.string() + ": is a pipe or a device, not a file: save its contents to a file first");
    std::ofstream(huge) << "# ";
    std::filesystem::resize_file(huge, 1ull << 40);  // takes no room on the disk
    EXPECT_EQ(message(huge), huge.string() + ": is larger than 1 MB, the most that is read");
    for (const auto& made : {pipe, huge}) std::filesystem::remove(made);
    const std::filesystem::path absent = folder / "no_such_case.toml";
    EXPECT_EQ(message(absent), absent.string() + ": cannot be opened: No such file or directory");
}

// toml++ overflows the stack with a key of some ten thousand parts.
TEST(CaseRefusal, KeysOfManyParts) {
    const auto message = [](const std::string& text, const std::vector<std::string>& sets = {}) -> std::string {
        try {
            parse_case(text, sets, "x.toml");
        } catch (const CaseError& error) {
            return error.what();
        }
        return "accepted";
    };
    const auto key = [](int parts, const std::string& part) {
        std::string text = part;
        for (int i = 1; i < parts; ++i) text += "." + part;
        return text;
    };
    const std::string refused = ": a key has more than 32 parts";
    for (const std::string part : {"a", "\"a.b\"", "'a'", "a \t", R"("\"")"}) {
        const std::string many = key(100000, part);
        for (const std::string before : {"", "[", "[[", "x = {y = 1, ", "x = [{", "x = {y = \"\"\"a\"\"\"\", ",
                                         "x = '''\n'\n'''\n", "x = \"\"\"\\\"\"\"\"\"\n", "# '\n"})
            EXPECT_TRUE(message(before + many + " = 1").ends_with(refused)) << before << part;
        EXPECT_TRUE(message(key(32, part) + " = 1").starts_with("x.toml:1:1: unknown key ")) << part;
    }
    EXPECT_EQ(message("a = 1\n  " + key(33, "b") + " = 2"), "x.toml:2:66" + refused);
    EXPECT_TRUE(message("", {key(1000, "a") + "=1"}).ends_with("=1: the key has 1000 parts; at most 32 are read"));
    EXPECT_TRUE(message("", {"x={" + key(1000, "a") + "=1}"}).ends_with(refused));
    // Dots of comments, strings and numbers are none of a key.
    const std::string dots(1000, '.');
    EXPECT_TRUE(message("# " + dots + "\nx = [\"" + dots + "\", '''\n" + dots + "''', 0.1, 0.1]")
                    .starts_with("x.toml:2:1: unknown key x"));
}

TEST(CaseRefusal, Overrides) {
    const std::string form = "must have the form key=value, such as --set energy.k42=0.06";
    expect_refused({
        Override{"energy.k42", form},
        Override{"=3", form},
        Override{"energy..k42=3", form},
        Override{"time.output=[0.1",
                 "not valid TOML: this [ is not closed by ]; a value with blanks stands in quotes: "
                 "--set 'time.output=[1, 2]'"},
        Override{"about.title=\xff", "not valid TOML: Encountered invalid utf-8 sequence"},
        Override{"time.end.x=1", "time.end is neither a table nor a list, so it has no 'x'"},
        Override{"shape.mode.2.n=1", "shape.mode is a list of 1: '2' must be an index from 0 to 1 (1 adds an entry)"},
        Override{"shape.mode.n=1", "shape.mode is a list of 1: 'n' must be an index from 0 to 1 (1 adds an entry)"},
        Override{"shape.mode.-1.n=1", "shape.mode is a list of 1: '-1' must be an index from 0 to 1 (1 adds an entry)"},
        // all checks of files apply, and name the override
        Override{"energy.k42=abc", "energy.k42 must be a finite number, not the string \"abc\""},
        Override{"energy.k42=", "energy.k42 must be a finite number, not the string \"\""},
        Override{"energy.k42=1\nk20 = 2", "energy.k42 must be a finite number, not the string \"1\\u000ak20 = 2\""},
        Override{"energy.h0=1", "unknown key energy.h0; did you mean 'H0'? Allowed here: k20, k40, k42, H0, term"},
        Override{"mode.0.n=1",
                 "unknown key mode: write [[shape.mode]] or [[shape.noise]]. Allowed here: tier, about, energy, auto, "
                 "model, equilibrium, "
                 "velocity, "
                 "shape, accuracy, discretisation, time, expect"},
        Override{"model.kind=honey",
                 "model.kind must be one of \"gradient-flow\", \"overdamped\", \"stokes\", \"fluid\", \"auto\", not "
                 "\"honey\""},
        Override{
            "shape.mode.1.n=2",
            "missing key shape.mode.1.amplitude: a finite number; entries count from 0, so shape.mode.1 is a new one"},
        Override{"accuracy.r_min=0.8",
                 "accuracy.r_min must be below the smallest radius of the start (0.7 at z = 1), not 0.8"},
        Override{"time.output.1=0.1",
                 "time.output.1 must be larger than the 0.1 before it, not 0.1: time.output is a "
                 "list of increasing numbers"},
        Override{"shape.mode.0.m=1",
                 "shape.mode.0.m must be 0, not 1: tier \"axisym\" is axisymmetric and has no waves "
                 "around the axis"},
    });
    // A place in the file may be to blame because of an override elsewhere.
    EXPECT_EQ(refusal(good, {"shape.radius=0.25"}),
              "case.toml:9:1: shape must have r0(z) > 0 everywhere, but r0 = -0.05 at z = 1 (with --set "
              "shape.radius=0.25)");
}

TEST(Case, HoldsWhatTheFileSays) {
    const Case c = parse_case(good, {}, "case.toml");
    EXPECT_EQ(c.path, "case.toml");
    EXPECT_EQ(c.text, good);
    EXPECT_EQ(c.title, "test");
    EXPECT_EQ(c.energy.k, (decltype(c.energy.k){1.0, 0.0, 0.06}));
    EXPECT_EQ(c.energy.H0, 0);
    const Tube& tube = std::get<Tube>(c.shape);
    EXPECT_EQ(tube.radius, 1);
    EXPECT_EQ(tube.length, 2);
    ASSERT_EQ(tube.modes.size(), 1u);
    EXPECT_EQ(tube.modes[0].amplitude, 0.3);
    EXPECT_EQ(tube.modes[0].n, 1);
    EXPECT_EQ(c.accuracy.energy, 1e-6);
    EXPECT_EQ(c.time.end, 1.4);
    EXPECT_EQ(c.time.output, (std::vector{0.1, 0.2}));
    EXPECT_EQ(c.expect.stop, Stop::finished);  // the default once [expect] is there
    ASSERT_EQ(c.expect.values.size(), 2u);
    EXPECT_EQ(c.expect.values[0].series, "energy");
    EXPECT_FALSE(c.expect.values[0].time);
    EXPECT_EQ(c.expect.values[0].value, 1.0);
    EXPECT_EQ(c.expect.values[0].rel, 1e-6);
    EXPECT_FALSE(c.expect.values[0].abs);
    EXPECT_EQ(c.expect.values[1].series, "r_min");
    EXPECT_EQ(c.expect.values[1].time, 0.1);
    EXPECT_EQ(c.expect.values[1].abs, 1e-3);
}

TEST(Case, DefaultsAreThoseOfThePlainData) {
    const Case c = parse_case(
        "tier = \"axisym\"\nenergy.k40 = 1\ntime.end = 2\n"
        "shape = {kind = \"tube\", radius = 1, length = 3}\n",
        {}, "case.toml");
    EXPECT_EQ(c.energy.k, (decltype(c.energy.k){0.0, 1.0, 0.0}));  // an integer where a float is wanted
    EXPECT_EQ(c.model.kind, ModelKind::gradient_flow);
    EXPECT_EQ(c.accuracy.energy, Accuracy{}.energy);
    EXPECT_EQ(c.accuracy.r_min, Accuracy{}.r_min);
    EXPECT_EQ(c.discretisation.order, Discretisation{}.order);
    EXPECT_EQ(c.time.integrator, Integrator::ida);
    EXPECT_EQ(c.time.max_order, 5);
    EXPECT_EQ(c.discretisation.symmetry, Discretisation{}.symmetry);
    EXPECT_FALSE(c.discretisation.elements || c.discretisation.smoothness || c.discretisation.time_tolerance);
    EXPECT_TRUE(c.time.output.empty());
    EXPECT_FALSE(c.time.stationary || c.time.limit);
    EXPECT_FALSE(c.expect.stop);
    EXPECT_TRUE(c.expect.values.empty());
}

TEST(Case, AcceptsEveryKeyAtTheEdgeOfItsRange) {
    const Case c =
        parse_case(good,
                   {"about.source=Fig. 3", "energy.k40=2", "energy.H0=-2", "model.volume=free", "accuracy.energy=0.1",
                    "accuracy.r_min=0.69", "discretisation.order=7", "discretisation.smoothness=6",
                    "discretisation.elements=100000", "discretisation.time_tolerance=0.1", "time.max_order=1",
                    "discretisation.symmetry=false", "time.output=[0, 1.4]", "time.stationary=1e-9", "time.limit=60",
                    "expect.stop=pinch-off", "expect.stop_time={value = 1.4, rel = 1e-5}",
                    "expect.mode_0={value = 0, abs = 1}", "expect.at.0.time=1.4"},
                   "case.toml");
    EXPECT_EQ(c.source, "Fig. 3");
    EXPECT_EQ(c.energy.k[1], 2);
    EXPECT_EQ(c.energy.H0, -2);
    EXPECT_EQ(c.accuracy.energy, 0.1);
    EXPECT_EQ(c.accuracy.r_min, 0.69);
    EXPECT_EQ(c.discretisation.order, 7);
    EXPECT_EQ(c.discretisation.smoothness, 6);
    EXPECT_EQ(c.discretisation.elements, 100000);
    EXPECT_EQ(c.discretisation.time_tolerance, 0.1);
    EXPECT_EQ(c.time.max_order, 1);
    EXPECT_FALSE(c.discretisation.symmetry);
    EXPECT_EQ(c.time.output, (std::vector{0.0, 1.4}));
    EXPECT_EQ(c.time.stationary, 1e-9);
    EXPECT_EQ(c.time.limit, 60);
    EXPECT_EQ(c.expect.stop, Stop::pinch_off);
    ASSERT_EQ(c.expect.values.size(), 4u);  // at the end in alphabetical order of the keys, then at moments
    EXPECT_EQ(c.expect.values[1].series, "mode_0");
    EXPECT_EQ(c.expect.values[2].series, "time");
    EXPECT_EQ(c.expect.values[2].value, 1.4);
    EXPECT_EQ(c.expect.values[3].time, 1.4);
}

TEST(Case, HoldsItsLoads) {
    const auto law = [](const std::vector<std::string>& sets) {
        return motion_law(parse_case(good, sets, "case.toml").model);
    };
    const MotionLaw plain = law({});
    EXPECT_TRUE(plain.unconstrained() && plain.area_is_free() && plain.without_loads());
    EXPECT_FALSE(plain.keeps_area || plain.reservoir || plain.free_period);
    const Case zero = parse_case(good, {"model.tension=0", "model.pressure=0"}, "case.toml");
    EXPECT_EQ(zero.model.tension, Ramp(0));
    EXPECT_EQ(zero.model.area, AreaRule::free);  // the default, once it is read
}

TEST(Case, KnowsTheSeriesOfEveryEnergyTerm) {
    for_each_bending_term([](std::size_t, const auto& term) {
        const std::string series = std::string("energy_") + term.name;
        const Case c = parse_case(good, {"expect." + series + "={value = 1, rel = 0.1}"}, "case.toml");
        EXPECT_EQ(c.expect.values[1].series, series);
    });
}

TEST(Case, TakesTheSameModeTwice) {
    const Case c = parse_case(good, {"shape.mode.1={amplitude = 0.3, n = 1}"}, "case.toml");
    EXPECT_EQ(std::get<Tube>(c.shape).modes.size(), 2u);
}

TEST(CaseOverride, ReplacesAppendsAndMakesTables) {
    const std::vector<std::string> sets{
        "energy.k42=0",      "shape.mode.0.amplitude=0.2", "shape.mode.1.n=3",    "shape.mode.1.amplitude=1e-3",
        "time.output.2=0.5", "about.title=two words",      "about.source=\"1.5\""};
    const Case c = parse_case(good, sets, "case.toml");
    EXPECT_EQ(c.sets, sets);
    EXPECT_EQ(c.text, good);
    EXPECT_EQ(c.energy.k[2], 0);
    const Tube& tube = std::get<Tube>(c.shape);
    ASSERT_EQ(tube.modes.size(), 2u);
    EXPECT_EQ(tube.modes[0].amplitude, 0.2);
    EXPECT_EQ(tube.modes[1].n, 3);
    EXPECT_EQ(tube.modes[1].amplitude, 1e-3);
    EXPECT_EQ(c.time.output, (std::vector{0.1, 0.2, 0.5}));
    EXPECT_EQ(c.title, "two words");
    EXPECT_EQ(c.source, "1.5");

    // A whole case can be made of overrides, lists included.
    const Case bare = parse_case(
        "",
        {"tier=axisym", "energy.k20=1", "model.kind=gradient-flow", "shape.kind=tube", "shape.radius=1",
         "shape.length=2", "shape.mode.0.n=2", "shape.mode.0.amplitude=0.1", "time.end=1", "time.output.0=0.5"},
        "case.toml");
    EXPECT_EQ(std::get<Tube>(bare.shape).modes.at(0).n, 2);
    EXPECT_EQ(bare.time.output, std::vector{0.5});
}

TEST(CaseOverride, TheLastOneWins) {
    EXPECT_EQ(parse_case(good, {"energy.k42=1", "energy.k42=2"}, "case.toml").energy.k[2], 2);
}

// A file of this process alone: tests run side by side.
std::filesystem::path temporary(const std::string& name) {
    return std::filesystem::path(testing::TempDir()) / (std::to_string(getpid()) + "_" + name);
}

TEST(CaseFile, ReadsWhatParseReads) {
    const std::filesystem::path path = temporary("good.toml");
    std::ofstream(path) << good;
    const Case c = read_case(path, {"energy.k42=0.12"});
    std::filesystem::remove(path);
    EXPECT_EQ(c.path, path.string());
    EXPECT_EQ(c.text, good);
    EXPECT_EQ(c.energy.k[2], 0.12);
}

// What the program prints (both streams), and its exit status.
std::pair<std::string, int> run_program(const std::string& arguments) {
    FILE* pipe = popen((test::program + " " + arguments + " 2>&1").c_str(), "r");
    std::string output;
    for (int c; (c = std::fgetc(pipe)) != EOF;) output += static_cast<char>(c);
    const int status = pclose(pipe);
    return {output, WIFEXITED(status) ? WEXITSTATUS(status) : -1};
}

TEST(CheckCommand, PrintsTheEffectiveCaseAndLooksAtAllCases) {
    const std::string good_path = temporary("good.toml"), bad_path = temporary("bad.toml");
    std::ofstream(good_path) << good;
    std::ofstream(bad_path) << with("radius", "raduis");

    const auto [output, status] = run_program("check --quick --set energy.k42=0.5 " + good_path);
    EXPECT_EQ(status, 0);
    const Case c = parse_case(good, {"energy.k42=0.5"}, good_path);
    EXPECT_EQ(output, "# OK " + good_path + "\n" + effective_toml(c) + "\n");

    const auto [both, failed] = run_program("check " + bad_path + " " + good_path);
    EXPECT_EQ(failed, 2);
    EXPECT_EQ(both.find(bad_path + ":11:1: unknown key shape.raduis"), 0u) << both;
    EXPECT_NE(both.find("# OK " + good_path), std::string::npos) << both;
    std::filesystem::remove(good_path);
    std::filesystem::remove(bad_path);
}

TEST(CaseFile, TheDocumentedExampleIsOne) {
    std::ifstream file(test::sources + "/docs/case_files.md");
    const std::string guide{std::istreambuf_iterator<char>(file), {}};
    const std::string fence = "```toml\n";
    const std::size_t begin = guide.find(fence);
    ASSERT_NE(begin, std::string::npos);
    const std::string example = guide.substr(begin + fence.size(), guide.find("```", begin + 3) - begin - fence.size());
    EXPECT_EQ(refusal(example), "accepted");
}

TEST(TierAuto, ReadsItsTables) {
    const std::string text = with("tier = \"axisym\"", "tier = \"auto\"");
    const Case plain = parse_case(text, {"discretisation.order=4"}, "case.toml");
    EXPECT_EQ(plain.tier, Tier::automatic);
    EXPECT_EQ(plain.automatic.noise, 1e-6);  // the defaults of docs/case_files.md
    EXPECT_EQ(plain.automatic.largest, 1e-2);
    EXPECT_EQ(plain.automatic.modes, 4);
    EXPECT_EQ(plain.accuracy.r_min, 1e-2);  // as in tier surface3d
    const Case c = parse_case(text,
                              {"discretisation.order=3", "auto.noise=1e-5", "auto.largest=0.05", "auto.modes=7",
                               "discretisation.elements=90", "shape.mode.0.m=2"},
                              "case.toml");
    EXPECT_EQ(c.automatic.noise, 1e-5);
    EXPECT_EQ(c.automatic.largest, 0.05);
    EXPECT_EQ(c.automatic.modes, 7);
    EXPECT_EQ(c.surface.elements, 90);
    const Case again = parse_case(effective_toml(c), {}, "again.toml");
    EXPECT_EQ(again.automatic.modes, 7);
    EXPECT_EQ(effective_toml(again), effective_toml(c));
}

TEST(TierAuto, RefusesWhatBelongsElsewhere) {
    const auto refused = [](const std::string& set) {
        return refusal(with("tier = \"axisym\"", "tier = \"auto\""), {"discretisation.order=4", set});
    };
    EXPECT_EQ(refused("auto.noise=0"), "--set auto.noise=0: auto.noise must be a number > 0 and <= 0.1, not 0");
    EXPECT_EQ(refused("auto.noise=0.05"),
              "--set auto.noise=0.05: auto.noise must be below auto.largest = 0.01, not 0.05");
    EXPECT_EQ(refused("auto.largest=0.5"),
              "--set auto.largest=0.5: auto.largest must be a number > 0 and <= 0.1, not 0.5");
    EXPECT_EQ(refused("auto.modes=0"), "--set auto.modes=0: auto.modes must be an integer >= 1 and <= 20, not 0");
    EXPECT_EQ(refused("auto.mods=3"),
              "--set auto.mods=3: unknown key auto.mods; did you mean 'modes'? Allowed here: noise, largest, modes");
    EXPECT_EQ(refused("equilibrium.modes=2"),
              "--set equilibrium.modes=2: equilibrium must be absent: only valid with tier = \"axisym\"");
    EXPECT_EQ(refused("discretisation.parametrisation=even").substr(0, 92),
              "--set discretisation.parametrisation=even: unknown key discretisation.parametrisation: only ");
    EXPECT_EQ(
        refused("discretisation.scheme=paper"),
        "--set discretisation.scheme=paper: discretisation.scheme must not be \"paper\" in tier \"auto\": it has no "
        "error estimate");
    EXPECT_EQ(refused("accuracy.r_min=0.8").substr(0, 79),
              "--set accuracy.r_min=0.8: accuracy.r_min must be below the smallest radius of t");
    for (const std::string tier : {"axisym", "surface3d"})
        EXPECT_EQ(refusal(with("tier = \"axisym\"", "tier = \"" + tier + "\"") + "[auto]\nmodes = 3\n",
                          {"discretisation.order=3"}),
                  "case.toml:28:1: auto must be absent: only valid with tier = \"auto\" (with --set "
                  "discretisation.order=3)");
}

TEST(EffectiveToml, WritesOverridesAndDefaultsOut) {
    const Case c = parse_case(good, {"energy.H0=-2", "expect.stop_time={value = 1.4, abs = 0.5}"}, "case.toml");
    EXPECT_EQ(
        effective_toml(c),
        "tier = \"axisym\"\n"
        "\n[about]\ntitle = \"test\"\n"
        "\n[energy]\nk20 = 1\nk40 = 0\nk42 = 0.06\nH0 = -2\n"
        "\n[model]\nkind = \"gradient-flow\"\nvolume = \"free\"\narea = \"free\"\nperiod = \"fixed\"\ntension = "
        "0\npressure = 0\n"
        "\n[shape]\nkind = \"tube\"\nradius = 1\nlength = 2\n"
        "\n[[shape.mode]]\namplitude = 0.3\nn = 1\nm = 0\nphase = 0\n"
        "\n[accuracy]\nenergy = 1e-06\nrelative_to = \"magnitude\"\nr_min = 0.001\n"
        "\n[discretisation]\norder = 5\nsymmetry = true\n"
        "\n[time]\nend = 1.4\noutput = [0.1, 0.2]\nintegrator = \"ida\"\nmax_order = 5\n"
        "\n[expect]\nstop = \"finished\"\nenergy = {value = 1, rel = 1e-06}\nstop_time = {value = 1.4, abs = 0.5}\n"
        "\n[[expect.at]]\ntime = 0.1\nr_min = {value = 0.7, abs = 0.001}\n");
}

TEST(EffectiveToml, ReadsBackExactly) {
    const Case c = parse_case(
        good,
        {"about.title='quote \" backslash \\ tab \t'", "energy.k20=0.1234567890123456789", "energy.k40=1e300",
         "energy.H0=-1e-300", "shape.mode.1={amplitude = -1e-5, n = 7, phase = 2}", "discretisation.elements=64",
         "discretisation.smoothness=2", "discretisation.time_tolerance=1e-10", "time.stationary=1e-8", "time.limit=3.5",
         "expect.stop=overhang", "expect.at.1={time = 0.3, area = {value = 12, rel = 1e-3, abs = 1}}",
         "expect.at.1.volume={value = 6, rel = 0.1}"},
        "case.toml");
    const std::string text = effective_toml(c);
    const Case again = parse_case(text, {}, "case.toml");
    EXPECT_EQ(effective_toml(again), text);
    EXPECT_EQ(again.title, "quote \" backslash \\ tab \t");
    EXPECT_EQ(again.energy.k, c.energy.k);
    EXPECT_EQ(again.energy.H0, -1e-300);
    EXPECT_EQ(std::get<Tube>(again.shape).modes[1].phase, 2);
    EXPECT_EQ(again.discretisation.elements, 64);
    EXPECT_EQ(again.discretisation.smoothness, 2);
    EXPECT_EQ(again.discretisation.time_tolerance, 1e-10);
    EXPECT_EQ(again.time.stationary, 1e-8);
    EXPECT_EQ(again.time.limit, 3.5);
    EXPECT_EQ(again.expect.stop, Stop::overhang);
    ASSERT_EQ(again.expect.values.size(), 4u);
    EXPECT_EQ(again.expect.values[2].series, "area");
    EXPECT_EQ(again.expect.values[3].series, "volume");
    EXPECT_EQ(again.expect.values[3].time, 0.3);
}

// Two tables [[expect.at]] of one time, each with the same series, stay two.
TEST(EffectiveToml, KeepsWhatIsExpectedTwice) {
    const std::string at = "\n[[expect.at]]\ntime = 0.1\nenergy = {value = 1, abs = 1}\n";
    const std::string text = effective_toml(parse_case(good + at + at, {}, "case.toml"));
    EXPECT_EQ(effective_toml(parse_case(text, {}, "again.toml")), text);
    EXPECT_NE(text.find("time = 0.1", text.find("time = 0.1") + 1), std::string::npos);
}

TEST(NearMiss, AllowsOneSlipInThreeLetters) {
    EXPECT_EQ(near_miss("Length", {"radius", "length"}), "length");  // letter case
    EXPECT_EQ(near_miss("k24", {"k20", "k42"}), "k42");              // neighbours swapped
    EXPECT_EQ(near_miss("stationery", {"finished", "stationary"}), "stationary");
    EXPECT_FALSE(near_miss("sphere", {"tube"}));
}

TEST(Tube, RadiusIsDifferentiable) {
    const Tube tube{1.5, 3, {{0.2, 2, 0, 0.4}, {0.1, 0, 0, 0}}};
    const double q = 2 * std::numbers::pi * 2 / 3, z = 0.7, h = 1e-30;
    EXPECT_DOUBLE_EQ(radius_at(tube, z), 1.6 + 0.2 * std::cos(q * z + 0.4));  // the formula of the shape
    // Complex step, exact to rounding: r0(z + i h) = r0 + i h r0'.
    EXPECT_DOUBLE_EQ(radius_at(tube, std::complex<double>(z, h)).imag() / h, -0.2 * q * std::sin(q * z + 0.4));
}

TEST(CaseErrors, allAreReportedAtOnce) {
    EXPECT_EQ(refusal(with("radius", "raduis"), {"energy.k43=1", "accuracy.energy=often", "time.end=-1"}),
              "--set energy.k43=1: unknown key energy.k43; did you mean 'k40'? Allowed here: k20, k40, k42, H0, term\n"
              "case.toml:11:1: unknown key shape.raduis; did you mean 'radius'? Allowed here: kind, radius, length, "
              "mode, noise "
              "(with --set energy.k43=1 --set accuracy.energy=often --set time.end=-1)\n"
              "--set accuracy.energy=often: accuracy.energy must be a number > 1e-12 and <= 0.1, not the string "
              "\"often\"\n"
              "--set time.end=-1: time.end must be a number > 0, not -1");
}

TEST(CaseRanges, OutputTimesEvenlySpaced) {
    EXPECT_EQ(parse_case(good, {"time.output=0.2:1.4:4"}, "case.toml").time.output,
              (std::vector<double>{0.2, 0.2 + (1.4 - 0.2) * 1 / 3, 0.2 + (1.4 - 0.2) * 2 / 3, 1.4}));
    const std::string form =
        "time.output must be a list of increasing numbers or a range \"lo:hi:n\", each >= 0 and "
        "<= 1.4 (time.end), not the string ";
    for (const std::string bad : {"0:2:3", "0:1", "1:0:3", "0:1:1", "0:1:2.5", "0:1:1e9", "-1:1:3", "a:1:2"})
        EXPECT_EQ(refusal(good, {"time.output=" + bad}), "--set time.output=" + bad + ": " + form + "\"" + bad + "\"");
}

// What only follows from another wrong key is no complaint of its own.
TEST(CaseErrors, consequencesAreNotReported) {
    const std::string flow = with("gradient-flow", "fluidd");
    EXPECT_EQ(refusal(flow, {"velocity.initial=rotation", "velocity.omega=1", "model.Re=1"}).substr(0, 52),
              "case.toml:8:8: model.kind must be one of \"gradient-f");
    EXPECT_EQ(refusal(flow, {"velocity.initial=rotation", "velocity.omega=1", "model.Re=1"}).find('\n'),
              std::string::npos);
    // Neither are the outputs too late, nor is anything missing.
    for (const char* set : {"time.end=often", "tier=axsym", "shape.kind=tub", "shape.radius=x"})
        EXPECT_EQ(refusal(good, {set}).find('\n'), std::string::npos) << refusal(good, {set});
    EXPECT_EQ(refusal(with("[time]", "[tmie]")).find("missing"), std::string::npos);
    EXPECT_EQ(refusal(""), "case.toml:1:1: missing key tier: one of \"axisym\", \"surface3d\", \"auto\"");
}

TEST(CaseErrors, complaintsHaveTheirParts) {
    try {
        parse_case(with("radius", "raduis"), {"model.kind=fluidd"}, "case.toml");
        FAIL();
    } catch (const CaseErrors& error) {
        ASSERT_EQ(error.complaints.size(), 2u);
        EXPECT_EQ(error.complaints[0].place, "--set model.kind=fluidd");
        EXPECT_EQ(error.complaints[0].key, "model.kind");
        EXPECT_EQ(error.complaints[0].suggestion, "fluid");
        EXPECT_EQ(error.complaints[1].place, "case.toml:11:1");
        EXPECT_EQ(error.complaints[1].key, "shape.raduis");
        EXPECT_EQ(error.complaints[1].suggestion, "radius");
    }
}

TEST(Tube, NarrowestPlaceLiesBetweenSamples) {
    // 1 + a cos x + b cos 2x, x = pi z, is smallest at cos x = -a/(4b), with the value 1 - a^2/(8b) - b.
    const Tube tube{1, 2, {{0.3, 1, 0, 0}, {0.2, 2, 0, 0}}};
    const Neck neck = narrowest(tube);
    EXPECT_NEAR(neck.radius, 0.74375, 1e-14);
    EXPECT_NEAR(std::cos(std::numbers::pi * neck.z), -0.375, 1e-6);
    EXPECT_EQ(narrowest(Tube{0.5, 2, {}}).radius, 0.5);  // uniform
}

TEST(Tube, VolumeIsExact) {
    // Modes of the same n add as waves; the trapezoidal rule is exact for trigonometric polynomials.
    const Tube tube{1, 2, {{0.2, 1, 0, 0.3}, {0.1, 1, 0, 1}, {0.05, 3, 0, 0}, {0.04, 0, 0, 0.5}}};
    double sum = 0;
    const int n = 16;
    for (int i = 0; i < n; ++i) sum += std::pow(radius_at(tube, tube.length * i / n), 2);
    EXPECT_NEAR(volume(tube), std::numbers::pi * tube.length * sum / n, 1e-13);
}

}  // namespace
}  // namespace tubule
