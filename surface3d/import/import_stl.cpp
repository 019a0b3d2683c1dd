#include <fmt/format.h>

#include <bit>
#include <cmath>

#include "surface3d/import/import_formats.hpp"

namespace tubule::surface3d {

namespace {

constexpr std::size_t stl_header = 84, stl_facet = 50;  // bytes; a facet is 12 floats and a 16-bit word

std::uint32_t little_u32(std::string_view data, std::size_t byte) {
    std::uint32_t value = 0;
    for (int i = 3; i >= 0; --i) value = value << 8 | std::uint8_t(data[byte + i]);
    return value;
}

void add_corner(FileMesh& mesh, const Eigen::Vector3d& point, const Place& place) {
    mesh.faces.back().push_back({std::int64_t(mesh.points.size()), place});
    mesh.points.push_back(point);
}

FileMesh read_binary(const std::string& name, std::string_view data) {
    FileMesh mesh;
    const std::size_t facets = little_u32(data, 80);
    for (std::size_t f = 0; f < facets; ++f) {
        const std::size_t begin = stl_header + stl_facet * f;
        mesh.faces.emplace_back();
        for (std::size_t corner = 1; corner <= 3; ++corner) {  // the normal comes first and is ignored
            Eigen::Vector3d point;
            for (std::size_t d = 0; d < 3; ++d) {
                const std::size_t byte = begin + 12 * corner + 4 * d;
                point[d] = std::bit_cast<float>(little_u32(data, byte));
                if (!std::isfinite(point[d])) refuse_at(name, {0, 0, byte}, "a coordinate is not a finite number");
            }
            add_corner(mesh, point, {0, 0, begin});
        }
    }
    return mesh;
}

void expect(TextReader& reader, std::string_view first, std::string_view second = {}) {
    const std::string phrase = second.empty() ? std::string(first) : fmt::format("{} {}", first, second);
    if (!reader.next_line()) reader.fail_end("'" + phrase + "'");
    const std::vector<Word>& words = reader.words();
    if (!is_keyword(words[0].text, first) ||
        (!second.empty() && (words.size() < 2 || !is_keyword(words[1].text, second)))) {
        reader.fail_line(fmt::format("expected '{}'", phrase));
    }
}

void read_facet(TextReader& reader, FileMesh& mesh) {
    mesh.faces.emplace_back();
    const Place place = reader.words()[0].place;
    expect(reader, "outer", "loop");
    for (int corner = 0; corner < 3; ++corner) {
        expect(reader, "vertex");
        if (reader.words().size() > 4) reader.fail(reader.words()[4], "a point has three coordinates");
        add_corner(mesh, reader.point(1), place);
    }
    expect(reader, "endloop");
    expect(reader, "endfacet");
}

FileMesh read_ascii(const std::string& name, std::string_view data) {
    TextReader reader(name, data, 0);
    FileMesh mesh;
    while (reader.next_line()) {  // a file may hold several solids, each a part of the surface
        if (!is_keyword(reader.words()[0].text, "solid")) reader.fail_line("expected 'solid'");
        while (true) {
            if (!reader.next_line()) reader.fail_end("'facet' or 'endsolid'");
            if (is_keyword(reader.words()[0].text, "endsolid")) break;
            if (!is_keyword(reader.words()[0].text, "facet")) reader.fail_line("expected 'facet' or 'endsolid'");
            read_facet(reader, mesh);
        }
    }
    return mesh;
}

}  // namespace

FileMesh read_stl(const std::string& name, std::string_view data) {
    // Binary files may begin with "solid" too, so the size decides first.
    const bool has_header = data.size() >= stl_header;
    const std::size_t facets = has_header ? little_u32(data, 80) : 0;
    if (has_header && data.size() == stl_header + stl_facet * facets) return read_binary(name, data);
    const std::size_t begin = std::min(data.find_first_not_of(" \t\r\n"), data.size());
    const bool text = is_keyword(data.substr(begin, 5), "solid") && data.substr(0, 1000).find('\0') == data.npos;
    if (text) return read_ascii(name, data);
    if (!has_header)
        refuse_at(name, {0, 0, data.size()},
                  "not an STL file: it neither begins with 'solid' nor has the 84-byte header of binary STL");
    refuse_at(name, {0, 0, 80},
              fmt::format("the header declares {} facets, which need {} bytes, but the file has {}", facets,
                          stl_header + stl_facet * facets, data.size()));
}

}  // namespace tubule::surface3d
