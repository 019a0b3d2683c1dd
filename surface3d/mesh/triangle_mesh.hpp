// A closed (or z-periodic) surface of flat triangles: what curved meshes are made from, and what files hold.
#pragma once

#include <fmt/format.h>

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

namespace tubule::surface3d {

// Such as "(0.1, 0, 1)".
inline std::string words_of_place(const Eigen::Vector3d& x, int digits = 4) {
    return fmt::format("({:.{}g}, {:.{}g}, {:.{}g})", x[0], digits, x[1], digits, x[2], digits);
}

struct TriangleMesh {
    std::vector<Eigen::Vector3d> points;
    std::vector<std::array<int, 3>> triangles;  // counter-clockwise seen from outside

    // Tubes: the length of a period in z, and by how many periods each triangle sees its corners moved.
    // 0 and empty on a closed surface.
    double period = 0;
    std::vector<std::array<int, 3>> shifts;

    Eigen::Vector3d corner(int triangle, int c) const {
        Eigen::Vector3d x = points[triangles[triangle][c]];
        if (period > 0) x.z() += period * shifts[triangle][c];
        return x;
    }
};

}  // namespace tubule::surface3d
