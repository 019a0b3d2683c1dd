// The tables of docs/curvature.md: errors of every recovery on exactly known surfaces.
//   surface3d_curvature_table SHAPE ORDER [JITTER]      SHAPE: dumbbell, ellipsoid, torus, perturbed
// One row a recovery and mesh: relative L2 errors of nu, H, K, grad H, grad K; relative errors of E20, E42, area,
// volume.
#include <cstdio>
#include <cstdlib>
#include <string>

#include "common/shapes/dumbbell.hpp"
#include "common/shapes/ellipsoid.hpp"
#include "common/shapes/torus.hpp"
#include "surface3d/base_meshes.hpp"
#include "surface3d/bending_force.hpp"
#include "tests/surface3d/errors.hpp"

using namespace tubule;
using namespace tubule::surface3d;

namespace {

struct Named {
    const char* name;
    Recovery recovery;
};
constexpr Named recoveries[] = {
    {"elementwise", Recovery::elementwise}, {"normal", Recovery::normal},           {"weak", Recovery::weak},
    {"lifted", Recovery::lifted},           {"patch_nodal", Recovery::patch_nodal}, {"patch", Recovery::patch}};

template <class Shape, class Base>
void print_table(const Shape& shape, int order, double jitter, Base&& base_of) {
    const auto map = map_of(shape);
    const TriangleMesh fine = base_of(24);
    const double exact[4] = {integrate_exactly(fine, map, [](const auto& p) { return p.H * p.H; }),
                             integrate_exactly(fine, map, [](const auto& p) { return p.K * p.K; }),
                             integrate_exactly(fine, map, [](const auto&) { return 1.0; }),
                             integrate_exactly(fine, map, [](const auto& p) { return p.x.dot(p.normal) / 3; })};
    std::printf("recovery,triangles,nodes,normal,H,K,grad_H,grad_K,E20,E42,area,volume\n");
    for (const auto& [name, recovery] : recoveries)
        for (int n : {4, 6, 8, 12, 16}) {
            const TriangleMesh base = jitter > 0 ? jittered(base_of(n), jitter, 1) : base_of(n);
            const CurvedMesh mesh = mapped_mesh(base, order, map);
            const SurfaceSpace space(mesh);
            const CurvatureField field = recover(space, mesh, recovery);
            const FieldErrors e = field_errors(base, mesh, field, map);
            const Observables o = observe(space, mesh, field, {.k = {1, 0, 1}, .H0 = 0});
            std::printf("%s,%d,%d,%.2e,%.2e,%.2e,%.2e,%.2e,%.1e,%.1e,%.1e,%.1e\n", name, mesh.triangles(), mesh.size(),
                        e.normal, e.H, e.K, e.grad_H, e.grad_K, o.energy_term[0] / exact[0] - 1,
                        o.energy_term[2] / exact[1] - 1, o.area / exact[2] - 1, o.volume / exact[3] - 1);
            std::fflush(stdout);
        }
}

}  // namespace

int main(int argc, char** argv) {
    const std::string shape = argc > 1 ? argv[1] : "";
    const int order = argc > 2 ? std::atoi(argv[2]) : 3;
    const double jitter = argc > 3 ? std::atof(argv[3]) : 0;
    const Torus torus{2, 1};
    const auto ball = [](int n) { return icosphere(n); };
    if (shape == "dumbbell")
        print_table(Dumbbell{}, order, jitter, ball);
    else if (shape == "ellipsoid")
        print_table(Ellipsoid{1, 1.2, 1.5}, order, jitter, ball);
    else if (shape == "perturbed")
        print_table(perturbed_sphere(), order, jitter, ball);
    else if (shape == "torus")
        print_table(torus, order, jitter, [&](int n) { return torus_grid(torus, 4 * n, 2 * n); });
    else
        return std::fprintf(stderr, "shape: dumbbell, ellipsoid, torus or perturbed\n"), 2;
}
