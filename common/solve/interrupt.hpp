// SIGINT (Ctrl-C) and SIGTERM as a flag that a run asks after every step, so that it can save its state and end.
#pragma once

namespace tubule {

// From here on the first signal sets the flag; a second one ends the process at once.
void catch_interrupts();

bool interrupted();

}  // namespace tubule
