# SPDX-License-Identifier: Apache-2.0
# What programs of others need to call the rooms that take no device: static libraries, headers (include "recon/pipeline/reconstruct.h")
# and find_package(Emberlock COMPONENTS recon smear session). `cmake --install BUILD --component development` lays down this alone, packages
# hold the rest.
include(CMakePackageConfigHelpers)
set(libraries base proto ccd_model smear_sync session recon_core recon_calibrate recon_measure recon_io recon)
foreach(library ${libraries})
  set_target_properties(emberlock_${library} PROPERTIES EXPORT_NAME ${library})
  list(APPEND targets emberlock_${library})
endforeach()
set_target_properties(emberlock_smear_sync PROPERTIES EXPORT_NAME smear)  # as its namespace
target_compile_features(emberlock_base INTERFACE $<INSTALL_INTERFACE:cxx_std_20>)
install(TARGETS ${targets} openvdb EXPORT EmberlockTargets
  ARCHIVE DESTINATION lib COMPONENT development INCLUDES DESTINATION include/emberlock)
install(DIRECTORY base smear_sync session recon DESTINATION include/emberlock COMPONENT development
  FILES_MATCHING PATTERN "version.h" EXCLUDE PATTERN "*.h")
install(DIRECTORY ${CMAKE_BINARY_DIR}/generated/proto/emberlock DESTINATION include/emberlock COMPONENT development
  FILES_MATCHING PATTERN "*.grpc.pb.h" EXCLUDE PATTERN "*.pb.h")
set(package lib/cmake/Emberlock)
install(EXPORT EmberlockTargets NAMESPACE emberlock:: DESTINATION ${package} COMPONENT development)
configure_package_config_file(base/EmberlockConfig.cmake.in ${CMAKE_BINARY_DIR}/EmberlockConfig.cmake INSTALL_DESTINATION ${package})
write_basic_package_version_file(${CMAKE_BINARY_DIR}/EmberlockConfigVersion.cmake VERSION ${EMBERLOCK_RELEASE} COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/EmberlockConfig.cmake ${CMAKE_BINARY_DIR}/EmberlockConfigVersion.cmake
  DESTINATION ${package} COMPONENT development)
