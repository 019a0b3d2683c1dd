// Results as another program might have written them.
#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/result/frame_profile.hpp"
#include "common/result/hdf5_file.hpp"
#include "common/result/hdf5_objects.hpp"
#include "tests/studies/fuzz/targets.hpp"

namespace tubule::fuzz {

namespace {

// Takes bytes from the front of the input; zeros when it is used up.
class Draw {
public:
    explicit Draw(Input input) : rest_(input) {}
    bool empty() const { return rest_.empty(); }
    Input bytes(std::size_t n) {
        const Input taken = rest_.first(std::min(n, rest_.size()));
        rest_ = rest_.subspan(taken.size());
        return taken;
    }
    template <class T>
    T value() {
        T out{};
        const Input taken = bytes(sizeof(T));
        if (!taken.empty()) std::memcpy(&out, taken.data(), taken.size());
        return out;
    }
    std::size_t below(std::size_t n) { return value<std::uint16_t>() % n; }

private:
    Input rest_;
};

// A frame of every kind, two rows, a mesh of two triangles.
Contents sample() {
    Contents c;
    c.case_text = {"tier = \"axisym\"\n", {"energy.k20=1"}};
    c.about = {{"version", std::string("0")}, {"seed", std::int64_t{3}}, {"stop_time", 0.5}};
    c.series_names = {"time", "energy"};
    c.series = {{"time", {0, 0.5}}, {"energy", {2, 1}}};
    c.meshes = {{.order = 1, .nodes = 4, .cells = {0, 1, 2, 0, 2, 3}, .period = 0, .shifts = {}}};
    const Record graph{0,
                       {{"degree", 1}, {"length", 2}},
                       {{"knots", {4}, {0, 0, 1, 1}}, {"coefficients", {2}, {1, 1}}},
                       std::nullopt,
                       RecordKind::graph};
    const Record curve{
        0.5, {{"length", 0}}, {{"r", {3}, {0, 1, 0}}, {"z", {3}, {1, 0, -1}}}, std::nullopt, RecordKind::curve};
    const Record surface{0.5,
                         {{"area", 1}},
                         {{"points", {4, 3}, {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}}, {"H", {4}, {1, 2, 3, 4}}},
                         0,
                         RecordKind::surface};
    c.frames = {graph, curve, surface};
    c.checkpoint = curve;
    return c;
}

void look_at(const Contents& contents) {
    for (const Record& frame : contents.frames) {
        try {
            frame_curve(frame);
        } catch (const std::invalid_argument&) {  // what it documents
        }
    }
}

// ---- changes of an HDF5 file by HDF5 itself

struct Place {
    std::string object, attribute;  // of an object: no attribute
};

void add_attributes(hid_t object, const std::string& name, std::vector<Place>& places) {
    std::vector<std::string> attributes;
    const auto add = [](hid_t, const char* attribute, const H5A_info_t*, void* out) -> herr_t {
        static_cast<std::vector<std::string>*>(out)->emplace_back(attribute);
        return 0;
    };
    H5Aiterate2(object, H5_INDEX_NAME, H5_ITER_INC, nullptr, add, &attributes);
    for (const std::string& attribute : attributes) places.push_back({name, attribute});
}

void find_places(hid_t group, const std::string& path, std::vector<Place>& places) {
    for (const std::string& member : h5::member_names(group)) {
        const std::string name = path + "/" + member;
        places.push_back({name, ""});
        const hid_t opened = H5Oopen(group, member.c_str(), H5P_DEFAULT);
        if (opened < 0) continue;  // a link that leads nowhere
        const h5::Handle object(opened, H5Oclose, "open", member);
        add_attributes(object, name, places);
        if (H5Iget_type(object) == H5I_GROUP && places.size() < 200)  // links may lead in circles
            find_places(object, name, places);
    }
}

h5::Handle drawn_space(Draw& draw) {
    std::vector<std::size_t> shape(draw.below(4));
    for (std::size_t& extent : shape) extent = draw.below(9);
    return h5::space(shape);
}

void put_other_attribute(hid_t object, const std::string& name, Draw& draw) {
    H5Adelete(object, name.c_str());
    const std::vector<double> values(1024, draw.value<double>());
    switch (draw.below(5)) {
        case 0:
            return;
        case 1:
            return h5::put_attribute(object, name, values[0]);
        case 2:
            return h5::put_attribute(object, name, draw.value<std::int64_t>());
        case 3:
            return h5::put_attribute(object, name, std::string(draw.below(5), 'x'));
        default:
            return h5::put_attribute(object, name, H5T_NATIVE_DOUBLE, drawn_space(draw), values.data());
    }
}

void put_other_object(hid_t file, const std::string& name, const std::vector<Place>& places, Draw& draw) {
    const std::string other = places[draw.below(places.size())].object;
    H5Ldelete(file, name.c_str(), H5P_DEFAULT);
    const std::vector<double> values(1024, draw.value<double>());
    const char* text = "x";
    switch (draw.below(7)) {
        case 0:
            return;
        case 1:
            h5::make_group(file, name);
            return;
        case 2:
            h5::put_dataset(file, name, h5::text_type(), h5::scalar(), &text);
            return;
        case 3:
            H5Lcreate_soft(other.c_str(), file, name.c_str(), H5P_DEFAULT, H5P_DEFAULT);
            return;
        case 4:
            H5Lcreate_hard(file, other.c_str(), file, name.c_str(), H5P_DEFAULT, H5P_DEFAULT);
            return;
        case 5: {  // as large as it says, with nothing in it
            const auto layout = h5::property_list(H5P_DATASET_CREATE);
            const hsize_t chunk = 16, extent = draw.value<std::uint64_t>() >> draw.below(64);
            H5Pset_chunk(layout, 1, &chunk);
            const h5::Handle space(H5Screate_simple(1, &extent, nullptr), H5Sclose, "make", name);
            const hid_t made =
                H5Dcreate2(file, name.c_str(), H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, layout, H5P_DEFAULT);
            if (made >= 0) H5Dclose(made);
            return;
        }
        default:
            h5::put_dataset(file, name, H5T_NATIVE_DOUBLE, drawn_space(draw), values.data());
    }
}

// One number of a dataset.
void put_other_number(hid_t file, const std::string& name, Draw& draw) {
    Array array;
    try {
        array = h5::get_array(file, name);
    } catch (const std::runtime_error&) {  // no numbers
        return;
    }
    if (array.data.empty()) return;
    array.data[draw.below(array.data.size())] = draw.below(2) ? draw.value<double>() : draw.value<std::int8_t>();
    const h5::Handle dataset(H5Dopen2(file, name.c_str(), H5P_DEFAULT), H5Dclose, "open", name);
    H5Dwrite(dataset, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, array.data.data());
}

std::vector<std::byte> edited(std::vector<std::byte> image, Input input) {
    const h5::Quiet quiet;
    const auto access = h5::property_list(H5P_FILE_ACCESS);
    H5Pset_fapl_core(access, 1 << 16, false);
    H5Pset_file_image(access, image.data(), image.size());
    const h5::Handle file(H5Fopen("edited", H5F_ACC_RDWR, access), H5Fclose, "open", "the image");
    for (Draw draw(input); !draw.empty();) {
        std::vector<Place> places;
        add_attributes(file, "/", places);
        find_places(h5::open_group(file, "/"), "", places);
        if (places.empty()) break;
        const Place place = places[draw.below(places.size())];
        try {
            if (!place.attribute.empty()) {
                const h5::Handle object(H5Oopen(file, place.object.c_str(), H5P_DEFAULT), H5Oclose, "open", "it");
                put_other_attribute(object, place.attribute, draw);
            } else if (draw.below(2)) {
                put_other_object(file, place.object, places, draw);
            } else {
                put_other_number(file, place.object, draw);
            }
        } catch (const std::runtime_error&) {  // a change that HDF5 does not make
        }
    }
    return h5::bytes_of(file);
}

}  // namespace

// A result some parts of which another program has changed; the input says which, and to what. HDF5's own structures
// stay sound, since that library does not survive damage to them: checksums find it first.
void result_parts(Input input) {
    static const std::vector<std::byte> sound = hdf5_image(sample());
    try {
        look_at(read_hdf5(file_of(edited(sound, input), "hdf")));
    } catch (const std::runtime_error&) {
    }
}

std::vector<std::string> result_seeds() {
    std::vector<std::string> seeds{""};
    for (char place = 0; place < 60; ++place) seeds.push_back({place, 0, 1, 0, 5, 0, 64, 64, 64, 64, 64, 64, 64, 64});
    return seeds;
}

}  // namespace tubule::fuzz
