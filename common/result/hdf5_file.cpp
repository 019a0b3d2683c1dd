#include "common/result/hdf5_file.hpp"

#include <fmt/format.h>
#include <hdf5.h>

#include <algorithm>
#include <cerrno>
#include <mutex>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "common/result/durable_io.hpp"

namespace tubule {

namespace {

std::mutex library;  // HDF5 may be built without thread safety

// HDF5 prints its errors unless told not to; ours go into exceptions.
class Quiet {
public:
    Quiet() {
        H5Eget_auto2(H5E_DEFAULT, &print_, &data_);
        H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
    }
    Quiet(const Quiet&) = delete;
    Quiet& operator=(const Quiet&) = delete;
    ~Quiet() { H5Eset_auto2(H5E_DEFAULT, print_, data_); }

private:
    H5E_auto2_t print_ = nullptr;
    void* data_ = nullptr;
};

// HDF5's own word on its last error: the innermost description.
std::string last_error() {
    std::string words;
    const auto visit = [](unsigned n, const H5E_error2_t* error, void* out) -> herr_t {
        if (n == 0 && error->desc) *static_cast<std::string*>(out) = error->desc;
        return 0;
    };
    H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, visit, &words);
    return words;
}

void require(bool done, std::string_view what, std::string_view name) {
    if (!done) throw std::runtime_error(fmt::format("HDF5 cannot {} {}: {}", what, name, last_error()));
}

class Handle {
public:
    Handle(hid_t id, herr_t (*close)(hid_t), std::string_view what, std::string_view name) : id_(id), close_(close) {
        require(id >= 0, what, name);
    }
    Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}
    Handle(const Handle&) = delete;
    Handle& operator=(const Handle&) = delete;
    ~Handle() {
        if (id_ >= 0) close_(id_);
    }
    operator hid_t() const { return id_; }

private:
    hid_t id_;
    herr_t (*close_)(hid_t);
};

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

