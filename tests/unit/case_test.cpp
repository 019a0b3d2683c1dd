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
#include <map>
#include <numbers>

#include "common/case/complaints.hpp"
#include "common/case/read.hpp"
#include "common/case/text.hpp"
#include "tests/support/message_of.hpp"
#include "tests/support/paths.hpp"

namespace tubule::case_test {

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

// A text of case_refusals.txt with what its escapes and names stand for.
std::string expanded(std::string text, const std::map<std::string, std::string>& names) {
    for (const auto& [name, value] : names)
        for (std::size_t at; (at = text.find('$' + name)) != std::string::npos;)
            text.replace(at, name.size() + 1, value);
    std::string out;
    for (std::size_t i = 0; i < text.size(); ++i) {
        if (text[i] != '\\')
            out += text[i];
        else if (text[++i] == 'x')
            out += static_cast<char>(std::stoi(text.substr(i + 1, 2), nullptr, 16)), i += 2;
        else
            out += text[i] == 'n' ? '\n' : text[i];
    }
    return out;
}

void expect_refused(const std::string& line, const std::map<std::string, std::string>& names) {
    SCOPED_TRACE(line);
    std::vector<std::string> parts;
    for (std::size_t at = 0, end = 0; end != std::string::npos; at = end + 3) {
        end = line.find(" | ", at);
        parts.push_back(expanded(line.substr(at, end - at), names));
    }
    const std::string option = "--set ";
    if (parts.size() == 2 && parts[0].starts_with(option)) {
        const std::string set = parts[0].substr(option.size());
        EXPECT_EQ(refusal(good, {set}), option + printable(set) + ": " + parts[1]);
    } else {
        ASSERT_EQ(parts.size(), 3u);
        EXPECT_EQ(refusal(with(parts[0], parts[1])), "case.toml:" + parts[2]);
    }
}

TEST(CaseRefusal, EachLineOfTheTable) {
    std::map<std::string, std::string> names = {{"shapes", shape_kinds()}, {"stops", ""}};
    for (const StopKind& kind : stop_kinds)
        names["stops"] += (names["stops"].empty() ? "one of \"" : ", \"") + std::string(kind.name) + "\"";
    std::ifstream table(test::sources + "/tests/unit/case_refusals.txt");
    std::string line;
    int count = 0;
    while (std::getline(table, line)) {
        while (table.peek() == ' ') {  // the line goes on
            std::string more;
            std::getline(table, more);
            line += more.substr(3);
        }
        if (line.empty() || line[0] == '#') continue;
        const std::size_t value = line.find(" = ");
        if (line[0] == '$')
            names[line.substr(1, value - 1)] = expanded(line.substr(value + 3), names);
        else
            expect_refused(line, names), ++count;
    }
    EXPECT_GT(count, 180);
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
    EXPECT_EQ(refusal(with("[shape]", "[velocity]\ninitial = \"rotation\"\nomega = 1.0\n[shape]")),
              "case.toml:10:11: velocity.initial must be absent: only valid with model.kind = \"fluid\" or \"auto\"");
}

TEST(CaseRefusal, OtherCases) {
    EXPECT_EQ(refusal(""), "case.toml:1:1: missing key tier: one of \"axisym\", \"surface3d\", \"auto\"");
    const std::string sphere =
        "tier = \"axisym\"\nenergy.k20 = 1\ntime.end = 1\nshape = {kind = \"sphere\", radius = 1}\n"
        "[model]\nvolume = \"fixed\"\nperiod = \"free\"\n";
    EXPECT_EQ(refusal(sphere), "case.toml:7:10: model.period must not be \"free\": only valid with a tube");
    // A place in the file may be to blame because of an override elsewhere.
    EXPECT_EQ(refusal(good, {"shape.radius=0.25"}),
              "case.toml:9:1: shape must have r0(z) > 0 everywhere, but r0 = -0.05 at z = 1 (with --set "
              "shape.radius=0.25)");
}

TEST(CaseRefusal, Files) {
    const auto message = [](const std::filesystem::path& path) -> std::string {
        return test::message_of<CaseError>([&] { read_case(path); });
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
        return test::message_of<CaseError>([&] { parse_case(text, sets, "x.toml"); });
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
    EXPECT_CONTAINS(both, "# OK " + good_path);
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
    EXPECT_EQ(
        refused("equilibrium.modes=2"),
        "--set equilibrium.modes=2: equilibrium must be absent: only valid with tier = \"axisym\" or \"surface3d\"");
    EXPECT_EQ(refused("discretisation.parametrisation=even").substr(0, 92),
              "--set discretisation.parametrisation=even: unknown key discretisation.parametrisation: only ");
    EXPECT_EQ(refused("discretisation.scheme=paper"),
              "--set discretisation.scheme=paper: discretisation.scheme must not be \"paper\": only valid with tier = "
              "\"axisym\" or \"surface3d\"; it has no error estimate");
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
        "\n[energy]\nk20 = 1\nk40 = 0\nk42 = 0.06\nkg = 0\nH0 = -2\n"
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
        {"units.length=50 nm", "units.bending_rigidity=20 kT", "units.friction=2e4 Pa s/m",
         "about.title='quote \" backslash \\ tab \t'", "energy.k20=0.1234567890123456789", "energy.k40=1e300",
         "energy.H0=-1e-300", "shape.mode.1={amplitude = -1e-5, n = 7, phase = 2}", "discretisation.elements=64",
         "discretisation.smoothness=2", "discretisation.time_tolerance=1e-10", "time.stationary=1e-8", "time.limit=3.5",
         "expect.stop=overhang", "expect.at.1={time = 0.3, area = {value = 12, rel = 1e-3, abs = 1}}",
         "expect.at.1.volume={value = 6, rel = 0.1}"},
        "case.toml");
    const std::string text = effective_toml(c);
    const Case again = parse_case(text, {}, "case.toml");
    EXPECT_EQ(effective_toml(again), text);
    EXPECT_EQ(again.title, "quote \" backslash \\ tab \t");
    EXPECT_EQ(scales_of(again).time, scales_of(c).time);
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
    EXPECT_EQ(
        refusal(with("radius", "raduis"), {"energy.k43=1", "accuracy.energy=often", "time.end=-1"}),
        "--set energy.k43=1: unknown key energy.k43; did you mean 'k40'? Allowed here: k20, k40, k42, kg, H0, alpha, "
        "M0, term, potential\n"
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

}  // namespace tubule::case_test
