#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <memory>
#include <optional>

#include "surface3d/import/import_formats.hpp"
#include "surface3d/import/import_text.hpp"

namespace tubule::surface3d {

namespace {

enum class Scalar { i8, u8, i16, u16, i32, u32, f32, f64 };

std::optional<Scalar> scalar_type(std::string_view name) {
    constexpr std::array<std::array<std::string_view, 2>, 8> names{{{"char", "int8"},
                                                                    {"uchar", "uint8"},
                                                                    {"short", "int16"},
                                                                    {"ushort", "uint16"},
                                                                    {"int", "int32"},
                                                                    {"uint", "uint32"},
                                                                    {"float", "float32"},
                                                                    {"double", "float64"}}};
    for (std::size_t i = 0; i < names.size(); ++i) {
        if (name == names[i][0] || name == names[i][1]) return Scalar(i);
    }
    return {};
}

bool is_real(Scalar type) {
    return type == Scalar::f32 || type == Scalar::f64;
}

struct Property {
    std::string name;
    Scalar type;
    std::optional<Scalar> count;  // of a list
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
        const auto known = scalar_type(words[i].text);
        if (!known) reader.fail(words[i], fmt::format("unknown type '{}'", words[i].text.substr(0, 20)));
        return *known;
    };
    const bool list = words.size() > 1 && words[1].text == "list";
    if (words.size() != (list ? 5 : 3)) reader.fail_line("a property needs a type and a name");
    if (!list) return {std::string(words[2].text), type(1), {}};
    if (is_real(type(2))) reader.fail(words[2], "the length of a list must have an integer type");
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

    Value next(Scalar type, const std::string& what) {
        if (ascii_) {
            const Word word = text_.next_word(what);
            return {is_real(type) ? text_.number(word) : double(text_.integer(word)), word.place};
        }
        switch (type) {
            case Scalar::i8:
                return bytes<std::int8_t>(what);
            case Scalar::u8:
                return bytes<std::uint8_t>(what);
            case Scalar::i16:
                return bytes<std::int16_t>(what);
            case Scalar::u16:
                return bytes<std::uint16_t>(what);
            case Scalar::i32:
                return bytes<std::int32_t>(what);
            case Scalar::u32:
                return bytes<std::uint32_t>(what);
            case Scalar::f32:
                return bytes<float>(what);
            case Scalar::f64:
                return bytes<double>(what);
        }
        throw std::logic_error("PLY type");
    }

    // Throws MeshError if anything except white space follows.
    void expect_end() {
        if (ascii_) {
            if (text_.next_line()) text_.fail_line("the file continues after the elements that its header declares");
        } else if (data_.find_first_not_of(" \t\r\n", position_) != data_.npos) {
            fail({0, 0, position_}, "the file continues after the elements that its header declares");
        }
    }

    [[noreturn]] void fail(const Place& place, const std::string& message) const {
        throw MeshError(at(name_, place) + message);
    }

private:
    template <class T>
    Value bytes(const std::string& what) {
        if (data_.size() - position_ < sizeof(T)) {
            fail({0, 0, data_.size()}, "the file ends; expected " + what);
        }
        std::array<char, sizeof(T)> raw;
        std::memcpy(raw.data(), data_.data() + position_, sizeof(T));
        if (swap_) std::reverse(raw.begin(), raw.end());
        const Value value{double(std::bit_cast<T>(raw)), {0, 0, position_}};
        position_ += sizeof(T);
        return value;
    }

    const std::string& name_;
    std::string_view data_;
    TextReader& text_;
    std::size_t position_;
    bool ascii_, swap_;
};

void read_vertex(Body& body, const Element& element, const std::string& what, FileMesh& mesh) {
    Eigen::Vector3d& point = mesh.points.emplace_back();
    for (const Property& property : element.properties) {
        const Value value = body.next(property.count.value_or(property.type), what);
        for (double i = 0; property.count && i < value.value; ++i) body.next(property.type, what);
        if (property.count || property.name.size() != 1 || property.name[0] < 'x' || property.name[0] > 'z') continue;
        if (!std::isfinite(value.value)) body.fail(value.place, "a coordinate is not a finite number");
        point[property.name[0] - 'x'] = value.value;
    }
}

bool is_corner_list(const Property& p) {
    return p.count && (p.name == "vertex_indices" || p.name == "vertex_index");
}

void read_face(Body& body, const Element& element, const std::string& what, FileMesh& mesh) {
    for (const Property& property : element.properties) {
        const Value count = body.next(property.count.value_or(property.type), what);
        if (!property.count) continue;
        const bool corners = is_corner_list(property);
        if (corners && count.value < 3) {
            body.fail(count.place, fmt::format("a face needs three vertices, this one has {}", count.value));
        }
        if (corners) mesh.faces.emplace_back();
        for (double i = 0; i < count.value; ++i) {
            const Value value = body.next(property.type, what);
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
            if (element.name == "vertex" && !p.count) coordinates += p.name == "x" || p.name == "y" || p.name == "z";
            if (element.name == "face" && is_corner_list(p)) {
                if (is_real(p.type)) reader.fail_line("the vertex indices of faces must have an integer type");
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
    for (const Element& element : header.elements) {
        const bool vertex = element.name == "vertex", face = element.name == "face";
        for (std::int64_t i = 0; i < element.count; ++i) {
            const std::string what = fmt::format("{} {} of {}", element.name, i, element.count);
            if (vertex) {
                read_vertex(body, element, what, mesh);
            } else if (face) {
                read_face(body, element, what, mesh);
            } else {
                for (const Property& property : element.properties) {
                    const Value value = body.next(property.count.value_or(property.type), what);
                    for (double j = 0; property.count && j < value.value; ++j) body.next(property.type, what);
                }
            }
        }
    }
    body.expect_end();
    return mesh;
}

}  // namespace tubule::surface3d
