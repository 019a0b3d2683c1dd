# Library headers that most files include, read once a target instead of once a file: that halves the compiling. Files
# still include what they use; a build with CMAKE_DISABLE_PRECOMPILE_HEADERS (preset `dev`) finds what they forgot.
set(precompiled_headers
  <algorithm> <array> <chrono> <cmath> <filesystem> <functional> <limits> <map> <memory> <numbers> <numeric> <optional>
  <random> <set> <span> <stdexcept> <string> <string_view> <tuple> <utility> <variant> <vector>
  <fmt/format.h> <fmt/ranges.h>
  <Eigen/Dense> <Eigen/SparseCore>)

# tubule_precompile(target [header...]): these, and further ones that this target uses throughout. Without further ones the
# target shares what was compiled for tubule_common; its flags have to be the same.
function(tubule_precompile target)
  if(target STREQUAL tubule_common OR ARGN)
    target_precompile_headers(${target} PRIVATE ${precompiled_headers} ${ARGN})
  else()
    target_precompile_headers(${target} REUSE_FROM tubule_common)
  endif()
endfunction()
