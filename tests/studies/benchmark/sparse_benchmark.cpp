// Direct solvers on matrices like those of the three-dimensional tier, with the alternatives to what common/solve does.
// The time is that of a numeric factorisation; `analyse` and `solve` are seconds, `fill` millions of entries in the
// factors, `residual` is |b - A x|_oo / (|A|_oo |x|_oo) without refinement. Compare with OPENBLAS_NUM_THREADS=1, and
// OMP_NUM_THREADS=1 for all but `ldlt`: these solve with GMRES to 1e-12 in the time of `solve`.
#include <benchmark/benchmark.h>
#include <cholmod.h>
#include <fmt/core.h>
#include <umfpack.h>

#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <optional>

#include "common/solve/gmres.hpp"
#include "common/solve/sparse.hpp"
#include "common/solve/sparse_ldlt.hpp"
#include "tests/studies/benchmark/main.hpp"
#include "tests/sphere_matrices.hpp"

namespace tubule {
namespace {

using Matrix = Eigen::SparseMatrix<double>;
using Vector = Eigen::VectorXd;
using sphere::System;

double seconds(const auto& work) {
    const auto start = std::chrono::steady_clock::now();
    work();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

struct Bench {
    virtual ~Bench() = default;
    virtual void analyse(const System&) = 0;
    virtual void factor(const System&) = 0;
    virtual Vector solve(const System&, const Vector& b) = 0;
    virtual double fill() = 0;
};

// A solver of ours, given the graph of the nodes or not.
template <class Solver>
struct Ours : Bench {
    bool by_nodes;
    std::optional<Solver> solver;
    explicit Ours(bool nodes) : by_nodes(nodes) {}
    void analyse(const System& s) override {
        if constexpr (std::is_same_v<Solver, SparseLuLarge>)
            solver.emplace(by_nodes ? nested_dissection(s.A, s.node_of_unknown) : Ordering{});
        else
            solver.emplace();
    }
    void factor(const System& s) override { solver->factor(s.A); }
    Vector solve(const System&, const Vector& b) override { return solver->solve(b); }
    double fill() override { return static_cast<double>(solver->counters().fill); }
};

template <class Scalar>
struct Ldlt : Bench {
    bool by_nodes;
    std::optional<SparseLdlt<Scalar>> factors;
    explicit Ldlt(bool nodes) : by_nodes(nodes) {}
    void analyse(const System& s) override {
        factors.emplace(by_nodes ? nested_dissection(s.A, s.node_of_unknown) : Ordering{}, 1e-5);
    }
    void factor(const System& s) override { factors->factor(s.A); }
    Vector solve(const System& s, const Vector& b) override {
        // By rows Eigen takes all threads for the product.
        const Eigen::SparseMatrix<double, Eigen::RowMajor> A = s.A;
        Vector x = Vector::Zero(b.size());
        Gmres(static_cast<int>(b.size()))
            .solve([&](const Vector& u, Vector& v) { v.noalias() = A * u; },
                   [&](const Vector& u, Vector& v) { factors->solve(u, v); }, b, x, 1e-12, 60);
        return x;
    }
    double fill() override { return static_cast<double>(factors->counters().fill); }
};

struct Umfpack : Bench {
    double control[UMFPACK_CONTROL], info[UMFPACK_INFO];
    void *symbolic = nullptr, *numeric = nullptr;
    bool by_nodes;
    Umfpack(int strategy, int ordering, double tolerance, bool nodes = false) : by_nodes(nodes) {
        umfpack_di_defaults(control);
        control[UMFPACK_STRATEGY] = strategy;
        control[UMFPACK_ORDERING] = ordering;
        control[UMFPACK_SYM_PIVOT_TOLERANCE] = tolerance;
        control[UMFPACK_IRSTEP] = 0;
    }
    ~Umfpack() override {
        umfpack_di_free_symbolic(&symbolic);
        umfpack_di_free_numeric(&numeric);
    }
    void analyse(const System& s) override {
        const int n = static_cast<int>(s.A.cols());
        const int *p = s.A.outerIndexPtr(), *i = s.A.innerIndexPtr();
        if (by_nodes)
            umfpack_di_qsymbolic(n, n, p, i, nullptr, nested_dissection(s.A, s.node_of_unknown).data(), &symbolic,
                                 control, info);
        else
            umfpack_di_symbolic(n, n, p, i, nullptr, &symbolic, control, info);
    }
    void factor(const System& s) override {
        umfpack_di_free_numeric(&numeric);
        umfpack_di_numeric(s.A.outerIndexPtr(), s.A.innerIndexPtr(), s.A.valuePtr(), symbolic, &numeric, control, info);
    }
    Vector solve(const System& s, const Vector& b) override {
        Vector x(b.size());
        umfpack_di_solve(UMFPACK_A, s.A.outerIndexPtr(), s.A.innerIndexPtr(), s.A.valuePtr(), x.data(), b.data(),
                         numeric, control, info);
        return x;
    }
    double fill() override { return info[UMFPACK_LNZ] + info[UMFPACK_UNZ]; }
};

struct Cholmod : Bench {
    cholmod_common common;
    cholmod_sparse* lower = nullptr;
    cholmod_factor* factors = nullptr;
    Cholmod(int ordering, int supernodal) {
        cholmod_start(&common);
        common.nmethods = 1;
        common.method[0].ordering = ordering;
        common.supernodal = supernodal;
        common.final_ll = 1;
    }
    ~Cholmod() override {
        cholmod_free_sparse(&lower, &common);
        cholmod_free_factor(&factors, &common);
        cholmod_finish(&common);
    }
    void analyse(const System& s) override {
        const Matrix L = s.A.triangularView<Eigen::Lower>();
        lower = cholmod_allocate_sparse(L.rows(), L.cols(), L.nonZeros(), 1, 1, -1, CHOLMOD_REAL, &common);
        std::copy_n(L.outerIndexPtr(), L.cols() + 1, static_cast<int*>(lower->p));
        std::copy_n(L.innerIndexPtr(), L.nonZeros(), static_cast<int*>(lower->i));
        std::copy_n(L.valuePtr(), L.nonZeros(), static_cast<double*>(lower->x));
        factors = cholmod_analyze(lower, &common);
    }
    void factor(const System&) override { cholmod_factorize(lower, factors, &common); }
    Vector solve(const System&, const Vector& b) override {
        cholmod_dense view{};
        view.nrow = view.nzmax = view.d = b.size();
        view.ncol = 1;
        view.x = const_cast<double*>(b.data());
        view.xtype = CHOLMOD_REAL;
        view.dtype = CHOLMOD_DOUBLE;
        cholmod_dense* x = cholmod_solve(CHOLMOD_A, factors, &view, &common);
        const Vector answer = Vector::Map(static_cast<const double*>(x->x), b.size());
        cholmod_free_dense(&x, &common);
        return answer;
    }
    double fill() override { return common.lnz; }
};

enum Kind { spd, mesh, flow };

const System& system_of(Kind kind, int k, int level) {
    static std::tuple<int, int, int> last{-1, 0, 0};
    static System s;
    if (last != std::tuple<int, int, int>{kind, k, level}) {
        const auto t = sphere::icosphere(level);
        s = kind == spd    ? System{sphere::helmholtz(t, k, 1, 0.01), {}}
            : kind == mesh ? sphere::saddle(t, k, 0)
                           : sphere::almost_symmetric(sphere::flow(t, k, 1e-3), 1e-3);
        if (kind == spd)
            for (int i = 0; i < s.A.cols(); ++i) s.node_of_unknown.push_back(i);
        last = {kind, k, level};
    }
    return s;
}

void run(benchmark::State& state, Kind kind, int k, int level, const std::function<std::unique_ptr<Bench>()>& make) {
    const System& s = system_of(kind, k, level);
    const auto bench = make();
    const double analyse = seconds([&] { bench->analyse(s); });
    bench->factor(s);  // allocates, and ours analyses
    if (!(bench->fill() > 0)) return state.SkipWithError("no factors");
    for (auto _ : state) bench->factor(s);
    const Vector b = Vector::LinSpaced(s.A.cols(), 0, 7).array().sin();
    Vector x;
    state.counters["solve"] = seconds([&] { x = bench->solve(s, b); });
    const Vector row_sums = s.A.cwiseAbs() * Vector::Ones(s.A.cols());
    state.counters["residual"] =
        (b - s.A * x).lpNorm<Eigen::Infinity>() / (row_sums.maxCoeff() * x.lpNorm<Eigen::Infinity>());
    state.counters["analyse"] = analyse;
    state.counters["size"] = static_cast<double>(s.A.cols());
    state.counters["fill"] = 1e-6 * bench->fill();
}

void add(Kind kind, int k, int level, const std::string& variant, std::function<std::unique_ptr<Bench>()> make) {
    const char* const kinds[] = {"spd", "mesh", "flow"};
    const std::string name = fmt::format("{}/k{}/T{}/{}", kinds[kind], k, 20 << (2 * level), variant);
    benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& state) {
        run(state, kind, k, level, make);
    })->Unit(benchmark::kMillisecond);
}

void add_all() {
    for (const int k : {2, 3, 4})
        for (const int level : {2, 3, 4, 5}) {
            const auto cholmod = [](int ordering, int supernodal) {
                return [=] { return std::make_unique<Cholmod>(ordering, supernodal); };
            };
            add(spd, k, level, "ours", [] { return std::make_unique<Ours<SparseCholesky>>(false); });
            add(spd, k, level, "metis_supernodal", cholmod(CHOLMOD_METIS, CHOLMOD_SUPERNODAL));
            add(spd, k, level, "metis_simplicial", cholmod(CHOLMOD_METIS, CHOLMOD_SIMPLICIAL));
            add(spd, k, level, "nesdis_supernodal", cholmod(CHOLMOD_NESDIS, CHOLMOD_SUPERNODAL));
            add(spd, k, level, "amd_supernodal", cholmod(CHOLMOD_AMD, CHOLMOD_SUPERNODAL));
            add(spd, k, level, "amd_simplicial", cholmod(CHOLMOD_AMD, CHOLMOD_SIMPLICIAL));
        }
    for (const Kind kind : {mesh, flow})
        for (const int k : {2, 3, 4})
            for (const int level : {2, 3, 4, 5}) {
                if (level == 5 && (k == 4 || kind == flow)) continue;  // gigabytes
                const auto umfpack = [](int strategy, int ordering, double tolerance, bool nodes = false) {
                    return [=] { return std::make_unique<Umfpack>(strategy, ordering, tolerance, nodes); };
                };
                constexpr int symmetric = UMFPACK_STRATEGY_SYMMETRIC, metis = UMFPACK_ORDERING_METIS;
                add(kind, k, level, "ours", [] { return std::make_unique<Ours<SparseLuLarge>>(true); });
                add(kind, k, level, "ldlt_double", [] { return std::make_unique<Ldlt<double>>(true); });
                add(kind, k, level, "ldlt_float", [] { return std::make_unique<Ldlt<float>>(true); });
                add(kind, k, level, "ldlt_amd", [] { return std::make_unique<Ldlt<float>>(false); });
                add(kind, k, level, "nodes_1e-1", umfpack(symmetric, metis, 1e-1, true));
                add(kind, k, level, "nodes_1e-6", umfpack(symmetric, metis, 1e-6, true));
                add(kind, k, level, "metis", umfpack(symmetric, metis, 1e-3));
                if (level > 3) continue;  // minutes
                add(kind, k, level, "amd", umfpack(symmetric, UMFPACK_ORDERING_AMD, 1e-3));
                add(kind, k, level, "unsymmetric_metis", umfpack(UMFPACK_STRATEGY_UNSYMMETRIC, metis, 1e-3));
                add(kind, k, level, "unsymmetric_amd",
                    umfpack(UMFPACK_STRATEGY_UNSYMMETRIC, UMFPACK_ORDERING_AMD, 1e-3));
                add(kind, k, level, "auto", umfpack(UMFPACK_STRATEGY_AUTO, UMFPACK_ORDERING_AMD, 1e-3));
                if (level > 2) continue;
                add(kind, k, level, "klu", [] { return std::make_unique<Ours<SparseLu>>(false); });
            }
}

}  // namespace
}  // namespace tubule

int main(int argc, char** argv) {
    return tubule::run_benchmarks(argc, argv, tubule::add_all);
}