void put_attribute(hid_t object, const std::string& name, hid_t type, hid_t extent, const void* data) {
    const Handle attribute(H5Acreate2(object, name.c_str(), type, extent, H5P_DEFAULT, H5P_DEFAULT), H5Aclose,
                           "make attribute", name);
    const bool empty = H5Sget_simple_extent_npoints(extent) == 0;
    require(empty || H5Awrite(attribute, type, data) >= 0, "write attribute", name);
}
void put_attribute(hid_t object, const std::string& name, double value) {
    put_attribute(object, name, H5T_NATIVE_DOUBLE, scalar(), &value);
}
void put_attribute(hid_t object, const std::string& name, std::int64_t value) {
    put_attribute(object, name, H5T_NATIVE_INT64, scalar(), &value);
}
void put_attribute(hid_t object, const std::string& name, std::uint64_t value) {
    put_attribute(object, name, H5T_NATIVE_UINT64, scalar(), &value);
}
void put_attribute(hid_t object, const std::string& name, const std::string& text) {
    const char* data = text.c_str();
    put_attribute(object, name, text_type(), scalar(), &data);
}
void put_attribute(hid_t object, const std::string& name, const std::vector<std::string>& texts) {
    std::vector<const char*> data;
    for (const std::string& text : texts) data.push_back(text.c_str());
    put_attribute(object, name, text_type(), space({texts.size()}), data.data());
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

// A group that remembers the order in which its attributes and members were made.
Handle make_group(hid_t parent, const std::string& name) {
    const auto how = property_list(H5P_GROUP_CREATE);
    H5Pset_obj_track_times(how, false);
    H5Pset_link_creation_order(how, H5P_CRT_ORDER_TRACKED | H5P_CRT_ORDER_INDEXED);
    H5Pset_attr_creation_order(how, H5P_CRT_ORDER_TRACKED | H5P_CRT_ORDER_INDEXED);
    // Many attributes in the object's header, rather than in a heap and a tree of several kilobytes a frame.
    H5Pset_attr_phase_change(how, 256, 0);
    return {H5Gcreate2(parent, name.c_str(), H5P_DEFAULT, how, H5P_DEFAULT), H5Gclose, "make", name};
}

void put_record(hid_t parent, const std::string& name, const Record& record) {
    const auto group = make_group(parent, name);
    put_attribute(group, "time", record.time);
    for (const auto& [key, value] : record.numbers) put_attribute(group, key, value);
    for (const Array& array : record.arrays)
        put_dataset(group, array.name, H5T_NATIVE_DOUBLE, space(array.shape), array.data.data());
}

void put_series(hid_t file, const Contents& contents) {
    const auto group = make_group(file, "series");
    put_attribute(group, "order", contents.series);
    const std::size_t width = contents.series.size();
    std::vector<double> column(contents.rows.size() / width);
    for (std::size_t j = 0; j < width; ++j) {
        for (std::size_t i = 0; i < column.size(); ++i) column[i] = contents.rows[i * width + j];
        put_dataset(group, contents.series[j], H5T_NATIVE_DOUBLE, space({column.size()}), column.data());
    }
}

std::size_t size_estimate(const Contents& contents) {
    std::size_t doubles = contents.rows.size();
    for (const Record& frame : contents.frames)
        for (const Array& array : frame.arrays) doubles += array.data.size();
    return doubles * sizeof(double) + contents.frames.size() * 4096;
}

// ---- reading

bool has(hid_t parent, const std::string& name) {
    return H5Lexists(parent, name.c_str(), H5P_DEFAULT) > 0;
}

Handle open_group(hid_t parent, const std::string& name) {
    return {H5Gopen2(parent, name.c_str(), H5P_DEFAULT), H5Gclose, "open", name};
}

// In the order of writing, where the group knows it (a copy made by another program may not).
H5_index_t attribute_index(hid_t group) {
    const Handle how(H5Gget_create_plist(group), H5Pclose, "read", "properties of a group");
    unsigned order = 0;
    H5Pget_attr_creation_order(how, &order);
    return (order & H5P_CRT_ORDER_TRACKED) ? H5_INDEX_CRT_ORDER : H5_INDEX_NAME;
}
H5_index_t member_index(hid_t group) {
    const Handle how(H5Gget_create_plist(group), H5Pclose, "read", "properties of a group");
    unsigned order = 0;
    H5Pget_link_creation_order(how, &order);
    return (order & H5P_CRT_ORDER_TRACKED) ? H5_INDEX_CRT_ORDER : H5_INDEX_NAME;
}

// name(buffer, size) fills a buffer and returns the length, as HDF5's functions do.
template <class Name>
std::string name_of(const Name& name) {
    const ssize_t length = name(nullptr, 0);
    require(length >= 0, "read", "a name");
    std::string text(static_cast<std::size_t>(length), '\0');
    name(text.data(), text.size() + 1);
    return text;
}

Handle open_attribute(hid_t object, const std::string& name) {
    return {H5Aopen(object, name.c_str(), H5P_DEFAULT), H5Aclose, "open attribute", name};
}

template <class T>
T get_attribute(hid_t attribute, hid_t type, std::string_view name) {
    const Handle extent(H5Aget_space(attribute), H5Sclose, "read attribute", name);
    require(H5Sget_simple_extent_npoints(extent) == 1, "read as one value attribute", name);
    T value{};
    require(H5Aread(attribute, type, &value) >= 0, "read attribute", name);
    return value;
}

std::vector<std::string> get_texts(hid_t attribute, std::string_view name) {
    const Handle extent(H5Aget_space(attribute), H5Sclose, "read attribute", name);
    std::vector<char*> data(static_cast<std::size_t>(H5Sget_simple_extent_npoints(extent)));
    if (data.empty()) return {};
    const auto type = text_type();
    require(H5Aread(attribute, type, data.data()) >= 0, "read attribute", name);
    std::vector<std::string> texts;
    for (const char* text : data) texts.emplace_back(text ? text : "");
    H5Dvlen_reclaim(type, extent, H5P_DEFAULT, data.data());
    return texts;
}

Value get_value(hid_t attribute, std::string_view name) {
    const Handle type(H5Aget_type(attribute), H5Tclose, "read attribute", name);
    switch (H5Tget_class(type)) {
        case H5T_INTEGER:
            return get_attribute<std::int64_t>(attribute, H5T_NATIVE_INT64, name);
        case H5T_FLOAT:
            return get_attribute<double>(attribute, H5T_NATIVE_DOUBLE, name);
        default:
            break;
    }
    const auto texts = get_texts(attribute, name);
    require(texts.size() == 1, "read as one value attribute", name);
    return texts.front();
}

// Calls visit(attribute, name) for each attribute of a group.
template <class Visit>
void for_each_attribute(hid_t group, const Visit& visit) {
    H5O_info_t info;
    require(H5Oget_info2(group, &info, H5O_INFO_NUM_ATTRS) >= 0, "read", "a group");
    const H5_index_t index = attribute_index(group);
    for (hsize_t i = 0; i < info.num_attrs; ++i) {
        const Handle attribute(H5Aopen_by_idx(group, ".", index, H5_ITER_INC, i, H5P_DEFAULT, H5P_DEFAULT), H5Aclose,
                               "open attribute", std::to_string(i));
        visit(attribute, name_of([&](char* into, std::size_t n) { return H5Aget_name(attribute, n, into); }));
    }
}

Array get_array(hid_t parent, const std::string& name) {
    Array array;
    array.name = name;
    const Handle dataset(H5Dopen2(parent, name.c_str(), H5P_DEFAULT), H5Dclose, "open dataset", name);
    const Handle extent(H5Dget_space(dataset), H5Sclose, "read", name);
    std::vector<hsize_t> extents(static_cast<std::size_t>(H5Sget_simple_extent_ndims(extent)));
    H5Sget_simple_extent_dims(extent, extents.data(), nullptr);
    array.shape.assign(extents.begin(), extents.end());
    array.data.resize(static_cast<std::size_t>(H5Sget_simple_extent_npoints(extent)));
    require(H5Dread(dataset, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, array.data.data()) >= 0, "read", name);
    return array;
}

Record get_record(hid_t parent, const std::string& name) {
    Record record;
    const auto group = open_group(parent, name);
    for_each_attribute(group, [&](hid_t attribute, const std::string& key) {
        const double value = get_attribute<double>(attribute, H5T_NATIVE_DOUBLE, key);
        if (key == "time")
            record.time = value;
        else
            record.numbers.emplace_back(key, value);
    });
    H5G_info_t info;
    require(H5Gget_info(group, &info) >= 0, "read", name);
    const H5_index_t index = member_index(group);
    for (hsize_t i = 0; i < info.nlinks; ++i)
        record.arrays.push_back(get_array(group, name_of([&](char* into, std::size_t n) {
                                              return H5Lget_name_by_idx(group, ".", index, H5_ITER_INC, i, into, n,
                                                                        H5P_DEFAULT);
                                          })));
    return record;
}

std::string get_case_text(hid_t dataset) {
    const Handle extent(H5Dget_space(dataset), H5Sclose, "read", "case");
    require(H5Sget_simple_extent_npoints(extent) == 1, "read as one string", "case");
    const auto type = text_type();
    char* data = nullptr;
    require(H5Dread(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, &data) >= 0, "read", "case");
    std::string text = data ? data : "";
    H5Dvlen_reclaim(type, extent, H5P_DEFAULT, &data);
    return text;
}

void get_series(hid_t file, Contents& contents) {
    const auto group = open_group(file, "series");
    contents.series = get_texts(open_attribute(group, "order"), "order");
    const std::size_t width = contents.series.size();
    for (std::size_t j = 0; j < width; ++j) {
        const auto column = get_array(group, contents.series[j]).data;
        if (j == 0) contents.rows.resize(column.size() * width);
        if (column.size() * width != contents.rows.size())
            throw std::runtime_error(
                fmt::format("series {} and {} differ in length", contents.series[0], contents.series[j]));
        for (std::size_t i = 0; i < column.size(); ++i) contents.rows[i * width + j] = column[i];
    }
}

void require_parts(hid_t file) {
    for (const char* part : {"case", "about", "series", "frames"})
        if (!has(file, part)) throw std::runtime_error(fmt::format("no Tubule result: it lacks /{}", part));
    for (const char* part : {"id", "sequence", "about_begun"})
        if (H5Aexists(file, part) <= 0)
            throw std::runtime_error(fmt::format("no Tubule result: it lacks the attribute {}", part));
}

Contents get_contents(hid_t file) {
    Contents contents;
    contents.id = get_attribute<std::uint64_t>(open_attribute(file, "id"), H5T_NATIVE_UINT64, "id");
    contents.sequence = get_attribute<std::uint64_t>(open_attribute(file, "sequence"), H5T_NATIVE_UINT64, "sequence");
    contents.about_begun =
        get_attribute<std::uint64_t>(open_attribute(file, "about_begun"), H5T_NATIVE_UINT64, "about_begun");
    const Handle text(H5Dopen2(file, "case", H5P_DEFAULT), H5Dclose, "open", "case");
    contents.case_text = {get_case_text(text), get_texts(open_attribute(text, "set"), "set")};
    for_each_attribute(open_group(file, "about"), [&](hid_t attribute, const std::string& name) {
        contents.about.emplace_back(name, get_value(attribute, name));
    });
    get_series(file, contents);
    const auto frames = open_group(file, "frames");
    H5G_info_t info;
    require(H5Gget_info(frames, &info) >= 0, "read", "frames");
    for (hsize_t i = 0; i < info.nlinks; ++i) contents.frames.push_back(get_record(frames, fmt::format("{:06}", i)));
    if (has(file, "checkpoint")) contents.checkpoint = get_record(file, "checkpoint");
    return contents;
}

// Opens a result and returns read(its handle).
template <class Read>
auto with_result(const std::filesystem::path& file, const Read& read) {
    const std::lock_guard lock(library);
    const Quiet quiet;
    std::error_code error;
    const auto status = std::filesystem::status(file, error);
    if (!std::filesystem::exists(status)) durable::fail("open", file, error ? error.value() : ENOENT);
    if (!std::filesystem::is_regular_file(status))
        throw std::runtime_error(fmt::format("{}: not a regular file", file.string()));
    try {
        const auto access = property_list(H5P_FILE_ACCESS);
        // A result never changes in place, so there is nothing to lock against; and on some file systems locks fail.
        H5Pset_file_locking(access, false, true);
        const Handle opened(H5Fopen(file.c_str(), H5F_ACC_RDONLY, access), H5Fclose, "open", "it");
        require_parts(opened);
        return read(opened);
    } catch (const std::runtime_error& e) {
        throw std::runtime_error(fmt::format("{}: {}", file.string(), e.what()));
    }
}

}  // namespace

