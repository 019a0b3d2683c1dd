// A file of points (r, z, H0) of a profile, for starts of both tiers; it is deleted with this.
#pragma once

#include <fmt/format.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <functional>
#include <random>
#include <string>

namespace tubule::test {

class ProfilePoints {
public:
    // n + 1 rows; at(t) for t from 0 to 1 gives r, z and H0. A column of another name is ignored.
    ProfilePoints(int n, const std::function<std::array<double, 3>(double)>& at, const std::string& name = "H0")
        : path_(std::filesystem::temp_directory_path() / fmt::format("points_{}.csv", std::random_device()())) {
        std::ofstream file(path_);
        file << "r,z," << name << "\n";
        for (int i = 0; i <= n; ++i) {
            const auto [r, z, H0] = at(static_cast<double>(i) / n);
            file << fmt::format("{:.17g},{:.17g},{:.17g}\n", r, z, H0);
        }
    }
    ~ProfilePoints() { std::filesystem::remove(path_); }
    ProfilePoints(const ProfilePoints&) = delete;
    ProfilePoints& operator=(const ProfilePoints&) = delete;

    // As the table [shape] of a case, closely followed.
    std::string shape(const std::string& more = "") const {
        return fmt::format("[shape]\nkind = \"profile\"\npath = \"{}\"\ntolerance = 1e-8\nH0_tolerance = 1e-7\n{}",
                           path_.string(), more);
    }

private:
    std::filesystem::path path_;
};

}  // namespace tubule::test
