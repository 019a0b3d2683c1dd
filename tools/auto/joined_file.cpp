#include "tools/auto/joined_file.hpp"

#include <algorithm>

#include "axisym/run_profile.hpp"
#include "surface3d/run/run_surface.hpp"

namespace tubule {

namespace {

const std::string tier_name = "tier";

bool has(const std::vector<std::string>& names, const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
}

// An axisymmetric motion has none of these.
bool vanishes_by_symmetry(const std::string& name) {
    for (const char* one : {"momentum_x", "momentum_y", "angular_momentum_x", "angular_momentum_y"})
        if (name == one) return true;
    return false;
}

}  // namespace

std::vector<std::string> joined_series_names(const Problem& c, bool begins_axisymmetric) {
    std::vector<std::string> names = surface3d::series_names(c.of_surface());
    if (begins_axisymmetric) {
        const auto first = axisym::series_names(c.of_profile(c.time.end, {}));
        std::erase_if(names, [&](const std::string& name) {
            return !has(first, name) && !(vanishes_by_symmetry(name) && has(first, "momentum_z"));
        });
    }
    names.push_back(tier_name);
    return names;
}

RowMap::RowMap(const std::vector<std::string>& file, const std::vector<std::string>& own, int tier) : tier_(tier) {
    for (const std::string& name : file) {
        const auto found = std::find(own.begin(), own.end(), name);
        source_.push_back(name == tier_name    ? tier_number
                          : found == own.end() ? zero
                                               : static_cast<int>(found - own.begin()));
    }
}

std::vector<double> RowMap::operator()(std::span<const double> row) const {
    std::vector<double> out;
    for (const int source : source_) out.push_back(source == tier_number ? tier_ : source == zero ? 0 : row[source]);
    return out;
}

Before axisymmetric_part(const Result& unfinished) {
    Before out;
    const std::vector<double>& tier = unfinished.series.at(tier_name);
    for (std::size_t i = 0; i < tier.size() && tier[i] == 1; ++i) {
        std::vector<double>& row = out.rows.emplace_back();
        for (const std::string& name : unfinished.series_names) row.push_back(unfinished.series.at(name)[i]);
    }
    for (const Record& frame : unfinished.frames)
        if (!frame.mesh) out.frames.push_back(frame);
    return out;
}

void SurfacePart::discard() {
    TierPart::discard();
    for (const std::vector<double>& row : before_.rows) PassingOn::row(row);
    for (const Record& frame : before_.frames) TierPart::frame([&] { return frame; });
}

}  // namespace tubule
