# `cmake --install`: the program, its scripts that draw and cases, and the libraries for find_package(Tubule).
include(CMakePackageConfigHelpers)

set_target_properties(tubule_flags PROPERTIES EXPORT_NAME flags)
if(TUBULE_SHARED)  # one library instead, under all three names
  set(libraries tubule_shared)
  set_target_properties(tubule_shared PROPERTIES EXPORT_NAME tubule)
  foreach(name common axisym surface3d)
    add_library(all_of_${name} INTERFACE)
    target_link_libraries(all_of_${name} INTERFACE tubule_shared)
    set_target_properties(all_of_${name} PROPERTIES EXPORT_NAME ${name})
    list(APPEND libraries all_of_${name})
  endforeach()
else()
  set(libraries tubule_common tubule_axisym tubule_surface3d)
  foreach(name common axisym surface3d)
    set_target_properties(tubule_${name} PROPERTIES EXPORT_NAME ${name})
  endforeach()
endif()
add_library(Tubule::common ALIAS tubule_common)
add_library(Tubule::axisym ALIAS tubule_axisym)
add_library(Tubule::surface3d ALIAS tubule_surface3d)

set(config_dir ${CMAKE_INSTALL_LIBDIR}/cmake/Tubule)
install(TARGETS tubule RUNTIME)
install(TARGETS tubule_flags ${libraries} EXPORT TubuleTargets)
install(EXPORT TubuleTargets NAMESPACE Tubule:: DESTINATION ${config_dir})
configure_package_config_file(tools/cmake/TubuleConfig.cmake.in ${PROJECT_BINARY_DIR}/TubuleConfig.cmake
                              INSTALL_DESTINATION ${config_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/TubuleConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/TubuleConfig.cmake ${PROJECT_BINARY_DIR}/TubuleConfigVersion.cmake
              tools/cmake/dependencies.cmake tools/cmake/FindSuiteSparse.cmake
        DESTINATION ${config_dir})

# Without those that need headers of HDF5 and CHOLMOD or depend on the machine's registers, which no other one includes.
install(DIRECTORY common axisym surface3d DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/tubule
        FILES_MATCHING PATTERN "*.hpp" PATTERN "hdf5_objects.hpp" EXCLUDE PATTERN "vtk_grid.hpp" EXCLUDE
        PATTERN "sparse_cholmod.hpp" EXCLUDE PATTERN "pack.hpp" EXCLUDE
        REGEX "axisym/curve/(curve_local|varying_H0)\\.hpp$" EXCLUDE)
install(DIRECTORY cases DESTINATION ${CMAKE_INSTALL_DATADIR}/tubule
        FILES_MATCHING PATTERN "*.toml" PATTERN "meshes/*")
install(PROGRAMS tools/slurm/tubule.sbatch DESTINATION ${CMAKE_INSTALL_DATADIR}/tubule/slurm)
install(DIRECTORY docs/schemas DESTINATION ${CMAKE_INSTALL_DATADIR}/tubule FILES_MATCHING PATTERN "*.json")
install(DIRECTORY tools/python/tubule/drawing DESTINATION ${TUBULE_PYTHON_DIR}/tubule
        FILES_MATCHING PATTERN "*.py" PATTERN "view*")  # by itself, too, where there is no Python package
install(FILES README.md CITATION.cff DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/tubule)
install(DIRECTORY docs DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/tubule PATTERN figures.json EXCLUDE PATTERN figures EXCLUDE)

# Manual pages and completion of the command line, from what the program says of itself.
set(TUBULE_ZSH_DIR ${CMAKE_INSTALL_DATADIR}/zsh/site-functions CACHE STRING "Where zsh looks for completions")
set(said ${PROJECT_BINARY_DIR}/said)
set(scripts ${PROJECT_SOURCE_DIR}/tools/packaging)
string(TIMESTAMP today %Y-%m-%d UTC)  # of SOURCE_DATE_EPOCH, where that is set
add_custom_command(OUTPUT ${said}/man/tubule.1 ${said}/tubule.bash ${said}/tubule.zsh
  COMMAND mkdir -p ${said}
  COMMAND tubule --describe > ${said}/tubule.json
  COMMAND /usr/bin/python3 ${scripts}/manual_pages.py ${PROJECT_VERSION} ${today} ${said}/man < ${said}/tubule.json
  COMMAND /usr/bin/python3 ${scripts}/completion.py bash < ${said}/tubule.json > ${said}/tubule.bash
  COMMAND /usr/bin/python3 ${scripts}/completion.py zsh < ${said}/tubule.json > ${said}/tubule.zsh
  DEPENDS tubule ${scripts}/manual_pages.py ${scripts}/completion.py VERBATIM
  COMMENT "Manual pages and completion: ${said}")
add_custom_target(said ALL DEPENDS ${said}/man/tubule.1)
install(DIRECTORY ${said}/man/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 OPTIONAL)
install(FILES ${said}/tubule.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME tubule OPTIONAL)
install(FILES ${said}/tubule.zsh DESTINATION ${TUBULE_ZSH_DIR} RENAME _tubule OPTIONAL)
