// The result of a scan, NAME.hdf: written as a whole (write aside, sync, rename) when 2 s or 50 times the cost of the
// last write have passed, so a kill loses no more points than that. Layout: docs/scans.md.
#pragma once

#include <filesystem>
#include <map>
#include <vector>

#include "common/result/file_writer.hpp"
#include "common/result/result.hpp"
#include "tools/scan/description.hpp"
#include "tools/scan/point.hpp"
#include "tools/scan/scan_plan.hpp"
#include "tools/scan/theory.hpp"

namespace tubule {

struct ScanResult {
    Scan scan;
    About about;
    std::vector<PointResult> points;          // of the whole grid, in order; Outcome::not_run where nothing is known
    std::map<std::size_t, PointResult> more;  // by number: between points of the grid, or where energies are equal

    std::vector<Outcome> outcomes() const;
    // A point of the grid or one of `more`, if it is known.
    const PointResult* known(std::size_t number) const;
};

// Its plan, with all that is known. The result must stay.
ScanPlan plan_of(const ScanResult& result);

// One writer a file. Throws std::runtime_error naming the file, for I/O errors, for a second writer, and for a file of
// that name that is no scan.
class ScanWriter {
public:
    // Begins anew, with the points of the grid that are known, if any: replaces whatever scan is there at the first
    // point that is added.
    static ScanWriter create(const std::filesystem::path& file, const Scan& scan, const About& about,
                             std::vector<PointResult> known = {});
    // Goes on with the points of an unfinished scan. Throws CaseError if the file belongs to another one.
    static ScanWriter resume(const std::filesystem::path& file, const Scan& scan);
    ~ScanWriter();

    const ScanResult& result() const { return result_; }
    bool complete() const;                 // of a resumed scan: nothing is left to do
    bool began() const { return began_; }  // there was a point, and the file is this writer's
    void point(const PointResult& p);
    // Writes the file. What `more` says replaces what /about said by the same names.
    void finish(const About& more);

private:
    ScanWriter(const std::filesystem::path& path, ScanResult result);
    void write(const std::vector<ThresholdMap>& thresholds = {});

    FileWriter file_;
    ScanResult result_;
    bool began_ = false;
    bool unwritten_ = false;  // the file lacks a point
};

// Whether the file is an HDF5 file with a scan in it. Never throws.
bool is_scan(const std::filesystem::path& file);

// Whether they have the same case, overrides, axes and choices, so that one may go on with the points of the other.
bool same_scan(const Scan& a, const Scan& b);
// The name of a file that both read, but with other contents; empty if there is none.
std::string other_input(const Scan& a, const Scan& b);
// Another scan may be needed: throws CaseError if the file has one that is not the same.
void refuse_to_replace_another_scan(const Scan& scan, const std::filesystem::path& file);

// Throws std::runtime_error naming the file.
ScanResult read_scan_result(const std::filesystem::path& file);

}  // namespace tubule
