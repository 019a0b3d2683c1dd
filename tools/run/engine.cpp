#include "tools/run/engine.hpp"

#include <stdexcept>

#include "axisym/equilibrium/equilibrium_run.hpp"
#include "axisym/run.hpp"
#include "common/solve/pause.hpp"
#include "surface3d/run/motion_forecast.hpp"
#include "tools/auto/auto_run.hpp"
#include "tools/auto/joined_file.hpp"
#include "tools/run/forecast.hpp"

namespace tubule {
namespace {

constexpr double long_run = 60;  // seconds
constexpr double part_of_limit = 0.1;

class Axisymmetric : public Engine {
public:
    using Engine::Engine;
    std::vector<std::string> series_names() const override { return axisym::series_names(case_); }
    void check_restart(const Record& record) const override { axisym::check_restart(record); }
    RunSummary run(RunObserver& observer, const Restart* restart, const Result*) const override {
        return axisym::run(case_, observer, restart);
    }
};

class Equilibria : public Engine {
public:
    explicit Equilibria(const Problem& c) : Engine(c) { axisym::check_equilibrium(c); }
    std::vector<std::string> series_names() const override { return axisym::equilibrium_series_names(case_); }
    void check_restart(const Record& record) const override { axisym::check_restart(record); }
    RunSummary run(RunObserver& observer, const Restart*, const Result*) const override {
        return axisym::run_equilibrium(case_, observer);
    }
};

class ThreeDimensions : public Engine {
public:
    explicit ThreeDimensions(const Problem& c) : Engine(c), start_(c) {}
    std::vector<std::string> series_names() const override { return surface3d::series_names(case_); }
    void check_restart(const Record& record) const override {
        if (moves()) surface3d::check_restart(case_, record);
    }
    std::optional<Forecast> forecast_if_long() const override {
        std::optional<double> limit = case_.time.limit;  // to which this counts, too
        if (limit) *limit *= part_of_limit;
        const PauseWatch watch(limit, [] { return false; });
        try {
            std::optional<Forecast> f = forecast_at_rest(case_);
            if (moves() && surface3d::may_be_long(case_, start_)) f = surface3d::forecast_motion(case_, start_);
            return f && (f->seconds.value_or(0) > long_run || f->finer_runs) ? f : std::nullopt;
        } catch (const Paused&) {  // the run itself finds why, if that is not the part
            return std::nullopt;
        }
    }
    std::string warning() const override { return start_.time_scale(); }
    RunSummary run(RunObserver& observer, const Restart* restart, const Result*) const override {
        if (restart && !moves()) observer.discard();  // nothing moves: there is no partial state to resume from
        return surface3d::run(case_, start_, observer, restart);
    }

private:
    bool moves() const { return case_.unknowns == Unknowns::moving_surface; }

    surface3d::Start start_;
};

class Automatic : public Engine {
public:
    explicit Automatic(const Problem& c) : Engine(c), choice_(choice_for(c)) {}
    std::vector<std::string> series_names() const override { return joined_series_names(case_, choice_.axisymmetric); }
    void check_restart(const Record& record) const override {
        if (record.mesh)
            surface3d::check_restart(case_, record);
        else
            axisym::check_restart(record);
    }
    std::string warning() const override { return choice_.start ? choice_.start->time_scale() : ""; }
    RunSummary run(RunObserver& observer, const Restart* restart, const Result* unfinished) const override {
        return run_auto(case_, choice_, observer, restart, unfinished);
    }

private:
    Choice choice_;
};

}  // namespace

std::unique_ptr<const Engine> engine_for(const Problem& c) {
    if (c.unknowns == Unknowns::equilibrium) return std::make_unique<Equilibria>(c);
    if (c.model.kind == ModelKind::automatic) throw std::logic_error("a case whose model is not chosen yet");
    if (c.is_axisymmetric()) return std::make_unique<Axisymmetric>(c);
    if (c.unknowns == Unknowns::automatic) return std::make_unique<Automatic>(c);
    return std::make_unique<ThreeDimensions>(c);
}

}  // namespace tubule
