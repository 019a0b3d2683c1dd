#include "common/solve/interrupt.hpp"

#include <csignal>

namespace tubule {
namespace {

volatile std::sig_atomic_t flag = 0;

extern "C" void raise_flag(int) {
    flag = 1;
}

}  // namespace

void catch_interrupts() {
    flag = 0;
    struct sigaction action {
    }, before{};
    action.sa_handler = raise_flag;
    action.sa_flags = SA_RESETHAND | SA_RESTART;  // reset: the second signal acts as usual
    sigemptyset(&action.sa_mask);
    for (const int number : {SIGINT, SIGTERM}) {
        sigaction(number, nullptr, &before);
        if (before.sa_handler != SIG_IGN) sigaction(number, &action, nullptr);
    }
}

void set_interrupted(bool raised) {
    flag = raised;
}

bool interrupted() {
    return flag != 0;
}

}  // namespace tubule