std::vector<std::byte> hdf5_image(const Contents& contents) {
    const std::lock_guard lock(library);
    const Quiet quiet;
    const auto access = property_list(H5P_FILE_ACCESS);
    // In memory, growing by as much as all of it should take, so that it is moved seldom.
    H5Pset_fapl_core(access, std::max<std::size_t>(size_estimate(contents), 1 << 16), false);
    const char* name = "image of a tubule result";  // appears nowhere
    const Handle file(H5Fcreate(name, H5F_ACC_TRUNC, H5P_DEFAULT, access), H5Fclose, "make", name);

    put_attribute(file, "id", contents.id);
    put_attribute(file, "sequence", contents.sequence);
    put_attribute(file, "about_begun", contents.about_begun);
    const char* text = contents.case_text.text.c_str();
    put_attribute(put_dataset(file, "case", text_type(), scalar(), &text), "set", contents.case_text.sets);
    const auto about = make_group(file, "about");
    for (const auto& [key, value] : contents.about)
        std::visit([&, &key = key](const auto& v) { put_attribute(about, key, v); }, value);
    put_series(file, contents);
    const auto frames = make_group(file, "frames");
    for (std::size_t i = 0; i < contents.frames.size(); ++i)
        put_record(frames, fmt::format("{:06}", i), contents.frames[i]);
    if (contents.checkpoint) put_record(file, "checkpoint", *contents.checkpoint);

    require(H5Fflush(file, H5F_SCOPE_LOCAL) >= 0, "flush", name);
    const ssize_t size = H5Fget_file_image(file, nullptr, 0);
    require(size > 0, "measure", name);
    std::vector<std::byte> image(static_cast<std::size_t>(size));
    require(H5Fget_file_image(file, image.data(), image.size()) == size, "copy", name);
    return image;
}

Contents read_hdf5(const std::filesystem::path& file) {
    return with_result(file, get_contents);
}

void require_result(const std::filesystem::path& file) {
    with_result(file, [](hid_t) {});
}

}  // namespace tubule
