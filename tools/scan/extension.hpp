// Scans that grow: more values, more axes, points of another scan. docs/scans.md, "Scans that grow".
#pragma once

#include <string>
#include <vector>

#include "tools/scan/scan_file.hpp"

namespace tubule {

// A scan over more, with the points that are known of it. The values of `over` (as in --over) join those of the same
// keys, in order if all are increasing numbers, else behind them; other keys make another axis, the last, which
// contains the value that the scan has had for them. Throws CaseError where that value is unknown, and as check_scan.
ScanResult extended(const ScanResult& result, const std::vector<std::string>& over);

// All values of both scans on each axis, and their points. Keys that only one of them varies, or that their --set tell
// apart, make an axis. Throws CaseError where the scans differ in anything else, and as check_scan.
ScanResult merged(const ScanResult& a, const ScanResult& b);

// Those points of a finished scan that it would have without any that were known before: along boundaries, an extended
// scan knows more.
void drop_unwanted(ScanResult& result);

}  // namespace tubule
