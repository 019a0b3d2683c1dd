// Records by name: what they hold, and the state of a run written to one and read back from one list of fields.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "common/result/result.hpp"

namespace tubule {

// What a run resumes from: a frame or the checkpoint of its result, with the cells of its mesh if it has one.
struct Restart {
    Record record;
    std::optional<SurfaceCells> cells = std::nullopt;
};

// The declared kind of a record. Older results declare none: there it follows from the arrays.
RecordKind kind_of(const Record& record);

const Array* find_array(const Record& record, std::string_view name);  // nullptr if there is none
std::optional<double> find_number(const Record& record, std::string_view name);

// A list [n]; a vector [n]; columns, one a node, [columns, rows].
Array array(const std::string& name, std::vector<double> values);
template <class Matrix>
Array array(const std::string& name, const Eigen::MatrixBase<Matrix>& values) {
    const typename Matrix::PlainObject plain = values;
    Array out{name, {static_cast<std::size_t>(plain.size())}, {plain.data(), plain.data() + plain.size()}};
    if (!Matrix::IsVectorAtCompileTime)
        out.shape = {static_cast<std::size_t>(plain.cols()), static_cast<std::size_t>(plain.rows())};
    return out;
}

// A record within another one, its names and its time after a prefix. nested() throws as RecordReader without a time.
void nest(Record& in, const std::string& prefix, Record inner);
Record nested(const Record& record, const std::string& prefix, RecordKind kind);

// A state that a run resumes from lists its fields once, as a template over `Fields`, which is RecordWriter or
// RecordReader (and State, which is const for the writer):
//     template <class Fields, class State>
//     void fields(Fields&& f, State& s) {
//         f.number("restart_step", s.step);
//         f.array("restart_u", s.u, s.X.cols());
//     }
class RecordWriter {
public:
    explicit RecordWriter(Record& record) : record_(record) {}

    template <class Number>
    void number(const std::string& name, const Number& value) {
        record_.numbers.emplace_back(name, static_cast<double>(value));
    }
    template <class Number>
    void optional_number(const std::string& name, const Number& value) {
        if (value != 0) number(name, value);
    }
    template <class Values>
    void array(const std::string& name, const Values& values, std::optional<Eigen::Index> = {}) {
        record_.arrays.push_back(tubule::array(name, values));
    }
    template <class Values>
    void optional_array(const std::string& name, const Values& values, std::optional<Eigen::Index> = {}) {
        array(name, values);
    }

private:
    Record& record_;
};

// Throws std::runtime_error that begins with "cannot resume from this frame" for a field that is missing, is not of the
// required type, or has another shape: vectors [n], fields [n, 3], where n must be `count` if that is given.
class RecordReader {
public:
    explicit RecordReader(const Record& record) : record_(record) {}
    // Refuses a record of another kind.
    RecordReader(const Record& record, RecordKind kind);

    template <class Number>
    void number(const std::string& name, Number& value) const {
        if constexpr (std::is_floating_point_v<Number>)
            value = number_of(name);
        else
            value = static_cast<Number>(integer_of(name));
    }
    // 0 where it is missing: such numbers are written unless they are 0.
    template <class Number>
    void optional_number(const std::string& name, Number& value) const {
        value = 0;
        if (find_number(record_, name)) number(name, value);
    }
    void array(const std::string& name, std::vector<double>& values, std::optional<Eigen::Index> count = {}) const;
    void array(const std::string& name, Eigen::VectorXd& values, std::optional<Eigen::Index> count = {}) const;
    void array(const std::string& name, Eigen::Matrix3Xd& values, std::optional<Eigen::Index> count = {}) const;
    // `count` rows, or none: fields that only some runs have are always written.
    template <class Values>
    void optional_array(const std::string& name, Values& values, std::optional<Eigen::Index> count = {}) const {
        const Array* found = find_array(record_, name);
        array(name, values, found && found->data.empty() ? std::optional<Eigen::Index>(0) : count);
    }

private:
    double number_of(const std::string& name) const;
    int integer_of(const std::string& name) const;
    // Rows have `width` numbers; 1 for a vector.
    const std::vector<double>& data_of(const std::string& name, std::optional<Eigen::Index> count,
                                       std::size_t width) const;

    const Record& record_;
};

}  // namespace tubule
