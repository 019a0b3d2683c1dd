#include "tools/command/ranked.hpp"

#include <cstdio>
#include <optional>

#include "common/case/read.hpp"
#include "common/solve/interrupt.hpp"
#include "common/solve/message.hpp"
#include "common/solve/pause.hpp"
#include "common/solve/stop.hpp"
#include "tools/command/text.hpp"

namespace tubule {

int run_ranked(const std::function<int(Ranks*)>& root, const std::function<void(Ranks&)>& serve) {
    std::optional<Ranks> ranks = Ranks::join();
    if (!ranks) return root(nullptr);
    if (ranks->rank() > 0) {
        serve(*ranks);
        return 0;
    }
    try {
        return root(&*ranks);
    } catch (const CaseError&) {
        ranks->dismiss();  // thrown before any work was handed out
        throw;
    } catch (const Paused&) {  // likewise
        ranks->dismiss();
        throw;
    } catch (const std::exception& error) {
        say(stderr, "tubule: {}\n", explanation(error));
        std::fflush(nullptr);
        ranks->abort(exit_code(Stop::solver_failed));
    }
}

void abort_interrupted(Ranks& ranks) {
    std::fflush(nullptr);
    ranks.abort(exit_code(Stop::interrupted));
}

}  // namespace tubule
