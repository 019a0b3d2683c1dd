// tubule: membranes as fluid deformable surfaces.
#include "tools/command/program.hpp"

int main(int argc, char** argv) {
    return tubule::program(argc, argv);
}
