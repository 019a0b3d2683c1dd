// The two line-based formats.
#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "surface3d/import/import_formats.hpp"

namespace tubule::surface3d {

namespace {

// A logical line: a backslash at its end joins the next one to it.
bool next_joined_line(TextReader& reader, std::vector<Word>& words) {
    words.clear();
    while (reader.next_line()) {
        words.insert(words.end(), reader.words().begin(), reader.words().end());
        if (!words.back().text.ends_with('\\')) return true;
        words.back().text.remove_suffix(1);
        if (words.back().text.empty()) words.pop_back();
    }
    return !words.empty();
}

// "7", "7/1", "7/1/3", "7//3"; negative ones count back from the vertex last read.
FileCorner obj_corner(const TextReader& reader, const Word& word, std::size_t vertices) {
    const std::size_t slash = std::min(word.text.find('/'), word.text.size());
    const std::int64_t number = reader.integer({word.text.substr(0, slash), word.place});
    if (number == 0) reader.fail(word, "OBJ counts vertices from 1, or back from -1; there is no vertex 0");
    for (std::size_t i = slash; i < word.text.size();) {  // texture and normal: only their form is checked
        const std::size_t end = std::min(word.text.find('/', i + 1), word.text.size());
        if (end > i + 1) reader.integer({word.text.substr(i + 1, end - i - 1), word.place});
        i = end;
    }
    if (number < 0 && -number > std::int64_t(vertices)) {
        reader.fail(word, fmt::format("vertex {} counts back from the end, but only {} vertices have been read so far",
                                      number, vertices));
    }
    return {number > 0 ? number - 1 : number + std::int64_t(vertices), word.place};
}

// Keywords that do not affect the triangles.
constexpr std::array obj_ignored = {"vt",     "vn",       "vp",       "g",          "o",        "s",      "mg",
                                    "usemtl", "mtllib",   "lod",      "l",          "p",        "usemap", "maplib",
                                    "bevel",  "c_interp", "d_interp", "shadow_obj", "trace_obj"};

}  // namespace

FileMesh read_obj(const std::string& name, std::string_view text) {
    TextReader reader(name, text, '#');
    FileMesh mesh{.points = {}, .faces = {}, .first = 1};
    std::vector<Word> words;
    while (next_joined_line(reader, words)) {
        const std::string_view key = words[0].text;
        if (key == "v") {
            // A weight or a colour may follow the three coordinates.
            if (words.size() < 4) reader.fail(words[0], "a point needs three coordinates");
            mesh.points.emplace_back(reader.number(words[1]), reader.number(words[2]), reader.number(words[3]));
        } else if (key == "f" || key == "fo") {
            std::vector<FileCorner>& face = mesh.faces.emplace_back();
            for (std::size_t i = 1; i < words.size(); ++i)
                face.push_back(obj_corner(reader, words[i], mesh.points.size()));
            if (face.size() < 3) reader.fail(words[0], "a face needs three vertices");
        } else if (std::find(obj_ignored.begin(), obj_ignored.end(), key) == obj_ignored.end()) {
            reader.fail(words[0], fmt::format("cannot read '{}': only vertices and flat faces (v, f) are supported",
                                              key.substr(0, 20)));
        }
    }
    return mesh;
}

FileMesh read_off(const std::string& name, std::string_view text) {
    TextReader reader(name, text, '#');
    if (!reader.next_line()) reader.fail_end("the word OFF");
    std::vector<Word> words = reader.words();
    const std::string_view key = words[0].text;
    if (!key.ends_with("OFF") || key.size() > 6) reader.fail_line("an OFF file begins with the word OFF");
    if (key.find_first_of("4n") != key.npos) reader.fail_line("only three-dimensional OFF is supported");
    if (words.size() > 1 && is_keyword(words[1].text, "binary")) reader.fail_line("binary OFF is not supported");
    words.erase(words.begin());
    if (words.empty()) {
        if (!reader.next_line()) reader.fail_end("the numbers of vertices and faces");
        words = reader.words();
    }
    if (words.size() < 2) reader.fail(words[0], "expected the numbers of vertices, faces (and edges)");
    const std::int64_t points = reader.integer(words[0]), faces = reader.integer(words[1]);
    if (points < 0) reader.fail(words[0], "the number of vertices must not be negative");
    if (faces < 0) reader.fail(words[1], "the number of faces must not be negative");

    FileMesh mesh;
    for (std::int64_t i = 0; i < points; ++i) {
        if (!reader.next_line()) reader.fail_end(fmt::format("vertex {} of {}", i, points));
        if (i == faces && reader.words().size() == 4 && reader.words()[0].text == "3")
            reader.fail_line(
                fmt::format("vertex {} has four numbers, as a face: are the numbers of vertices and faces, "
                            "{} and {}, swapped in the header?",
                            i, points, faces));
        mesh.points.push_back(reader.point(0));  // normals, colours and textures come after
    }
    for (std::int64_t i = 0; i < faces; ++i) {
        if (!reader.next_line()) reader.fail_end(fmt::format("face {} of {}", i, faces));
        const std::vector<Word>& line = reader.words();  // number of vertices, vertices, colour
        const std::int64_t n = reader.integer(line[0]);
        if (n < 3) reader.fail(line[0], fmt::format("a face needs three vertices, this one has {}", n));
        if (n > std::int64_t(line.size()) - 1)
            reader.fail(line[0],
                        fmt::format("the line has fewer than the {} vertices of this face, {} of {}; is the file "
                                    "complete?",
                                    n, i, faces));
        std::vector<FileCorner>& face = mesh.faces.emplace_back();
        for (std::int64_t j = 1; j <= n; ++j) face.push_back({reader.integer(line[j]), line[j].place});
    }
    if (reader.next_line()) reader.fail_line(fmt::format("the file continues after its {} faces", faces));
    return mesh;
}

}  // namespace tubule::surface3d
