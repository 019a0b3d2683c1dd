#include "tools/python/memory_result.hpp"

#include <fmt/format.h>

#include <chrono>
#include <stdexcept>

#include "common/case/read.hpp"
#include "common/result/hdf5_file.hpp"
#include "common/result/start_frame.hpp"
#include "common/run/run_clock.hpp"
#include "common/solve/pause.hpp"
#include "tools/command/commands.hpp"
#include "tools/run/run_to_end.hpp"

namespace tubule {
namespace {

class Memory : public RunObserver {
public:
    Memory(Contents& result, const MemoryRunOptions& options, std::optional<ResultWriter>& writer)
        : result_(result), options_(options), writer_(writer) {}

    void row(std::span<const double> values) override {
        result_.add_row(values);
        if (writer_) writer_->row(values);
    }
    std::size_t mesh(const SurfaceCells& cells) override {
        if (writer_) writer_->mesh(cells);  // numbers them alike
        return result_.add_mesh(cells);
    }
    void frame(const std::function<Record()>& make) override {
        result_.frames.push_back(make());
        if (writer_) writer_->frame(result_.frames.back());
    }
    void checkpoint(const Record& state) override {
        result_.checkpoint = state;
        if (writer_) writer_->checkpoint(state);
    }
    void discard() override {
        result_.forget();
        if (writer_) writer_->discard();
    }
    void progress(double time, double energy, double step) override {
        const auto now = std::chrono::steady_clock::now();
        if (!options_.progress || now < next_) return;
        next_ = now + std::chrono::milliseconds(100);
        options_.progress(time, energy, step);
    }
    bool interrupted() override { return options_.interrupted(); }
    void note(const std::string& words) override {
        if (options_.note) options_.note(words);
    }

private:
    Contents& result_;
    const MemoryRunOptions& options_;
    std::optional<ResultWriter>& writer_;
    std::chrono::steady_clock::time_point next_ = std::chrono::steady_clock::now();
};

}  // namespace

Result run_in_memory(const Problem& given, const MemoryRunOptions& options) {
    PauseWatch watch(given.time.limit, options.interrupted);  // for trial runs and the start, too
    ChosenCase chosen = with_chosen_model(given);
    if (const std::string changed = changed_input(chosen.c, inputs_of(chosen.c)); !changed.empty())
        throw CaseError(fmt::format("{}: {}: bring back the file that its result began with, or read the case itself",
                                    chosen.c.path, changed));
    if (!chosen.c.input) chosen.c.input = current_input(chosen.c);
    const Problem& c = chosen.c;
    const Engine engine(c);
    Contents result;
    result.case_text = kept_case(c);
    result.about = about_start();
    add_choice(result.about, chosen);
    result.series_names = engine.series_names();
    for (const std::string& name : result.series_names) result.series[name];
    std::optional<ResultWriter> writer;
    if (options.output) {
        check_replaced(c, *options.output, options.overwrite);
        writer = ResultWriter::create(*options.output, result.case_text, result.about, result.series_names);
    }
    Memory memory(result, options, writer);
    const Ended ended = run_to_end(engine, memory);
    if (ended.failed && !ended.reached) throw std::runtime_error(c.path + ": " + ended.summary.stop.message);
    const About end = about_end(c, ended.summary, watch.seconds());
    result.about.insert(result.about.end(), end.begin(), end.end());
    if (writer && writer->began()) writer->finish(end);
    return result;
}

}  // namespace tubule
