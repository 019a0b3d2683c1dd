// Handles, attributes, datasets and groups of the HDF5 library, with errors as exceptions: for the files of this folder
// that write and read HDF5. All throw std::runtime_error with HDF5's message.
#pragma once

#include <hdf5.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/result/result.hpp"

namespace tubule::h5 {

// Turns off HDF5's printing of errors; they go into exceptions.
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

void require(bool done, std::string_view what, std::string_view name);

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

Handle property_list(hid_t kind);
Handle text_type();
Handle scalar();
Handle space(const std::vector<std::size_t>& shape);

// The type of a number in memory.
inline hid_t native(double) {
    return H5T_NATIVE_DOUBLE;
}
inline hid_t native(std::int64_t) {
    return H5T_NATIVE_INT64;
}
inline hid_t native(std::uint64_t) {
    return H5T_NATIVE_UINT64;
}
inline hid_t native(std::int8_t) {
    return H5T_NATIVE_INT8;
}
inline hid_t native(std::uint8_t) {
    return H5T_NATIVE_UINT8;
}

// ---- writing

// Which layout a file has, as an attribute: raised when a program that reads the former one would misread it.
constexpr std::int64_t schema = 2;

// A file in memory, growing in steps of `step` bytes, and its bytes in the end.
Handle make_image(std::size_t step);
std::vector<std::byte> bytes_of(hid_t image);

void put_attribute(hid_t object, const std::string& name, hid_t type, hid_t extent, const void* data);
template <class Number>
void put_attribute(hid_t object, const std::string& name, Number value) {
    put_attribute(object, name, native(value), scalar(), &value);
}
void put_attribute(hid_t object, const std::string& name, const std::string& text);
void put_attribute(hid_t object, const std::string& name, const std::vector<std::string>& texts);

Handle put_dataset(hid_t parent, const std::string& name, hid_t type, hid_t extent, const void* data);
Handle put_dataset(hid_t parent, const std::string& name, const std::string& text);
Handle put_dataset(hid_t parent, const std::string& name, const std::vector<std::string>& texts,
                   const std::vector<std::size_t>& shape);
template <class Number>
Handle put_dataset(hid_t parent, const std::string& name, const std::vector<Number>& values,
                   const std::vector<std::size_t>& shape) {
    return put_dataset(parent, name, native(Number{}), space(shape), values.data());
}
// A list.
template <class T>
Handle put_dataset(hid_t parent, const std::string& name, const std::vector<T>& values) {
    return put_dataset(parent, name, values, {values.size()});
}

// A group that remembers the order in which its attributes and members were made.
Handle make_group(hid_t parent, const std::string& name);

// As /inputs, if there are any.
void put_inputs(hid_t file, const CaseInputs& inputs);

// ---- reading

// Opens a file whose checksums are right (checksums.hpp), or that has none. Throws if it is damaged, if another
// program has made it such that values are not in it, or if its schema is a later one.
Handle open_file(const std::filesystem::path& file);

bool has(hid_t parent, const std::string& name);
Handle open_group(hid_t parent, const std::string& name);

// Attributes.
void read_number(hid_t object, const std::string& name, hid_t type, void* into);
template <class Number>
Number get_number(hid_t object, const std::string& name) {
    Number value{};
    read_number(object, name, native(value), &value);
    return value;
}
std::vector<std::string> get_texts(hid_t object, const std::string& name);
std::string get_text(hid_t object, const std::string& name);
Value get_value(hid_t object, const std::string& name);

// In the order of writing, where the group knows it (a copy made by another program may not).
std::vector<std::string> attribute_names(hid_t group);
std::vector<std::string> member_names(hid_t group);

Array get_array(hid_t parent, const std::string& name);
std::vector<std::int64_t> get_integers(hid_t parent, const std::string& name);
std::vector<std::string> get_text_array(hid_t parent, const std::string& name);
std::string get_text_dataset(hid_t parent, const std::string& name);  // of one
CaseInputs get_inputs(hid_t file);

}  // namespace tubule::h5
