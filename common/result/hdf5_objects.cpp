#include "common/result/hdf5_objects.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include <new>
#include <stdexcept>

#include "common/result/checksums.hpp"
#include "common/result/durable_io.hpp"
#include "common/solve/memory.hpp"

namespace tubule::h5 {

namespace {

// HDF5's message for its last error: the innermost description.
std::string last_error() {
    std::string words;
    const auto visit = [](unsigned n, const H5E_error2_t* error, void* out) -> herr_t {
        if (n == 0 && error->desc) *static_cast<std::string*>(out) = error->desc;
        return 0;
    };
    H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, visit, &words);
    return words;
}

// For what HDF5 keeps of an open file, and so much more.
void require_room(std::size_t bytes) {
    constexpr std::size_t room = 16 << 20;
    if (!can_allocate(room + bytes)) throw std::bad_alloc();
}

// The names of `count` attributes or members; `order_of` and `name_of` are HDF5's functions for these.
template <class Order, class Name>
std::vector<std::string> names_in_order(hid_t group, hsize_t count, const Order& order_of, const Name& name_of) {
    const Handle how(H5Gget_create_plist(group), H5Pclose, "read", "properties of a group");
    unsigned order = 0;
    order_of(how, &order);
    const H5_index_t index = (order & H5P_CRT_ORDER_TRACKED) ? H5_INDEX_CRT_ORDER : H5_INDEX_NAME;
    std::vector<std::string> names;
    for (hsize_t i = 0; i < count; ++i) {
        const auto read = [&](char* into, std::size_t size) {
            return name_of(group, ".", index, H5_ITER_INC, i, into, size, H5P_DEFAULT);
        };
        const ssize_t length = read(nullptr, 0);
        require(length >= 0, "read", "a name");
        std::string& name = names.emplace_back(static_cast<std::size_t>(length), '\0');
        read(name.data(), name.size() + 1);
    }
    return names;
}

// A dataset to read, and its extent.
struct Opened {
    Handle dataset, extent;
    Opened(hid_t parent, const std::string& name)
        : dataset(H5Dopen2(parent, name.c_str(), H5P_DEFAULT), H5Dclose, "open dataset", name),
          extent(H5Dget_space(dataset), H5Sclose, "read", name) {}
    std::size_t size() const { return static_cast<std::size_t>(H5Sget_simple_extent_npoints(extent)); }
    void read(hid_t type, void* into, const std::string& name) const {
        require(H5Dread(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, into) >= 0, "read", name);
    }
};

// An attribute to read, and its extent.
struct Attribute {
    Handle attribute, extent;
    Attribute(hid_t object, const std::string& name)
        : attribute(H5Aopen(object, name.c_str(), H5P_DEFAULT), H5Aclose, "open attribute", name),
          extent(H5Aget_space(attribute), H5Sclose, "read attribute", name) {}
    void read(hid_t type, void* into, const std::string& name) const {
        require(H5Aread(attribute, type, into) >= 0, "read attribute", name);
    }
};

std::vector<const char*> pointers_to(const std::vector<std::string>& texts) {
    std::vector<const char*> out;
    for (const std::string& text : texts) out.push_back(text.c_str());
    return out;
}

// The texts of an attribute or a dataset, which HDF5 allocates.
template <class From>
std::vector<std::string> texts_in(hid_t parent, const std::string& name) {
    const From from(parent, name);
    std::vector<char*> data(static_cast<std::size_t>(H5Sget_simple_extent_npoints(from.extent)));
    if (data.empty()) return {};
    const auto type = text_type();
    from.read(type, data.data(), name);
    std::vector<std::string> texts;
    for (const char* text : data) texts.emplace_back(text ? text : "");
    H5Dvlen_reclaim(type, from.extent, H5P_DEFAULT, data.data());
    return texts;
}

}  // namespace

void require(bool done, std::string_view what, std::string_view name) {
    if (!done) throw std::runtime_error(fmt::format("HDF5 cannot {} {}: {}", what, name, last_error()));
}

Handle property_list(hid_t kind) {
    return {H5Pcreate(kind), H5Pclose, "make", "a property list"};
}

