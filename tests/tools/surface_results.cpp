// Writes results with curved surfaces for the tests of readers and pictures:
//
//   surface_results FOLDER
//
// closed_K.hdf and tube_K.hdf, K = 2, 3, 4: flat triangulations moved by a polynomial map of degree K, which
// elements of order K represent exactly (vtk_test.py knows the map). Two frames, the second one twice as large.
// mixed.hdf: two meshes, one after the other. shapes_*.hdf: known shapes with recovered curvatures, for pictures.
// growing_*.hdf: waves that grow at known rates, 1e-3 exp(0.5 t) for n, m = 1, 2 of a tube and l, m = 3, 1 of a sphere.
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "common/result/result.hpp"
#include "common/shapes/sphere.hpp"
#include "common/shapes/torus.hpp"
#include "common/shapes/tube.hpp"
#include "surface3d/curvature/bending_force.hpp"
#include "surface3d/curvature/curvature.hpp"
#include "surface3d/mesh/base_meshes.hpp"
#include "surface3d/mesh/mapped_mesh.hpp"

using namespace tubule;
using namespace tubule::surface3d;

namespace {

SurfaceCells cells_of(const CurvedMesh& mesh) {
    return {mesh.order, mesh.nodes.size(), mesh.cells, mesh.period, mesh.shifts};
}

// One row a node.
template <class Values>
Array array_of(const std::string& name, const Values& columns) {
    Array array{name, {static_cast<std::size_t>(columns.cols()), static_cast<std::size_t>(columns.rows())}, {}};
    if (columns.rows() == 1) array.shape.pop_back();
    for (Eigen::Index i = 0; i < columns.cols(); ++i)
        for (Eigen::Index j = 0; j < columns.rows(); ++j) array.data.push_back(columns(j, i));
    return array;
}

VectorField positions(const CurvedMesh& mesh) {
    VectorField x(3, mesh.size());
    for (int i = 0; i < mesh.size(); ++i) x.col(i) = mesh.nodes[i];
    return x;
}

// ---- exact polynomials

// Commutes with a shift in z.
Eigen::Vector3d polynomial_map(const Eigen::Vector3d& p, int degree) {
    const double x = p.x(), y = p.y();
    return {x + 0.3 * std::pow(y, degree), y - 0.2 * x * std::pow(y, degree - 1), p.z() + 0.1 * std::pow(x, degree)};
}
// On the flat triangles; of period 0.
double polynomial_value(const Eigen::Vector3d& p, int degree) {
    return std::pow(p.x(), degree) - 2 * p.x() * std::pow(p.y(), degree - 1) + p.y();
}

Record polynomial_frame(const TriangleMesh& base, int order, double time, std::size_t mesh) {
    const CurvedMesh flat = flat_mesh(base, order);
    const VectorField at = positions(flat);
    VectorField x(3, flat.size());
    Eigen::RowVectorXd value(flat.size());
    TensorField tensor(6, flat.size());
    for (int i = 0; i < flat.size(); ++i) {
        x.col(i) = (1 + time) * polynomial_map(flat.nodes[i], order);
        value[i] = polynomial_value(flat.nodes[i], order) + time;
        tensor.col(i) = value[i] * Eigen::Matrix<double, 6, 1>::LinSpaced(6, 1, 6);
    }
    return {time,
            {{"order", static_cast<double>(order)}},
            {array_of("points", x),
             array_of("flat", at),
             array_of("value", value),
             array_of("tensor", tensor),
             {"restart_state", {2}, {1, 2}}},
            mesh};
}

TriangleMesh twice(TriangleMesh base) {
    base.period *= 2;
    return base;
}

void write_polynomials(const std::filesystem::path& file, const std::vector<TriangleMesh>& bases, int order) {
    auto writer = ResultWriter::create(file, {"tier = \"surface3d\"\n", {}}, {}, {"time"});
    for (const TriangleMesh& base : bases)
        for (const double time : {0.0, 1.0}) {
            // A period grows with the tube.
            const TriangleMesh& scaled = time > 0 ? twice(base) : base;
            const std::size_t mesh = writer.mesh(cells_of(flat_mesh(scaled, order)));
            writer.frame(polynomial_frame(base, order, time, mesh));
        }
    writer.finish({});
}

// ---- shapes

template <class Shape>
Record shape_frame(const TriangleMesh& base, int order, const Shape& shape, double time, std::size_t mesh_number,
                   std::vector<double>& row) {
    const CurvedMesh mesh =
        mapped_mesh(base, order, [&](const Eigen::Vector3d& p) { return Eigen::Vector3d(position(shape, p)); });
    const SurfaceSpace space(mesh);
    const CurvatureField field = recover(space, mesh);
    const Observables o = observe(space, mesh, field, {.k = {1, 0, 0.1}, .H0 = 0});
    row = {time, o.energy_term[0] + o.energy_term[2], o.energy_term[0], o.energy_term[1], o.energy_term[2]};
    return {time,
            {{"area", o.area}, {"volume", o.volume}},
            {array_of("points", positions(mesh)), array_of("H", field.H.transpose()),
             array_of("K", field.K.transpose()), array_of("normal", field.normal), array_of("B", field.B)},
            mesh_number};
}

// One frame a shape, at times 0, 1, ...
template <class Shape>
void write_shapes(const std::filesystem::path& file, const std::string& title, const TriangleMesh& base, int order,
                  const std::vector<Shape>& shapes) {
    const std::string text = "tier = \"surface3d\"\n[about]\ntitle = \"" + title + "\"\n";
    auto writer = ResultWriter::create(file, {text, {}}, {}, {"time", "energy", "energy_20", "energy_40", "energy_42"});
    const std::size_t mesh = writer.mesh(cells_of(flat_mesh(base, order)));
    for (std::size_t i = 0; i < shapes.size(); ++i) {
        std::vector<double> row;
        const Record frame = shape_frame(base, order, shapes[i], static_cast<double>(i), mesh, row);
        writer.row(row);
        writer.frame(frame);
    }
    writer.finish({{"stop", "finished"}});
}

// ---- waves that grow

template <class Shape>
void write_growth(const std::filesystem::path& file, const TriangleMesh& base, const Shape& at_start,
                  double& (*wave)(Shape&)) {
    auto writer = ResultWriter::create(file, {"tier = \"surface3d\"\n", {}}, {}, {"time"});
    const std::size_t number = writer.mesh(cells_of(flat_mesh(base, 3)));
    for (int i = 0; i <= 8; ++i) {
        const double time = 0.25 * i;
        Shape shape = at_start;
        wave(shape) *= std::exp(0.5 * time);
        const CurvedMesh mesh =
            mapped_mesh(base, 3, [&](const Eigen::Vector3d& p) { return Eigen::Vector3d(position(shape, p)); });
        writer.frame({time, {}, {array_of("points", positions(mesh))}, number});
    }
    writer.finish({});
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 2) return 2;
    const std::filesystem::path folder = argv[1];
    const TriangleMesh ball = jittered(icosphere(2), 0.2, 1), tube = jittered(tube_rings(0.8, 2, 4, 6), 0.2, 2);
    for (const int order : {2, 3, 4}) {
        write_polynomials(folder / ("closed_" + std::to_string(order) + ".hdf"), {ball}, order);
        write_polynomials(folder / ("tube_" + std::to_string(order) + ".hdf"), {tube}, order);
    }
    write_polynomials(folder / "mixed.hdf", {tube, ball}, 3);

