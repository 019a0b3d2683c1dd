#include "common/result/vtk_grid.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <stdexcept>
#include <utility>

#include "common/result/hdf5_objects.hpp"

namespace tubule {

using namespace h5;

namespace {

constexpr std::uint8_t lagrange_triangle = 69;  // VTK_LAGRANGE_TRIANGLE

// The header of every VTKHDF group. VTK requires a string of fixed length.
void put_format(hid_t group, std::array<std::int64_t, 2> version) {
    put_attribute(group, "Version", H5T_NATIVE_INT64, space({2}), version.data());
    const std::string type = "UnstructuredGrid";
    const Handle fixed(H5Tcopy(H5T_C_S1), H5Tclose, "make", "a string type");
    H5Tset_size(fixed, type.size());
    H5Tset_strpad(fixed, H5T_STR_NULLPAD);
    put_attribute(group, "Type", fixed, scalar(), type.data());
}

// Rows of nodes become rows of points, and back.
Array at_points(const Array& array, const VtkPoints& points) {
    Array out{array.name, array.shape, array.data};
    const std::size_t width = array.data.size() / array.shape[0];
    out.shape[0] = points.node.size();
    out.data.reserve(width * points.node.size());
    for (std::size_t p = array.shape[0]; p < points.node.size(); ++p) {
        const auto row = array.data.begin() + points.node[p] * static_cast<std::ptrdiff_t>(width);
        out.data.insert(out.data.end(), row, row + static_cast<std::ptrdiff_t>(width));
    }
    return out;
}
Array at_nodes(Array array, const std::string& name, std::size_t nodes) {
    if (array.shape.empty() || array.shape[0] < nodes)
        throw std::runtime_error(fmt::format("{} has fewer rows than its mesh has nodes", array.name));
    if (array.shape[0] > 0) array.data.resize(array.data.size() / array.shape[0] * nodes);
    array.shape[0] = nodes;
    array.name = name;
    return array;
}

Array points_of(const Array& nodes, const WrittenMesh& written) {
    Array out = at_points(nodes, written.points);
    for (std::size_t p = nodes.shape[0]; p < out.shape[0]; ++p)
        out.data[3 * p + 2] += written.mesh.period * static_cast<double>(written.points.shift[p]);
    return out;
}

}  // namespace

VtkPoints vtk_points(const SurfaceCells& mesh) {
    VtkPoints points;
    for (std::size_t node = 0; node < mesh.nodes; ++node) points.node.push_back(static_cast<std::int64_t>(node));
    points.shift.assign(mesh.nodes, 0);
    points.connectivity.assign(mesh.cells.begin(), mesh.cells.end());
    std::map<std::pair<int, int>, std::int64_t> moved;  // (node, shift): point
    for (std::size_t i = 0; i < mesh.shifts.size(); ++i) {
        if (mesh.shifts[i] == 0) continue;
        const auto [at, is_new] = moved.try_emplace({mesh.cells[i], mesh.shifts[i]}, points.node.size());
        if (is_new) {
            points.node.push_back(mesh.cells[i]);
            points.shift.push_back(mesh.shifts[i]);
        }
        points.connectivity[i] = at->second;
    }
    return points;
}

std::vector<WrittenMesh> put_meshes(hid_t file, const std::vector<SurfaceCells>& meshes,
                                    const std::function<bool(std::size_t)>& needed) {
    std::vector<WrittenMesh> written;
    if (meshes.empty()) return written;
    const auto parent = make_group(file, "meshes");
    for (const SurfaceCells& mesh : meshes) {
        const std::string name = fmt::format("{:06}", written.size());
        VtkPoints points = vtk_points(mesh);
        if (!needed(written.size())) {
            written.push_back({mesh, std::move(points), ""});
            continue;
        }
        const std::size_t cells = mesh.count();
        const auto group = make_group(parent, name);
        put_attribute(group, "order", std::int64_t{mesh.order});
        put_attribute(group, "nodes", static_cast<std::int64_t>(mesh.nodes));
        put_attribute(group, "period", mesh.period);
        put_dataset(group, "NumberOfPoints", std::vector{static_cast<std::int64_t>(points.node.size())});
        put_dataset(group, "NumberOfCells", std::vector{static_cast<std::int64_t>(cells)});
        put_dataset(group, "NumberOfConnectivityIds", std::vector{static_cast<std::int64_t>(mesh.cells.size())});
        put_dataset(group, "Connectivity", points.connectivity);
        std::vector<std::int64_t> offsets;
        for (std::size_t c = 0; c <= cells; ++c)
            offsets.push_back(static_cast<std::int64_t>(c * mesh.nodes_per_cell()));
        put_dataset(group, "Offsets", offsets);
        put_dataset(group, "Types", std::vector<std::uint8_t>(cells, lagrange_triangle));
        if (mesh.period > 0) {
            put_dataset(group, "point_node", points.node);
            put_dataset(group, "point_shift", points.shift);
        }
        written.push_back({mesh, std::move(points), "/meshes/" + name});
    }
    return written;
}

SurfaceCells get_mesh(hid_t meshes, const std::string& name) {
    const auto group = open_group(meshes, name);
    SurfaceCells mesh;
    mesh.order = static_cast<int>(get_number<std::int64_t>(group, "order"));
    mesh.nodes = static_cast<std::size_t>(get_number<std::int64_t>(group, "nodes"));
    mesh.period = get_number<double>(group, "period");
    if (mesh.order < 1 || mesh.order > 4)
        throw std::runtime_error(fmt::format("mesh {}: its order is {}, not 1 to 4", name, mesh.order));
    const bool tube = mesh.period > 0;
    std::vector<std::int64_t> node, shift;
    if (tube) node = get_integers(group, "point_node"), shift = get_integers(group, "point_shift");
    const std::size_t points = tube ? std::min(node.size(), shift.size()) : mesh.nodes;
    for (const std::int64_t point : get_integers(group, "Connectivity")) {
        const auto p = static_cast<std::size_t>(point);
        if (p >= points)
            throw std::runtime_error(
                fmt::format("mesh {}: a cell uses point {}, but there are {}", name, point, points));
        mesh.cells.push_back(static_cast<int>(tube ? node[p] : point));
        if (tube) mesh.shifts.push_back(static_cast<int>(shift[p]));
    }
    return mesh;
}

void put_grid(hid_t group, const Record& record, const WrittenMesh& written) {
    put_format(group, {1, 0});
    put_attribute(group, "mesh", static_cast<std::int64_t>(*record.mesh));
    std::vector<std::string> names;
    for (const Array& array : record.arrays) names.push_back(array.name);
    put_attribute(group, "arrays", names);
    for (const char* part :
         {"NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds", "Connectivity", "Offsets", "Types"}) {
        const std::string target = written.path + "/" + part;
        require(H5Lcreate_hard(group, target.c_str(), group, part, H5P_DEFAULT, H5P_DEFAULT) >= 0, "link", target);
    }
    const auto data = make_group(group, "PointData");
    const auto put_one = [&](const Array& array) {
        if (array.name == "points") {
            const Array points = points_of(array, written);
            return put_dataset(group, "Points", points.data, points.shape);
        }
        if (!is_point_data(array, written.mesh)) return put_dataset(group, array.name, array.data, array.shape);
        const Array values = at_points(array, written.points);
        return put_dataset(data, values.name, values.data, values.shape);
    };
    // The numbers of the nodes come first, whatever points follow.
    for (const Array& array : record.arrays) put_one(array);
}

std::vector<Array> get_grid_arrays(hid_t group, const SurfaceCells& mesh) {
    std::vector<Array> arrays;
    const auto data = open_group(group, "PointData");
    for (const std::string& name : get_texts(group, "arrays")) {
        if (name == "points")
            arrays.push_back(at_nodes(get_array(group, "Points"), name, mesh.nodes));
        else if (has(data, name))
            arrays.push_back(at_nodes(get_array(data, name), name, mesh.nodes));
        else
            arrays.push_back(get_array(group, name));
    }
    return arrays;
}

// ---- /VTKHDF

namespace {

struct Part {
    std::string path;
    std::size_t rows;
    std::string file = ".";  // this one
};

// A dataset that shows others, one below the other; width 0 for lists.
void put_virtual(hid_t parent, const std::string& name, hid_t type, std::size_t width, const std::vector<Part>& parts) {
    const auto shape = [&](std::size_t rows) {
        return width > 0 ? std::vector<std::size_t>{rows, width} : std::vector<std::size_t>{rows};
    };
    std::size_t rows = 0;
    for (const Part& part : parts) rows += part.rows;
    const auto whole = space(shape(rows));
    const auto how = property_list(H5P_DATASET_CREATE);
    H5Pset_obj_track_times(how, false);
    std::size_t begin = 0;
    for (const Part& part : parts) {
        const std::array<hsize_t, 2> start{begin, 0}, count{part.rows, width};
        const auto source = space(shape(part.rows));
        const bool done =
            H5Sselect_hyperslab(whole, H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr) >= 0 &&
            H5Pset_virtual(how, whole, part.file.c_str(), part.path.c_str(), source) >= 0;
        require(done, "show", part.path);
        begin += part.rows;
    }
    H5Sselect_all(whole);
    const Handle made(H5Dcreate2(parent, name.c_str(), type, whole, H5P_DEFAULT, how, H5P_DEFAULT), H5Dclose, "make",
                      name);
}

// A frame that has a mesh.
struct Step {
    const Record& record;
    const WrittenMesh& written;
    std::string path, file;
    std::size_t points() const { return written.points.node.size(); }
};

// Where a frame is, for virtual datasets.
std::string file_of(const std::vector<Segment>& segments, std::size_t frame) {
    const auto found = std::ranges::find_if(segments, [&](const Segment& segment) { return frame < segment.end; });
    return found == segments.end() ? "." : found->file;
}

// Numbers of columns (0: a list) of the point data that all steps have alike: VTK reads no others over time.
std::map<std::string, std::size_t> common_point_data(const std::vector<Step>& steps) {
    std::map<std::string, std::size_t> common;
    for (const Step& step : steps) {
        std::map<std::string, std::size_t> here;
        for (const Array& array : step.record.arrays)
            if (is_point_data(array, step.written.mesh)) here[array.name] = array.shape.size() > 1 ? array.shape[1] : 0;
        if (&step == &steps.front()) common = here;
        std::erase_if(common, [&](const auto& entry) {
            const auto same = here.find(entry.first);
            return same == here.end() || same->second != entry.second;
        });
    }
    return common;
}

void put_numbers(hid_t group, const std::vector<WrittenMesh>& meshes) {
    std::vector<std::int64_t> points, cells, ids;
    std::vector<Part> connectivity, offsets, types;
    for (const WrittenMesh& written : meshes) {
        const std::size_t count = written.mesh.count();
        points.push_back(static_cast<std::int64_t>(written.points.node.size()));
        cells.push_back(static_cast<std::int64_t>(count));
        ids.push_back(static_cast<std::int64_t>(written.mesh.cells.size()));
        connectivity.push_back({written.path + "/Connectivity", written.mesh.cells.size()});
        offsets.push_back({written.path + "/Offsets", count + 1});
        types.push_back({written.path + "/Types", count});
    }
    put_dataset(group, "NumberOfPoints", points);
    put_dataset(group, "NumberOfCells", cells);
    put_dataset(group, "NumberOfConnectivityIds", ids);
    put_virtual(group, "Connectivity", H5T_NATIVE_INT64, 0, connectivity);
    put_virtual(group, "Offsets", H5T_NATIVE_INT64, 0, offsets);
    put_virtual(group, "Types", H5T_NATIVE_UINT8, 0, types);
}

}  // namespace

void put_steps(hid_t file, const Contents& contents, const std::vector<WrittenMesh>& meshes) {
    std::vector<Step> steps;
    for (std::size_t i = 0; i < contents.frames.size(); ++i)
        if (const Record& frame = contents.frames[i]; frame.mesh)
            steps.push_back(
                {frame, meshes[*frame.mesh], fmt::format("/frames/{:06}", i), file_of(contents.segments, i)});
    if (steps.empty()) return;

    const auto group = make_group(file, "VTKHDF");
    put_format(group, {2, 0});
    put_numbers(group, meshes);
    std::vector<Part> points;
    for (const Step& step : steps) points.push_back({step.path + "/Points", step.points(), step.file});
    put_virtual(group, "Points", H5T_NATIVE_DOUBLE, 3, points);
    const auto common = common_point_data(steps);
    const auto data = make_group(group, "PointData");
    for (const auto& [name, width] : common) {
        std::vector<Part> parts;
        for (const Step& step : steps) parts.push_back({step.path + "/PointData/" + name, step.points(), step.file});
        put_virtual(data, name, H5T_NATIVE_DOUBLE, width, parts);
    }

    // Every mesh is a part of its own; a step is one part, and many steps may show the same.
    std::vector<double> times;
    std::vector<std::int64_t> part, first_point, first_cell, first_id;
    std::int64_t point = 0;
    for (const Step& step : steps) {
        std::int64_t cell = 0, id = 0;
        for (std::size_t m = 0; m < *step.record.mesh; ++m) {
            cell += static_cast<std::int64_t>(meshes[m].mesh.count());
            id += static_cast<std::int64_t>(meshes[m].mesh.cells.size());
        }
        times.push_back(step.record.time);
        part.push_back(static_cast<std::int64_t>(*step.record.mesh));
        first_point.push_back(point);
        first_cell.push_back(cell);
        first_id.push_back(id);
        point += static_cast<std::int64_t>(step.points());
    }
    const auto listing = make_group(group, "Steps");
    put_attribute(listing, "NSteps", static_cast<std::int64_t>(steps.size()));
    put_dataset(listing, "Values", times);
    put_dataset(listing, "NumberOfParts", std::vector<std::int64_t>(steps.size(), 1));
    put_dataset(listing, "PartOffsets", part);
    put_dataset(listing, "PointOffsets", first_point);
    put_dataset(listing, "CellOffsets", first_cell, {steps.size(), 1});
    put_dataset(listing, "ConnectivityIdOffsets", first_id, {steps.size(), 1});
    const auto offsets = make_group(listing, "PointDataOffsets");
    for (const auto& [name, width] : common) put_dataset(offsets, name, first_point);
}

}  // namespace tubule
