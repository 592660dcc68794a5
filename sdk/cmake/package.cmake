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
install(DIRECTORY "${sdk_dir}/template" "${sdk_dir}/examples" DESTINATION "${CMAKE_INSTALL_DATADIR}/robomosp" COMPONENT sdk)

configure_package_config_file("${CMAKE_CURRENT_LIST_DIR}/RobomospConfig.cmake.in"
  "${CMAKE_BINARY_DIR}/sdk/RobomospConfig.cmake" INSTALL_DESTINATION "${package_dir}")
write_basic_package_version_file("${CMAKE_BINARY_DIR}/sdk/RobomospConfigVersion.cmake"
  VERSION "${PROJECT_VERSION}" COMPATIBILITY SameMinorVersion)
install(FILES
  "${CMAKE_BINARY_DIR}/sdk/RobomospConfig.cmake" "${CMAKE_BINARY_DIR}/sdk/RobomospConfigVersion.cmake"
  "${CMAKE_CURRENT_LIST_DIR}/RobomospPlugin.cmake" "${CMAKE_CURRENT_LIST_DIR}/conformance_ik.cpp.in"
  "${CMAKE_CURRENT_LIST_DIR}/conformance_csg.cpp.in" "${CMAKE_CURRENT_LIST_DIR}/conformance_dynamics.cpp.in"
  "${CMAKE_CURRENT_LIST_DIR}/conformance_primitive.cpp.in" "${CMAKE_CURRENT_LIST_DIR}/conformance_collision.cpp.in"
  "${CMAKE_CURRENT_LIST_DIR}/conformance_physics.cpp.in" "${CMAKE_CURRENT_LIST_DIR}/conformance_integrator.cpp.in"
  "${CMAKE_CURRENT_LIST_DIR}/conformance_controller.cpp.in" "${CMAKE_CURRENT_LIST_DIR}/conformance_robot_code.cpp.in"
  DESTINATION "${package_dir}" COMPONENT sdk)
