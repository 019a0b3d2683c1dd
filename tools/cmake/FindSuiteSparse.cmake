# SuiteSparse as Debian packages it, without a CMake config of its own (SuiteSparse < 7).
#
# Components: SuiteSparse_config AMD COLAMD BTF KLU CHOLMOD UMFPACK; none named means all.
# Targets: SuiteSparse::<component>, each linking to those it needs. SuiteSparse_VERSION is set.
include(FindPackageHandleStandardArgs)

set(_suitesparse_needs_SuiteSparse_config)
set(_suitesparse_needs_AMD SuiteSparse_config)
set(_suitesparse_needs_COLAMD SuiteSparse_config)
set(_suitesparse_needs_BTF SuiteSparse_config)
set(_suitesparse_needs_KLU AMD COLAMD BTF SuiteSparse_config)
set(_suitesparse_needs_CHOLMOD AMD COLAMD SuiteSparse_config)
set(_suitesparse_needs_UMFPACK CHOLMOD AMD SuiteSparse_config)

find_path(SuiteSparse_INCLUDE_DIR SuiteSparse_config.h PATH_SUFFIXES suitesparse)
if(SuiteSparse_INCLUDE_DIR)
  file(STRINGS ${SuiteSparse_INCLUDE_DIR}/SuiteSparse_config.h _suitesparse_lines
       REGEX "#define SUITESPARSE_(MAIN|SUB|SUBSUB)_VERSION ")
  list(TRANSFORM _suitesparse_lines REPLACE ".*VERSION +([0-9]+).*" "\\1")
  list(JOIN _suitesparse_lines "." SuiteSparse_VERSION)
endif()

function(_suitesparse_component name)
  foreach(needed IN LISTS _suitesparse_needs_${name})
    _suitesparse_component(${needed})
  endforeach()
  string(TOLOWER ${name} file)
  string(REPLACE "_" "" file ${file}) # SuiteSparse_config: libsuitesparseconfig
  find_library(SuiteSparse_${name}_LIBRARY ${file})
  mark_as_advanced(SuiteSparse_${name}_LIBRARY)
  if(NOT SuiteSparse_${name}_LIBRARY OR NOT SuiteSparse_INCLUDE_DIR)
    return()
  endif()
  set(SuiteSparse_${name}_FOUND TRUE PARENT_SCOPE)
  if(NOT TARGET SuiteSparse::${name})
    add_library(SuiteSparse::${name} UNKNOWN IMPORTED)
    set_target_properties(SuiteSparse::${name} PROPERTIES
      IMPORTED_LOCATION ${SuiteSparse_${name}_LIBRARY}
      INTERFACE_INCLUDE_DIRECTORIES ${SuiteSparse_INCLUDE_DIR})
    list(TRANSFORM _suitesparse_needs_${name} PREPEND SuiteSparse:: OUTPUT_VARIABLE needed)
    target_link_libraries(SuiteSparse::${name} INTERFACE ${needed})
  endif()
endfunction()

if(NOT SuiteSparse_FIND_COMPONENTS)
  set(SuiteSparse_FIND_COMPONENTS SuiteSparse_config AMD COLAMD BTF KLU CHOLMOD UMFPACK)
endif()
foreach(_suitesparse_name IN LISTS SuiteSparse_FIND_COMPONENTS)
  _suitesparse_component(${_suitesparse_name})
endforeach()

find_package_handle_standard_args(SuiteSparse REQUIRED_VARS SuiteSparse_INCLUDE_DIR
                                  VERSION_VAR SuiteSparse_VERSION HANDLE_COMPONENTS)
mark_as_advanced(SuiteSparse_INCLUDE_DIR)
