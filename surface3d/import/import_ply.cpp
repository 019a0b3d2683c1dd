#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <type_traits>

#include "surface3d/import/import_formats.hpp"

namespace tubule::surface3d {

namespace {

// A type of numbers: its two names, and how its bytes are read.
struct Scalar {
    std::string_view name, alias;
    std::size_t size;
    double (*value)(const char* bytes);
    bool is_real;
};
template <class T>
constexpr Scalar scalar(std::string_view name, std::string_view alias) {
    const auto value = [](const char* bytes) {
        T out;
        std::memcpy(&out, bytes, sizeof(T));
        return static_cast<double>(out);
    };
    return {name, alias, sizeof(T), value, std::is_floating_point_v<T>};
}
constexpr Scalar scalars[] = {scalar<std::int8_t>("char", "int8"),    scalar<std::uint8_t>("uchar", "uint8"),
                              scalar<std::int16_t>("short", "int16"), scalar<std::uint16_t>("ushort", "uint16"),
                              scalar<std::int32_t>("int", "int32"),   scalar<std::uint32_t>("uint", "uint32"),
                              scalar<float>("float", "float32"),      scalar<double>("double", "float64")};

struct Property {
    std::string name;
    const Scalar* type;
    const Scalar* count;  // of a list, else null

    const Scalar& first() const { return count ? *count : *type; }  // of its numbers in the file
};

struct Element {
    std::string name;
    std::int64_t count = 0;
    std::vector<Property> properties;
};

struct Header {
    std::string format;
    std::vector<Element> elements;
};

Property read_property(const TextReader& reader) {
    const std::vector<Word>& words = reader.words();
    const auto type = [&](std::size_t i) {
        for (const Scalar& known : scalars)
            if (words[i].text == known.name || words[i].text == known.alias) return &known;
        reader.fail(words[i], fmt::format("unknown type '{}'", words[i].text.substr(0, 20)));
    };
    const bool list = words.size() > 1 && words[1].text == "list";
    if (words.size() != (list ? 5 : 3)) reader.fail_line("a property needs a type and a name");
    if (!list) return {std::string(words[2].text), type(1), nullptr};
    if (type(2)->is_real) reader.fail(words[2], "the length of a list must have an integer type");
    return {std::string(words[4].text), type(3), type(2)};
}

Header read_header(TextReader& reader) {
    Header header;
    if (!reader.next_line()) reader.fail_end("the word ply");
    if (reader.words()[0].text != "ply") reader.fail_line("a PLY file begins with the word ply");
    while (true) {
        if (!reader.next_line()) reader.fail_end("end_header");
        const std::vector<Word>& words = reader.words();
        const std::string_view key = words[0].text;
        if (key == "end_header") break;
        if (key == "comment" || key == "obj_info") continue;
        if (key == "format" && words.size() == 3) {
            header.format = words[1].text;
        } else if (key == "element" && words.size() == 3) {
            header.elements.push_back({std::string(words[1].text), reader.integer(words[2]), {}});
            if (header.elements.back().count < 0) reader.fail(words[2], "the count must not be negative");
        } else if (key == "property" && !header.elements.empty()) {
            header.elements.back().properties.push_back(read_property(reader));
        } else {
            reader.fail_line("not a line of a PLY header");
        }
    }
    const std::array formats = {"ascii", "binary_little_endian", "binary_big_endian"};
    if (std::find(formats.begin(), formats.end(), header.format) == formats.end()) {
        reader.fail_line("the header must name a format (ascii, binary_little_endian or binary_big_endian)");
    }
    return header;
}

struct Value {
    double value = 0;
    Place place;
};

// The values after the header, read in sequence from words or bytes.
class Body {
public:
    Body(const std::string& name, std::string_view data, TextReader& text, const std::string& format)
        : name_(name),
          data_(data),
          text_(text),
          position_(text.position()),
          ascii_(format == "ascii"),
          swap_((format == "binary_big_endian") != (std::endian::native == std::endian::big)) {}

