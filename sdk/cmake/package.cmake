# SPDX-License-Identifier: Apache-2.0
# Installs the SDK (component "sdk"); included at the end of the configuration.
include(CMakePackageConfigHelpers)
set(sdk_dir "${CMAKE_CURRENT_LIST_DIR}/..")
set(package_dir "${CMAKE_INSTALL_LIBDIR}/cmake/Robomosp")

set(sdk_targets robomosp_sdk)
if(TARGET robomosp_spatial)
  # Headers keep their spelling "spatial/x.h" in an include folder of their own.
  set(helper_dir "${CMAKE_INSTALL_INCLUDEDIR}/robomosp/helper")
  get_target_property(spatial_dir robomosp_spatial SOURCE_DIR)
  set_target_properties(robomosp_spatial PROPERTIES EXPORT_NAME spatial)
  target_include_directories(robomosp_spatial INTERFACE "$<INSTALL_INTERFACE:${helper_dir}>")
  install(DIRECTORY "${spatial_dir}/" DESTINATION "${helper_dir}/spatial" COMPONENT sdk
    FILES_MATCHING PATTERN "*.h")
  list(APPEND sdk_targets robomosp_spatial)
endif()
install(TARGETS ${sdk_targets} EXPORT RobomospTargets
  ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT sdk)
install(EXPORT RobomospTargets NAMESPACE robomosp:: DESTINATION "${package_dir}" COMPONENT sdk)
install(DIRECTORY "${sdk_dir}/include/" DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}" COMPONENT sdk)
install(DIRECTORY "${sdk_dir}/template" "${sdk_dir}/examples" "${sdk_dir}/suites" "${sdk_dir}/clients" DESTINATION "${CMAKE_INSTALL_DATADIR}/robomosp" COMPONENT sdk)

# What the suite "post" compiles its programs with, and the catalogue of these.
if(TARGET irl)
  install(TARGETS irl LIBRARY DESTINATION "${ROBOMOSP_PLUGIN_INSTALL_DIR}" COMPONENT sdk)
endif()
install(DIRECTORY "${PROJECT_SOURCE_DIR}/scripts/post_test" DESTINATION "${CMAKE_INSTALL_DATADIR}/robomosp" COMPONENT sdk)

# What an author reads: the pages, the licence.
install(DIRECTORY "${PROJECT_SOURCE_DIR}/docs/plugin_author" "${PROJECT_SOURCE_DIR}/docs/decisions"
  DESTINATION "${CMAKE_INSTALL_DOCDIR}" COMPONENT sdk FILES_MATCHING PATTERN "*.md")
install(FILES "${PROJECT_SOURCE_DIR}/LICENSE" DESTINATION "${CMAKE_INSTALL_DOCDIR}" COMPONENT sdk)
# For those who build without CMake: pkg-config --cflags robomosp-sdk, --variable=plugindir.
configure_file("${CMAKE_CURRENT_LIST_DIR}/robomosp-sdk.pc.in" "${CMAKE_BINARY_DIR}/sdk/robomosp-sdk.pc" @ONLY)
install(FILES "${CMAKE_BINARY_DIR}/sdk/robomosp-sdk.pc" DESTINATION "${CMAKE_INSTALL_LIBDIR}/pkgconfig"
  COMPONENT sdk)

configure_package_config_file("${CMAKE_CURRENT_LIST_DIR}/RobomospConfig.cmake.in"
  "${CMAKE_BINARY_DIR}/sdk/RobomospConfig.cmake" INSTALL_DESTINATION "${package_dir}"
  PATH_VARS CMAKE_INSTALL_LIBEXECDIR CMAKE_INSTALL_DATADIR)
write_basic_package_version_file("${CMAKE_BINARY_DIR}/sdk/RobomospConfigVersion.cmake"
  VERSION "${PROJECT_VERSION}" COMPATIBILITY SameMinorVersion)
install(FILES
  "${CMAKE_BINARY_DIR}/sdk/RobomospConfig.cmake" "${CMAKE_BINARY_DIR}/sdk/RobomospConfigVersion.cmake"
  "${CMAKE_CURRENT_LIST_DIR}/RobomospPlugin.cmake" DESTINATION "${package_dir}" COMPONENT sdk)
# The suites as a program, so that no plugin has to compile them; absent where tests are not built.
if(TARGET robomosp_plugin_suites)
  install(PROGRAMS "$<TARGET_FILE:robomosp_plugin_suites>"
    DESTINATION "${CMAKE_INSTALL_LIBEXECDIR}/robomosp" COMPONENT sdk OPTIONAL)
endif()
