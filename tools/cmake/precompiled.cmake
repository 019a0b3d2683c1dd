# Library headers that most files include, read once a target instead of once a file: that halves the compiling. Files
# still include what they use; a build with CMAKE_DISABLE_PRECOMPILE_HEADERS (preset `dev`) finds what they forgot.
set(precompiled_headers
  <algorithm> <array> <chrono> <cmath> <filesystem> <functional> <limits> <map> <memory> <numbers> <numeric> <optional>
  <random> <set> <span> <stdexcept> <string> <string_view> <tuple> <utility> <variant> <vector>
  <fmt/format.h> <fmt/ranges.h>
  <Eigen/Dense> <Eigen/SparseCore>)

# tubule_precompile(target [header...]): these, and further ones that this target uses throughout. Targets whose compile
# flags and definitions agree share what was compiled for tubule_common.
function(tubule_precompile target)
  if(target STREQUAL tubule_common OR ARGN)
    target_precompile_headers(${target} PRIVATE ${precompiled_headers} ${ARGN})
  else()
    target_precompile_headers(${target} REUSE_FROM tubule_common)
  endif()
endfunction()

# tubule_no_kernels(target [header...]): a target that computes little itself, so that compiling it costs more than it
# could gain: optimised little. Those that see toml++ share what was compiled for tubule_case.
function(tubule_no_kernels target)
  target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1>)
  if(target STREQUAL tubule_case OR ARGN)
    target_precompile_headers(${target} PRIVATE ${precompiled_headers} ${ARGN})
  else()
    target_precompile_headers(${target} REUSE_FROM tubule_case)
  endif()
endfunction()

# tubule_compile_together(target FOLDERS folder... [ALONE file...]): the files of a folder as one, except for these. Compiling
# is mostly the making of templates, which they then share (docs/decisions/packages.md). Kernels stay alone: what is inlined
# into them does not depend on their neighbours.
function(tubule_compile_together target)
  cmake_parse_arguments(PARSE_ARGV 1 of "" "" "FOLDERS;ALONE")
  get_target_property(sources ${target} SOURCES)
  list(REMOVE_ITEM sources ${of_ALONE})
  foreach(source IN LISTS sources)
    cmake_path(GET source PARENT_PATH folder)
    if(folder IN_LIST of_FOLDERS)
      string(REPLACE / _ folder ${folder})
      set_source_files_properties(${source} PROPERTIES UNITY_GROUP ${folder})
    endif()
  endforeach()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
endfunction()