    const Torus torus{2, 1};
    write_shapes<Torus>(folder / "shapes_torus.hdf", "A torus", torus_grid(torus, 32, 16), 3, {torus});
    std::vector<Sphere> spheres;
    for (const double amplitude : {0.5, 0.3, 0.15, 0.05}) spheres.push_back({1, {{amplitude, 5, 3}}});
    write_shapes(folder / "shapes_sphere.hdf", "A perturbed sphere", icosphere(6), 3, spheres);
    std::vector<Tube> tubes;
    for (const double amplitude : {0.05, 0.1, 0.2, 0.3})
        tubes.push_back({0.5, 2, {{amplitude, 1, 0, 0}, {amplitude / 3, 1, 3, 1}}});
    write_shapes(folder / "shapes_tube.hdf", "A tube", tube_rings(0.5, 2, 16, 18), 4, tubes);
    write_growth<Tube>(folder / "growing_tube.hdf", tube_rings(0.8, 2, 12, 16), {0.8, 2, {{1e-3, 1, 2, 0.3}}},
                       [](Tube& tube) -> double& { return tube.modes[0].amplitude; });
    write_growth<Sphere>(folder / "growing_sphere.hdf", icosphere(5), {1.2, {{1e-3, 3, 1}}},
                         [](Sphere& sphere) -> double& { return sphere.modes[0].amplitude; });
}
