// Internal to read_mesh: what the reader of each format returns, before vertices are merged and polygons triangulated,
// and the words and numbers of text files, each with its place.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "surface3d/import/import_mesh.hpp"

namespace tubule::surface3d {

struct FileCorner {
    std::int64_t vertex = 0;  // counted from 0, whatever the file counts from; not yet checked
    Place place;
};

struct FileMesh {
    std::vector<Eigen::Vector3d> points;
    std::vector<std::vector<FileCorner>> faces;
    std::int64_t first = 0;  // number of the first vertex in the file
};

// Each takes the file's name (for messages) and its whole contents. Throw MeshError.
FileMesh read_obj(const std::string& name, std::string_view text);
FileMesh read_off(const std::string& name, std::string_view text);
FileMesh read_ply(const std::string& name, std::string_view data);
FileMesh read_stl(const std::string& name, std::string_view data);

// Triangulates a simple, nearly planar polygon in space (indices into `corners`) by clipping the best-shaped ear
// repeatedly. Empty when it crosses itself or has no area.
std::vector<std::array<int, 3>> cut_polygon(const std::vector<Eigen::Vector3d>& corners);

// Throws MeshError: "name:line:column: message" in text, "name: byte n: message" in binary.
[[noreturn]] void refuse_at(const std::string& name, const Place& place, const std::string& message);

struct Word {
    std::string_view text;
    Place place;
};

// Reads a text line by line; lines may end in LF, CRLF or CR. A `comment` character (0: none) ends a line.
class TextReader {
public:
    TextReader(std::string name, std::string_view text, char comment);

    // The next line that has words in it; false at the end of the file.
    bool next_line();
    const std::vector<Word>& words() const { return words_; }

    // The next word, on this line or a later one. Throws MeshError, with `what` as expected, at the end of the file.
    Word next_word(const std::string& what);

    std::size_t position() const { return position_; }  // byte after the line last read

    // Throw MeshError, naming the word, when it does not have the right form.
    double number(const Word& word) const;  // finite
    std::int64_t integer(const Word& word) const;
    Eigen::Vector3d point(std::size_t first_word) const;  // three words of this line

    [[noreturn]] void fail(const Word& word, const std::string& message) const;
    [[noreturn]] void fail_line(const std::string& message) const;  // at the line's first word
    [[noreturn]] void fail_end(const std::string& what) const;      // "the file ends; expected `what`"

private:
    std::string name_;
    std::string_view text_;
    char comment_;
    std::size_t position_ = 0, line_ = 0;
    std::vector<Word> words_;
    std::size_t next_ = 0;  // of words_
};

// Equal up to letter case; `lower` is in lower case.
bool is_keyword(std::string_view word, std::string_view lower);

}  // namespace tubule::surface3d
