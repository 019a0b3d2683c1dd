// What a scan is asked to do, as plain, validated data: docs/scans.md.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "common/case/case.hpp"
#include "common/case/text.hpp"
#include "tools/scan/outcome.hpp"
#include "tools/scan/plan.hpp"

namespace tubule {

// One direction of the grid: n settings, each of one key or, from a table, of several at once.
struct Axis {
    std::vector<std::string> keys;                 // as in --set, such as "shape.mode.0.amplitude"
    std::vector<std::vector<std::string>> values;  // [n][keys], TOML as it stands behind "key="
    bool logarithmic = false;                      // spaced so

    std::size_t size() const { return values.size(); }
    // Between a value and the next one, numbers both: `part` of the way, 0 to 1.
    double value(std::size_t at, double part) const;
};

// Where only the lines between outcomes are wanted: all of them, or those around one outcome.
struct BoundaryChoice {
    std::optional<Outcome> around;
    int seeds = 8;   // intervals of the coarse lattice, along each axis, on whose lines crossings are looked for
    int refine = 0;  // halvings of each edge of the grid that a line crosses
    bool operator==(const BoundaryChoice&) const = default;
};

struct Scan {
    std::string path, text;  // the scan file, verbatim; of a scan without one: the case's path, empty text
    std::string title;
    std::string case_path, case_text;  // verbatim
    CaseInputs inputs;                 // what its points read besides
    std::vector<std::string> sets;     // of all points
    std::vector<Axis> axes;            // points are numbered row by row, the last axis fastest
    std::optional<BoundaryChoice> boundary;
    bool to_the_end = false;  // run every point to its own end, even where its outcome is known before

    GridShape shape() const;
    std::size_t size() const { return count_points(shape()); }  // of the grid
    BetweenNumbers between() const;
    double value(const Between& between) const;                                                   // of the axis' key
    std::vector<std::size_t> place(std::size_t point) const { return place_on(shape(), point); }  // on each axis
    std::vector<std::string> sets_of(std::size_t point) const;  // also of points between those of the grid
    Case case_of(std::size_t point) const;                      // throws CaseError
    Case case_with(const std::vector<std::string>& all_sets) const;
};

// What the command line adds; it overrides the file.
struct ScanChoices {
    std::string file;               // a scan or a case
    std::vector<std::string> sets;  // key=value
    std::vector<std::string> over;  // key=a,b,c   key=lo:hi:n   key=lo:hi:n:log
    std::string points;             // a table
    std::string boundary;           // "outcome", or the name of one
    std::optional<int> seeds, refine;
    bool to_the_end = false;
};

// Adds what the points of a scan read besides the case, as it is now. Throws CaseError where that is another one than
// the scan has.
void add_inputs(Scan& scan);

// Throws CaseError if there are no points or too many, a key varies twice, or a value of an axis is not valid.
void check_scan(const Scan& scan);

// Reads and checks it all, every value of every axis on its own included. Throws CaseError.
Scan read_scan(const ScanChoices& choices);

// The same of a case at hand: `choices.file` and `choices.sets` are not looked at.
Scan scan_of(const Case& c, const ScanChoices& choices);

// "energy.k42=0:0.2:5" and so on as an axis. Throws CaseError.
Axis parse_axis(const std::string& over);

// A table of comma-separated values with a header of keys. Throws CaseError.
Axis parse_table(const std::string& text, const std::string& path);

}  // namespace tubule
