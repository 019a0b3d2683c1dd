// SIGINT (Ctrl-C) and SIGTERM as a flag that a run asks after every step, so that it can save its state and end.
#pragma once

namespace tubule {

// Lowers the flag; from here on the first signal raises it, and a second one ends the process at once. A signal that
// the process was begun with as ignored, such as SIGINT of a script's background jobs, stays so.
void catch_interrupts();

bool interrupted();

// For a host that handles signals itself: Python.
void set_interrupted(bool raised);

}  // namespace tubule
