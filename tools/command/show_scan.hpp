// What `tubule show` prints of a scan.
#pragma once

#include <filesystem>
#include <string>

namespace tubule {

std::string scan_summary(const std::filesystem::path& file);
std::string scan_csv(const std::filesystem::path& file);
std::string scan_json(const std::filesystem::path& file);

}  // namespace tubule
