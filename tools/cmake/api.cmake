# `ninja doc`: pages of the C++ interface, build/.../api/html/index.html, if Doxygen is installed; installed with
# `cmake --install BUILD --component api`.
find_package(Doxygen QUIET)
if(DOXYGEN_FOUND)
  configure_file(tools/api/Doxyfile.in ${PROJECT_BINARY_DIR}/api/Doxyfile @ONLY)
  add_custom_target(doc COMMAND Doxygen::doxygen ${PROJECT_BINARY_DIR}/api/Doxyfile
    COMMENT "Pages of the C++ interface: ${PROJECT_BINARY_DIR}/api/html/index.html" VERBATIM)
  install(DIRECTORY ${PROJECT_BINARY_DIR}/api/html DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/tubule/api
          COMPONENT api EXCLUDE_FROM_ALL OPTIONAL)
endif()
