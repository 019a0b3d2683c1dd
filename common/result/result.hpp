// The result file NAME.hdf: one writer, one reader. Layout: docs/results.md.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "common/case/case_input.hpp"

namespace tubule {

struct Array {
    std::string name;
    std::vector<std::size_t> shape;  // row-major
    std::vector<double> data;
};

// The curved cells that frames share until a remesh (/meshes/000000): isoparametric Lagrange triangles, their nodes in
// VTK's order (surface3d/mesh/curved_mesh.hpp).
struct SurfaceCells {
    int order = 3;           // k, 1 to 4
    std::size_t nodes = 0;   // how many
    std::vector<int> cells;  // node numbers, nodes_per_cell() for each

    // Tubes: the length of a period in z, and for every entry of `cells` the number of periods by which the node is
    // moved as this cell sees it. 0 and empty on a closed surface.
    double period = 0;
    std::vector<int> shifts;

    std::size_t nodes_per_cell() const { return static_cast<std::size_t>((order + 1) * (order + 2) / 2); }
    std::size_t count() const { return cells.size() / nodes_per_cell(); }  // of cells
    bool operator==(const SurfaceCells&) const = default;
};

// What kind of state a record holds.
enum class RecordKind { graph, curve, equilibrium, surface };
std::string_view name(RecordKind kind);  // "graph", ...

// A frame (/frames/000123) or a restart record (/checkpoint): a time, named numbers (attributes), named arrays.
struct Record {
    double time = 0;
    std::vector<std::pair<std::string, double>> numbers;
    std::vector<Array> arrays;
    // The number of SurfaceCells of a curved surface. Then there must be an array "points" [nodes, 3], and arrays
    // [nodes], [nodes, 3] and [nodes, 6] are data of the nodes for VTK (except "restart_...").
    std::optional<std::size_t> mesh = std::nullopt;
    std::optional<RecordKind> kind = std::nullopt;  // kind_of() (record.hpp) knows that of older results
};

// Whether an array of a frame on this mesh is data of its nodes.
bool is_point_data(const Array& array, const SurfaceCells& mesh);

using Value = std::variant<std::int64_t, double, std::string>;
using About = std::vector<std::pair<std::string, Value>>;

struct CaseText {
    std::string text;               // verbatim
    std::vector<std::string> sets;  // overrides "key=value"
    CaseInputs inputs = {};         // what it reads besides
    std::string resolved = {};      // effective_toml(); results of earlier versions have none
};

// Writes a result as a whole (write aside, sync, rename): at the first row, at each checkpoint, and when 2 s or 50
// times the cost of the last write have passed. So a kill at any moment loses no more than that, and nothing is ever
// half written. Non-finite numbers and impossible names are refused with std::invalid_argument, I/O errors and a second
// writer of the same file with std::runtime_error naming the file; arguments that are refused leave nothing behind.
// What was in the file before stays until the first row: a run that fails at its start replaces nothing.
class ResultWriter {
public:
    // A new result. An old one of that name is replaced at the first row; a file that is not a result is kept
    // (std::runtime_error). `series` must contain "time".
    static ResultWriter create(const std::filesystem::path& file, const CaseText& c, const About& about,
                               const std::vector<std::string>& series);
    // Resumes a result from its newest restart record (checkpoint or last frame, whichever is later);
    // rows and frames later than that are dropped, meshes that only they needed, and what finish() had added to /about.
    // restart_record() gives it. Its case becomes `now`, if that is given.
    // Throws std::runtime_error if there is none, and whatever `check` throws of it, with the file as it was.
    static ResultWriter resume(
        const std::filesystem::path& file, const std::function<void(const Record&)>& check = [](const Record&) {},
        const std::optional<CaseText>& now = std::nullopt);
    ResultWriter(ResultWriter&&) noexcept;
    ResultWriter& operator=(ResultWriter&&) noexcept;
    ~ResultWriter();

    const Record& restart_record() const;      // of a resumed result
    bool began() const;                        // whether the file is, or will be, changed
    void row(std::span<const double> values);  // one value a series, in the order given to create
    // Gives the number by which later frames name these cells; that of an equal mesh if there is one.
    std::size_t mesh(const SurfaceCells& cells);
    void frame(const Record& frame);
    void checkpoint(const Record& state);  // replaces the one before
    void discard();                        // forgets all rows, meshes, frames and the checkpoint: the run begins again
    // Adds to /about; writes NAME.hdf, and the folder `view` if frames have meshes.
    void finish(const About& more);

private:
    struct Impl;
    explicit ResultWriter(std::unique_ptr<Impl>);
    std::unique_ptr<Impl> impl_;
};

struct Result {
    CaseText case_text;
    About about;
    std::vector<std::string> series_names;  // in order of writing
    std::map<std::string, std::vector<double>> series;
    std::vector<SurfaceCells> meshes;
    std::vector<Record> frames;
    std::optional<Record> checkpoint;
};

// Reads a result. Throws std::runtime_error naming the file when it is not a result.
Result read_result(const std::filesystem::path& file);

// The case alone, without rows and frames: quick for large results, too. Throws as read_result.
CaseText read_case_text(const std::filesystem::path& file);

// Looks for the parts without reading them; throws as read_result.
void require_result(const std::filesystem::path& file);

}  // namespace tubule
