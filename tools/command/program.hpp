// The program `tubule`.
#pragma once

namespace tubule {

// Does what the command line says. The exit status.
int program(int argc, char** argv);

}  // namespace tubule
