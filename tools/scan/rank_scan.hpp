// A scan across the processes of one mpirun.
#pragma once

#include "tools/scan/dispatcher.hpp"
#include "tools/scan/ranks.hpp"

namespace tubule {

// For rank 0: runs the scan on all ranks; returns their number.
int run_scan(Ranks& ranks, Dispatcher& dispatcher, const Scan& scan);
// For the others.
void serve_scan(Ranks& ranks);

// As it is sent to them.
Packet to_packet(const Scan& scan);
Scan scan_from(const Packet& packet);

}  // namespace tubule
