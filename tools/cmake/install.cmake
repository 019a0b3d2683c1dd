# `cmake --install`: the program, its plot scripts and cases, and the libraries for find_package(Tubule).
include(CMakePackageConfigHelpers)

set_target_properties(tubule_flags PROPERTIES EXPORT_NAME flags)
set_target_properties(tubule_common PROPERTIES EXPORT_NAME common)
set_target_properties(tubule_axisym PROPERTIES EXPORT_NAME axisym)
set_target_properties(tubule_surface3d PROPERTIES EXPORT_NAME surface3d)
add_library(Tubule::common ALIAS tubule_common)
add_library(Tubule::axisym ALIAS tubule_axisym)
add_library(Tubule::surface3d ALIAS tubule_surface3d)

set(config_dir ${CMAKE_INSTALL_LIBDIR}/cmake/Tubule)
install(TARGETS tubule RUNTIME)
install(TARGETS tubule_flags tubule_common tubule_axisym tubule_surface3d EXPORT TubuleTargets)
install(EXPORT TubuleTargets NAMESPACE Tubule:: DESTINATION ${config_dir})
configure_package_config_file(tools/cmake/TubuleConfig.cmake.in ${PROJECT_BINARY_DIR}/TubuleConfig.cmake
                              INSTALL_DESTINATION ${config_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/TubuleConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/TubuleConfig.cmake ${PROJECT_BINARY_DIR}/TubuleConfigVersion.cmake
              tools/cmake/dependencies.cmake tools/cmake/FindSuiteSparse.cmake
        DESTINATION ${config_dir})

# Without those that need headers of HDF5 and CHOLMOD, which no other one includes.
install(DIRECTORY common axisym surface3d DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/tubule
        FILES_MATCHING PATTERN "*.hpp" PATTERN "hdf5_objects.hpp" EXCLUDE PATTERN "vtk_grid.hpp" EXCLUDE
        PATTERN "sparse_cholmod.hpp" EXCLUDE)
install(DIRECTORY cases DESTINATION ${CMAKE_INSTALL_DATADIR}/tubule
        FILES_MATCHING PATTERN "*.toml" PATTERN "meshes/*")
install(PROGRAMS tools/slurm/tubule.sbatch DESTINATION ${CMAKE_INSTALL_DATADIR}/tubule/slurm)
install(DIRECTORY docs/schemas DESTINATION ${CMAKE_INSTALL_DATADIR}/tubule FILES_MATCHING PATTERN "*.json")
install(DIRECTORY tools/plot DESTINATION ${CMAKE_INSTALL_DATADIR}/tubule USE_SOURCE_PERMISSIONS
        FILES_MATCHING PATTERN "*.py")
