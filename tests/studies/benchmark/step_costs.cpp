// Prints a table for the chart docs/step_costs_surface3d.svg: what a step of the scene of motion_benchmark takes with
// each measure that makes its linear system cheap, and without. `tools/figures step-costs-surface3d`.
//   step_costs [solvers|lagged|threads]     one part of it
// Milliseconds, the least of several repeats: of CPU time on one thread, but for `threads`, which is wall time and
// wants a quiet machine. Run it with OPENBLAS_NUM_THREADS=1.
#include <fmt/core.h>
#include <omp.h>
#include <umfpack.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "common/solve/gmres.hpp"
#include "common/solve/sparse_ldlt.hpp"
#include "tests/studies/benchmark/motion_scene.hpp"

namespace tubule::surface3d {
namespace {

using Matrix = Eigen::SparseMatrix<double>;
using Vector = Eigen::VectorXd;

// As BorderedSolver has them.
constexpr double regularisation = 1e-5, tolerance = 1e-11;
constexpr int most_iterations = 60;

double cpu_milliseconds() {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

double wall_milliseconds() {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double least(int repeats, const std::function<double()>& clock, const std::function<void()>& work) {
    double out = std::numeric_limits<double>::infinity();
    for (int i = 0; i < repeats; ++i) {
        const double begin = clock();
        work();
        out = std::min(out, clock() - begin);
    }
    return out;
}

struct Row {
    std::string measure;
    double whole = 0, analysis = 0, factors = 0;  // the whole, and what of it is analysis and numeric factors
    double iterations = 0;                        // of GMRES
    double fill = 0, residual = 0;                // entries in the factors; |b - A x|/|b|
    std::string clock = "cpu";
    int threads = 1;
};

// Elements of order k on 20 n^2 triangles.
struct Size {
    int k, n;
};

void print(const std::string& part, Size size, const Row& r) {
    fmt::print("{},{},{},\"{}\",{},{},{:.2f},{:.2f},{:.2f},{:.2f},{:.0f},{:.1e}\n", part, size.k, 20 * size.n * size.n,
               r.measure, r.clock, r.threads, r.whole, r.analysis, r.factors, r.iterations, r.fill, r.residual);
    std::fflush(stdout);
}

// GMRES with given factors; iterations.
template <class Scalar>
int iterate(Gmres& gmres, const SparseLdlt<Scalar>& factors, const Matrix& A, const Vector& b, Vector& x) {
    factors.solve(b, x);
    return gmres
        .solve([&](const Vector& u, Vector& v) { v.noalias() = A * u; },
               [&](const Vector& u, Vector& v) { factors.solve(u, v); }, b, x, tolerance, most_iterations)
        .iterations;
}

double residual(const Matrix& A, const Vector& x, const Vector& b) {
    return (b - A * x).norm() / b.norm();
}

// UMFPACK as it comes: it chooses its strategy and an ordering of minimum degree.
Row umfpack_alone(const Matrix& A, const Vector& b, int repeats) {
    const int n = static_cast<int>(A.cols());
    const int *columns = A.outerIndexPtr(), *rows = A.innerIndexPtr();
    double control[UMFPACK_CONTROL], info[UMFPACK_INFO];
    umfpack_di_defaults(control);
    control[UMFPACK_IRSTEP] = 1;
    void *symbolic = nullptr, *numeric = nullptr;
    umfpack_di_symbolic(n, n, columns, rows, A.valuePtr(), &symbolic, control, info);
    Vector x(n);
    Row out{"UMFPACK, its own ordering"};
    out.factors = least(repeats, cpu_milliseconds, [&] {
        umfpack_di_free_numeric(&numeric);
        umfpack_di_numeric(columns, rows, A.valuePtr(), symbolic, &numeric, control, info);
    });
    out.fill = info[UMFPACK_LNZ] + info[UMFPACK_UNZ];
    out.whole =
        out.factors + least(repeats, cpu_milliseconds, [&] {
            umfpack_di_solve(UMFPACK_A, columns, rows, A.valuePtr(), x.data(), b.data(), numeric, control, info);
        });
    umfpack_di_free_numeric(&numeric);
    umfpack_di_free_symbolic(&symbolic);
    out.residual = residual(A, x, b);
    return out;
}

Row umfpack(const std::string& name, const Ordering& ordering, const Matrix& A, const Vector& b, int repeats) {
    SparseLuLarge lu(ordering);
    lu.factor(A);
    Vector x;
    Row out{name};
    out.factors = least(repeats, cpu_milliseconds, [&] { lu.factor(A); });
    out.whole = out.factors + least(repeats, cpu_milliseconds, [&] { x = lu.solve(b, 1); });
    out.fill = static_cast<double>(lu.counters().fill);
    out.residual = residual(A, x, b);
    return out;
}

template <class Scalar>
Row ldlt(const std::string& name, const Ordering& ordering, const Matrix& A, const Vector& b, int repeats) {
    SparseLdlt<Scalar> factors(ordering, regularisation);
    Gmres gmres(static_cast<int>(b.size()));
    Vector x;
    Row out{name};
    factors.factor(A);
    out.factors = least(repeats, cpu_milliseconds, [&] { factors.factor(A); });
    out.whole =
        out.factors + least(repeats, cpu_milliseconds, [&] { out.iterations = iterate(gmres, factors, A, b, x); });
    out.fill = static_cast<double>(factors.counters().fill);
    out.residual = residual(A, x, b);
    return out;
}

// The order and the symbolic analysis found in every step.
Row analysed_anew(const std::string& name, const Matrix& A, const std::vector<int>& node_of_unknown, const Row& once,
                  int repeats) {
    const double anew = least(repeats, cpu_milliseconds, [&] {
        SparseLdlt<float>(nested_dissection(A, node_of_unknown), regularisation).factor(A);
    });
    Row out = once;
    out.measure = name;
    out.analysis = anew - once.factors;
    out.whole += out.analysis;
    return out;
}

// `first`, and then the others in the order of a nested dissection of their nodes.
Ordering eliminated_first(const Ordering& first, const Matrix& A, const std::vector<int>& node_of_unknown) {
    std::vector<int> number(A.cols(), 0), node_number(A.cols(), -1), others, nodes;
    for (const int i : first) number[i] = -1;
    int count = 0;
    for (int i = 0; i < A.cols(); ++i) {
        if (number[i] < 0) continue;
        number[i] = static_cast<int>(others.size());
        others.push_back(i);
        int& node = node_number[node_of_unknown[i]];
        if (node < 0) node = count++;
        nodes.push_back(node);
    }
    std::vector<Eigen::Triplet<double>> entries;
    for (int j = 0; j < A.cols(); ++j)
        for (Matrix::InnerIterator a(A, j); a; ++a)
            if (number[j] >= 0 && number[a.row()] >= 0) entries.emplace_back(number[a.row()], number[j], 1);
    Matrix left(static_cast<Eigen::Index>(others.size()), static_cast<Eigen::Index>(others.size()));
    left.setFromTriplets(entries.begin(), entries.end());
    Ordering out = first;
    for (const int i : nested_dissection(left, nodes)) out.push_back(others[i]);
    return out;
}

// Unknowns of one triangle alone, triangle by triangle.
Ordering interior(const MotionUnknowns& unknowns, int cells) {
    std::vector<int> seen(unknowns.size(), 0);
    for (int cell = 0; cell < cells; ++cell)
        for (int a = 0; a < unknowns.width(); ++a) ++seen[unknowns.of_cell(cell)[a]];
    Ordering out;
    for (int cell = 0; cell < cells; ++cell)
        for (int a = 0; a < unknowns.width(); ++a)
            if (const int i = unknowns.of_cell(cell)[a]; seen[i] == 1) out.push_back(i);
    return out;
}

Ordering curvatures(const MotionUnknowns& unknowns, const Ordering& by_nodes) {
    Ordering out;
    for (const int i : by_nodes)
        if (i >= unknowns.H && i < unknowns.K + unknowns.nodes()) out.push_back(i);
    return out;
}

void solvers(Size size) {
    Scene scene(size.n, size.k);
    const MotionUnknowns& unknowns = scene.solver.unknowns();
    const std::vector<int>& nodes = unknowns.node_of_unknown();
    const int repeats = 5;
    const auto add = [&](const Row& row) { print("solvers", size, row); };
    Row step{"a step"};
    step.whole = least(repeats, cpu_milliseconds, [&] { scene.scheme->step(scene.state, tau); });
    add(step);
    const Matrix A = scene.solver.system().A;
    const Vector b = scene.solver.system().b;
    BorderedSolver bordered(unknowns.pattern(), nodes);
    const Eigen::MatrixXd C = scene.solver.system().flux;
    bordered.solve(A, b, C, Vector::Zero(1));
    Row own{"its system, with border"};
    own.whole = least(repeats, cpu_milliseconds, [&] { bordered.solve(A, b, C, Vector::Zero(1)); });
    own.iterations = bordered.iterations();
    add(own);
    const Ordering by_nodes = nested_dissection(A, nodes);
    add(umfpack_alone(A, b, 2));
    add(umfpack("UMFPACK, METIS on nodes", by_nodes, A, b, repeats));
    add(ldlt<double>("LDL^T double, METIS on nodes", by_nodes, A, b, repeats));
    add(ldlt<float>("LDL^T single, AMD", {}, A, b, repeats));
    add(ldlt<float>("LDL^T single, METIS on unknowns", nested_dissection(A), A, b, repeats));
    const Row chosen = ldlt<float>("LDL^T single, METIS on nodes", by_nodes, A, b, repeats);
    add(chosen);
    add(analysed_anew("the same, analysed in each step", A, nodes, chosen, repeats));
    add(ldlt<float>("the same, interior of triangles first",
                    eliminated_first(interior(unknowns, scene.mesh.triangles()), A, nodes), A, b, repeats));
    if (unknowns.nodes() < 2000)  // dense
        add(ldlt<float>("the same, H and K first", eliminated_first(curvatures(unknowns, by_nodes), A, nodes), A, b,
                        1));
}

struct Lagged {
    int lag;
    SparseLdlt<float> factors;
    Row mean;
    int failures = 0;
};

// One step's system with factors of an earlier one, or with its own where GMRES fails with those.
void solve_lagged(Lagged& l, bool due, const Matrix& A, const Vector& b, Gmres& gmres, int repeats) {
    Vector x;
    int iterations = 0;
    double factoring = due ? least(repeats, cpu_milliseconds, [&] { l.factors.factor(A); }) : 0, solving = 0;
    const auto solve = [&] { iterations += iterate(gmres, l.factors, A, b, x); };
    const double begin = cpu_milliseconds();
    try {
        solving = least(repeats, cpu_milliseconds, [&] { iterations = 0, solve(); });
    } catch (const SolveError&) {
        ++l.failures;
        iterations = most_iterations;
        solving = cpu_milliseconds() - begin;
        factoring += least(1, cpu_milliseconds, [&] { l.factors.factor(A); });
        solving += least(1, cpu_milliseconds, solve);
    }
    l.mean.factors += factoring;
    l.mean.whole += factoring + solving;
    l.mean.iterations += iterations;
}

// Forty steps of a motion, controlled by their error as those of a run: factors made anew every so many.
void lagged(Size size) {
    constexpr int steps = 40;
    constexpr double asked = 1e-4, safety = 0.85, growth = 1.6;  // of surface_simulation.cpp
    Scene scene(size.n, size.k);
    const MotionUnknowns& unknowns = scene.solver.unknowns();
    const double wanted = asked * std::sqrt(extent(scene.surface.space(), scene.mesh).area);
    const Ordering by_nodes = nested_dissection(unknowns.pattern(), unknowns.node_of_unknown());
    const int repeats = size.n < 8 ? 2 : 1;
    std::vector<Lagged> all;
    for (const int lag : {1, 2, 4, 8})
        all.push_back({lag, SparseLdlt<float>(by_nodes, regularisation), {fmt::format("factors kept for {}", lag)}});
    for (Lagged& l : all) l.factors.factor(scene.solver.system().A);  // analysis is not counted
    Gmres gmres(unknowns.size());
    double length = tau;
    for (int i = 0; i < steps; ++i) {
        MotionStep step = scene.scheme->step(scene.state, length);
        for (Lagged& l : all)
            solve_lagged(l, i % l.lag == 0, scene.solver.system().A, scene.solver.system().b, gmres, repeats);
        length *= std::clamp(safety * std::cbrt(wanted / step.error), 0.3, growth);
        if (step.error < 2 * wanted) scene.state = std::move(step.state);
    }
    for (Lagged& l : all) {
        l.mean.whole /= steps, l.mean.factors /= steps, l.mean.iterations /= steps;
        print("lagged", size, l.mean);
        if (l.failures > 0) fmt::print(stderr, "{}: GMRES failed {} times\n", l.mean.measure, l.failures);
    }
}

void threads(Size size) {
    Scene scene(size.n, size.k);
    const MotionUnknowns& unknowns = scene.solver.unknowns();
    for (const int count : {1, 2}) {
        omp_set_num_threads(count);
        const auto add = [&](const char* what, const std::function<void()>& work) {
            work();
            Row row{what};
            row.whole = least(15, wall_milliseconds, work), row.clock = "wall", row.threads = count;
            print("threads", size, row);
        };
        add("a step", [&] { scene.scheme->step(scene.state, tau); });
        const StepSystem& system = scene.solver.system();
        BorderedSolver bordered(unknowns.pattern(), unknowns.node_of_unknown());
        add("its system, with border", [&] { bordered.solve(system.A, system.b, system.flux, Vector::Zero(1)); });
        StepSystem again;
        add("its assembly", [&] { assemble(scene.surface.space(), unknowns, fluid, energy, scene.base, again); });
    }
    omp_set_num_threads(1);
}

}  // namespace
}  // namespace tubule::surface3d

int main(int argc, char** argv) {
    using namespace tubule::surface3d;
    const std::string part = argc > 1 ? argv[1] : "";
    const bool known = part == "" || part == "solvers" || part == "lagged" || part == "threads";
    if (argc > 2 || !known) return fmt::print(stderr, "step_costs [solvers|lagged|threads]\n"), 2;
    fmt::print("part,order,triangles,measure,clock,threads,whole,analysis,factors,iterations,fill,residual\n");
    omp_set_num_threads(1);
    const auto for_sizes = [&](const std::string& name, void (*work)(Size), std::initializer_list<int> all_n) {
        if (part != "" && part != name) return;
        for (const int k : {3, 4})
            for (const int n : all_n) work({k, n});
    };
    for_sizes("solvers", solvers, {4, 6, 8});
    for_sizes("lagged", lagged, {4, 8});  // forty steps, four times
    for_sizes("threads", threads, {4, 6, 8});
}