    Value next(const Scalar& type, const std::string& what) {
        if (ascii_) {
            const Word word = text_.next_word(what);
            return {type.is_real ? text_.number(word) : double(text_.integer(word)), word.place};
        }
        if (data_.size() - position_ < type.size) fail({0, 0, data_.size()}, "the file ends; expected " + what);
        std::array<char, sizeof(double)> raw;
        for (std::size_t i = 0; i < type.size; ++i) raw[swap_ ? type.size - 1 - i : i] = data_[position_ + i];
        const Value value{type.value(raw.data()), {0, 0, position_}};
        position_ += type.size;
        return value;
    }

    // Throws MeshError if anything except white space follows.
    void expect_end() {
        if (ascii_) {
            if (text_.next_line()) text_.fail_line("the file continues after the elements that its header declares");
        } else if (data_.find_first_not_of(" \t\r\n", position_) != data_.npos) {
            fail({0, 0, position_}, "the file continues after the elements that its header declares");
        }
    }

    [[noreturn]] void fail(const Place& place, const std::string& message) const { refuse_at(name_, place, message); }

private:
    const std::string& name_;
    std::string_view data_;
    TextReader& text_;
    std::size_t position_;
    bool ascii_, swap_;
};

bool is_coordinate(const Property& p) {
    return !p.count && (p.name == "x" || p.name == "y" || p.name == "z");
}

bool is_corner_list(const Property& p) {
    return p.count && (p.name == "vertex_indices" || p.name == "vertex_index");
}

void read_element(Body& body, const Element& element, const std::string& what, FileMesh& mesh) {
    const bool vertex = element.name == "vertex", face = element.name == "face";
    if (vertex) mesh.points.emplace_back();
    for (const Property& property : element.properties) {
        const Value first = body.next(property.first(), what);
        if (vertex && is_coordinate(property)) {
            if (!std::isfinite(first.value)) body.fail(first.place, "a coordinate is not a finite number");
            mesh.points.back()[property.name[0] - 'x'] = first.value;
        }
        const bool corners = face && is_corner_list(property);
        if (corners && first.value < 3)
            body.fail(first.place, fmt::format("a face needs three vertices, this one has {}", first.value));
        if (corners) mesh.faces.emplace_back();
        for (double i = 0; property.count && i < first.value; ++i) {
            const Value value = body.next(*property.type, what);
            if (corners) mesh.faces.back().push_back({std::int64_t(value.value), value.place});
        }
    }
}

// Rejects files without points or faces before the body is read.
void check_header(const TextReader& reader, const Header& header) {
    int vertex_elements = 0, coordinates = 0, face_elements = 0, corner_lists = 0;
    for (const Element& element : header.elements) {
        if (element.properties.empty()) reader.fail_line(fmt::format("element {} has no properties", element.name));
        if (element.name == "tristrips") reader.fail_line("triangle strips are not supported; write faces instead");
        vertex_elements += element.name == "vertex";
        face_elements += element.name == "face";
        for (const Property& p : element.properties) {
            coordinates += element.name == "vertex" && is_coordinate(p);
            if (element.name == "face" && is_corner_list(p)) {
                if (p.type->is_real) reader.fail_line("the vertex indices of faces must have an integer type");
                ++corner_lists;
            }
        }
    }
    if (vertex_elements != 1 || coordinates != 3) {
        reader.fail_line("the header needs one element 'vertex' with properties x, y and z");
    }
    if (face_elements != 1 || corner_lists != 1) {
        reader.fail_line("the header needs one element 'face' with one list vertex_indices (or vertex_index)");
    }
}

}  // namespace

FileMesh read_ply(const std::string& name, std::string_view data) {
    TextReader text(name, data, 0);
    const Header header = read_header(text);
    check_header(text, header);
    if (header.format == "ascii") text.next_line();
    Body body(name, data, text, header.format);
    FileMesh mesh;
    for (const Element& element : header.elements)
        for (std::int64_t i = 0; i < element.count; ++i)
            read_element(body, element, fmt::format("{} {} of {}", element.name, i, element.count), mesh);
    body.expect_end();
    return mesh;
}

}  // namespace tubule::surface3d