Handle text_type() {
    Handle type(H5Tcopy(H5T_C_S1), H5Tclose, "make", "a string type");
    H5Tset_size(type, H5T_VARIABLE);
    H5Tset_cset(type, H5T_CSET_UTF8);
    return type;
}

Handle scalar() {
    return {H5Screate(H5S_SCALAR), H5Sclose, "make", "a dataspace"};
}

Handle space(const std::vector<std::size_t>& shape) {
    if (shape.empty()) return scalar();
    const std::vector<hsize_t> extents(shape.begin(), shape.end());
    return {H5Screate_simple(static_cast<int>(extents.size()), extents.data(), nullptr), H5Sclose, "make",
            "a dataspace"};
}

// ---- writing

Handle make_image(std::size_t step) {
    require_room(step);
    const auto access = property_list(H5P_FILE_ACCESS);
    H5Pset_fapl_core(access, step, false);
    const char* name = "image of a tubule result";  // appears nowhere
    Handle image(H5Fcreate(name, H5F_ACC_TRUNC, H5P_DEFAULT, access), H5Fclose, "make", name);
    put_attribute(image, "schema", schema);
    return image;
}

std::vector<std::byte> bytes_of(hid_t image) {
    require(H5Fflush(image, H5F_SCOPE_LOCAL) >= 0, "flush", "a file in memory");
    const ssize_t size = H5Fget_file_image(image, nullptr, 0);
    require(size > 0, "measure", "a file in memory");
    std::vector<std::byte> bytes(static_cast<std::size_t>(size));
    require(H5Fget_file_image(image, bytes.data(), bytes.size()) == size, "copy", "a file in memory");
    return bytes;
}

void put_attribute(hid_t object, const std::string& name, hid_t type, hid_t extent, const void* data) {
    const Handle attribute(H5Acreate2(object, name.c_str(), type, extent, H5P_DEFAULT, H5P_DEFAULT), H5Aclose,
                           "make attribute", name);
    const bool empty = H5Sget_simple_extent_npoints(extent) == 0;
    require(empty || H5Awrite(attribute, type, data) >= 0, "write attribute", name);
}
void put_attribute(hid_t object, const std::string& name, const std::string& text) {
    const char* data = text.c_str();
    put_attribute(object, name, text_type(), scalar(), &data);
}
void put_attribute(hid_t object, const std::string& name, const std::vector<std::string>& texts) {
    put_attribute(object, name, text_type(), space({texts.size()}), pointers_to(texts).data());
}

Handle put_dataset(hid_t parent, const std::string& name, hid_t type, hid_t extent, const void* data) {
    const auto how = property_list(H5P_DATASET_CREATE);
    H5Pset_obj_track_times(how, false);  // equal contents give equal bytes
    Handle dataset(H5Dcreate2(parent, name.c_str(), type, extent, H5P_DEFAULT, how, H5P_DEFAULT), H5Dclose, "make",
                   name);
    const bool empty = H5Sget_simple_extent_npoints(extent) == 0;
    require(empty || H5Dwrite(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) >= 0, "write", name);
    return dataset;
}

Handle put_dataset(hid_t parent, const std::string& name, const std::string& text) {
    const char* data = text.c_str();
    return put_dataset(parent, name, text_type(), scalar(), &data);
}

Handle put_dataset(hid_t parent, const std::string& name, const std::vector<std::string>& texts,
                   const std::vector<std::size_t>& shape) {
    return put_dataset(parent, name, text_type(), space(shape), pointers_to(texts).data());
}

Handle make_group(hid_t parent, const std::string& name) {
    const auto how = property_list(H5P_GROUP_CREATE);
    H5Pset_obj_track_times(how, false);
    H5Pset_link_creation_order(how, H5P_CRT_ORDER_TRACKED | H5P_CRT_ORDER_INDEXED);
    H5Pset_attr_creation_order(how, H5P_CRT_ORDER_TRACKED | H5P_CRT_ORDER_INDEXED);
    // Many attributes in the object's header, rather than in a heap and a tree of several kilobytes a frame.
    H5Pset_attr_phase_change(how, 256, 0);
    return {H5Gcreate2(parent, name.c_str(), H5P_DEFAULT, how, H5P_DEFAULT), H5Gclose, "make", name};
}

