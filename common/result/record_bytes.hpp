// Records and meshes as bytes, for ranks and for what a case reads.
#pragma once

#include "common/result/bytes.hpp"
#include "common/result/result.hpp"

namespace tubule {

void put(Bytes& out, const Record& record);
void put(Bytes& out, const SurfaceCells& mesh);
void put(Bytes& out, const CaseInputs& inputs);

// Throw as Payload.
Record get_record(Payload& in);
SurfaceCells get_mesh(Payload& in);
CaseInputs get_inputs(Payload& in);

}  // namespace tubule
