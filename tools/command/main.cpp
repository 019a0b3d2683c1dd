// tubule: membranes as fluid deformable surfaces.
#include <cstdio>
#include <cstdlib>

#include "tools/command/program.hpp"

// After a failure no exit handlers run: that of HDF5 crashes over a file that it could not write for lack of memory.
int main(int argc, char** argv) {
    const int status = tubule::program(argc, argv);
    if (status == 0) return 0;
    std::fflush(nullptr);
    std::_Exit(status);
}