void put_inputs(hid_t file, const CaseInputs& inputs) {
    if (inputs.empty()) return;
    const auto group = make_group(file, "inputs");
    for (std::size_t i = 0; i < inputs.size(); ++i) {
        const CaseInput& input = *inputs[i];
        const auto data =
            put_dataset(group, std::to_string(i), H5T_NATIVE_UINT8, space({input.bytes.size()}), input.bytes.data());
        put_attribute(data, "name", input.name);
        put_attribute(data, "size", input.size);
        put_attribute(data, "crc32", std::uint64_t{input.crc});
    }
}

// ---- reading

namespace {

// What lies in another file may be anything, and anybody's; and a few bytes can announce more values than memory holds.
void require_own_values(hid_t dataset, const std::string& name) {
    const Handle how(H5Dget_create_plist(dataset), H5Pclose, "read", name),
        type(H5Dget_type(dataset), H5Tclose, "read", name), extent(H5Dget_space(dataset), H5Sclose, "read", name);
    if (H5Pget_external_count(how) > 0 || H5Pget_layout(how) == H5D_VIRTUAL)
        throw std::runtime_error(fmt::format("the values of /{} are in another file: not read", name));
    constexpr double best_compression = 1032;  // of deflate
    const double values = static_cast<double>(H5Sget_simple_extent_npoints(extent)),
                 stored = static_cast<double>(H5Dget_storage_size(dataset));
    if (values * static_cast<double>(H5Tget_size(type)) > stored * (H5Pget_nfilters(how) > 0 ? best_compression : 1))
        throw std::runtime_error(
            fmt::format("/{} has {} values, and not all are in the file: it is damaged", name, values));
}

// All groups but /VTKHDF, whose virtual datasets point into the file itself, and which is not read here.
void require_all_values(hid_t file) {
    struct Found {
        std::string elsewhere;
        std::vector<std::string> objects;
    } found;
    const auto look = [](hid_t, const char* name, const H5L_info_t* link, void* out) -> herr_t {
        Found& found = *static_cast<Found*>(out);
        if (link->type >= H5L_TYPE_UD_MIN) found.elsewhere = name;
        if (link->type == H5L_TYPE_HARD && !std::string_view(name).starts_with("VTKHDF")) found.objects.push_back(name);
        return found.elsewhere.empty() ? 0 : 1;
    };
    require(H5Lvisit(file, H5_INDEX_NAME, H5_ITER_NATIVE, look, &found) >= 0, "read", "its links");
    if (!found.elsewhere.empty())
        throw std::runtime_error(fmt::format("/{} is a link to another file: not followed", found.elsewhere));
    for (const std::string& name : found.objects) {
        const Handle object(H5Oopen(file, name.c_str(), H5P_DEFAULT), H5Oclose, "open", name);
        if (H5Iget_type(object) == H5I_DATASET) require_own_values(object, name);
    }
}

// Results of version 0.1 have none.
void require_schema(hid_t file) {
    if (H5Aexists(file, "schema") <= 0) return;
    const auto found = get_number<std::int64_t>(file, "schema");
    if (found > schema)
        throw std::runtime_error(fmt::format(
            "was written by a later version of tubule, with schema {}; this version reads 1 to {}", found, schema));
}

}  // namespace

Handle open_file(const std::filesystem::path& file) {
    if (file.extension() == ".toml")
        throw std::runtime_error(fmt::format(
            "is a case file, not a result: run it first (tubule run {}; tubule scan for a scan), then give its result, "
            "{}",
            file.string(), std::filesystem::path(file).filename().replace_extension(".hdf").string()));
    require_room(0);
    while (true) {
        const durable::File looked_at(file, O_RDONLY);
        const bool has_checksums = require_whole(looked_at.descriptor(), file);
        if (!has_checksums && H5Fis_hdf5(file.c_str()) <= 0)
            throw std::runtime_error(
                "is no result of tubule, but not even HDF5: give a file NAME.hdf that tubule wrote");
        const auto access = property_list(H5P_FILE_ACCESS);
        // A result never changes in place, so there is nothing to lock against; and on some file systems locks fail.
        H5Pset_file_locking(access, false, true);
        Handle opened(H5Fopen(file.c_str(), H5F_ACC_RDONLY, access), H5Fclose, "open", "it");
        // It may have been replaced between the two.
        struct stat checked {
        }, named{};
        ::fstat(looked_at.descriptor(), &checked);
        if (::stat(file.c_str(), &named) != 0 || named.st_ino != checked.st_ino || named.st_dev != checked.st_dev)
            continue;
        if (!has_checksums) require_all_values(opened);
        require_schema(opened);
        return opened;
    }
}

bool has(hid_t parent, const std::string& name) {
    return H5Lexists(parent, name.c_str(), H5P_DEFAULT) > 0;
}

Handle open_group(hid_t parent, const std::string& name) {
    return {H5Gopen2(parent, name.c_str(), H5P_DEFAULT), H5Gclose, "open", name};
}

void read_number(hid_t object, const std::string& name, hid_t type, void* into) {
    const Attribute opened(object, name);
    require(H5Sget_simple_extent_npoints(opened.extent) == 1, "read as one value attribute", name);
    opened.read(type, into, name);
}

std::vector<std::string> get_texts(hid_t object, const std::string& name) {
    return texts_in<Attribute>(object, name);
}

std::string get_text(hid_t object, const std::string& name) {
    const std::vector<std::string> texts = get_texts(object, name);
    require(texts.size() == 1, "read as one value attribute", name);
    return texts.front();
}

Value get_value(hid_t object, const std::string& name) {
    const Handle type(H5Aget_type(Attribute(object, name).attribute), H5Tclose, "read attribute", name);
    switch (H5Tget_class(type)) {
        case H5T_INTEGER:
            return get_number<std::int64_t>(object, name);
        case H5T_FLOAT:
            return get_number<double>(object, name);
        default:
            return get_text(object, name);
    }
}

std::vector<std::string> attribute_names(hid_t group) {
    H5O_info_t info;
    require(H5Oget_info2(group, &info, H5O_INFO_NUM_ATTRS) >= 0, "read", "a group");
    return names_in_order(group, info.num_attrs, H5Pget_attr_creation_order, H5Aget_name_by_idx);
}

std::vector<std::string> member_names(hid_t group) {
    H5G_info_t info;
    require(H5Gget_info(group, &info) >= 0, "read", "a group");
    return names_in_order(group, info.nlinks, H5Pget_link_creation_order, H5Lget_name_by_idx);
}

Array get_array(hid_t parent, const std::string& name) {
    const Opened opened(parent, name);
    std::vector<hsize_t> extents(static_cast<std::size_t>(H5Sget_simple_extent_ndims(opened.extent)));
    H5Sget_simple_extent_dims(opened.extent, extents.data(), nullptr);
    Array array{name, {extents.begin(), extents.end()}, std::vector<double>(opened.size())};
    opened.read(H5T_NATIVE_DOUBLE, array.data.data(), name);
    return array;
}

std::vector<std::int64_t> get_integers(hid_t parent, const std::string& name) {
    const Opened opened(parent, name);
    std::vector<std::int64_t> values(opened.size());
    opened.read(H5T_NATIVE_INT64, values.data(), name);
    return values;
}

std::vector<std::string> get_text_array(hid_t parent, const std::string& name) {
    return texts_in<Opened>(parent, name);
}

std::string get_text_dataset(hid_t parent, const std::string& name) {
    const std::vector<std::string> texts = get_text_array(parent, name);
    require(texts.size() == 1, "read as one string", name);
    return texts.front();
}

CaseInputs get_inputs(hid_t file) {
    if (!has(file, "inputs")) return {};
    const auto group = open_group(file, "inputs");
    CaseInputs out;
    for (const std::string& name : member_names(group)) {
        const Opened opened(group, name);
        CaseInput input;
        input.bytes.resize(opened.size());
        opened.read(H5T_NATIVE_UINT8, input.bytes.data(), name);
        input.name = get_text(opened.dataset, "name");
        input.size = get_number<std::uint64_t>(opened.dataset, "size");
        input.crc = static_cast<std::uint32_t>(get_number<std::uint64_t>(opened.dataset, "crc32"));
        out.push_back(std::make_shared<const CaseInput>(std::move(input)));
    }
    return out;
}

}  // namespace tubule::h5
