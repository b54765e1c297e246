# SPDX-License-Identifier: Apache-2.0
# Runs at installation, when the prefix is known.
if(CMAKE_INSTALL_PREFIX STREQUAL "/usr")
  set(etc /etc)
else()
  set(etc ${CMAKE_INSTALL_PREFIX}/etc)
endif()
set(EMBERLOCKD ${CMAKE_INSTALL_PREFIX}/${sbindir}/emberlockd)
set(EMBERLOCK_CONFIGURATION ${etc}/emberlock/emberlockd.toml)
configure_file(${unit_template} ${made}/emberlockd.service @ONLY)
file(INSTALL ${made}/emberlockd.service DESTINATION ${CMAKE_INSTALL_PREFIX}/lib/systemd/system
  PERMISSIONS OWNER_READ OWNER_WRITE GROUP_READ WORLD_READ)
if(NOT EXISTS $ENV{DESTDIR}${EMBERLOCK_CONFIGURATION})  # the operator's own stays
  file(INSTALL ${made}/emberlockd.toml DESTINATION ${etc}/emberlock
    PERMISSIONS OWNER_READ OWNER_WRITE GROUP_READ WORLD_READ)
endif()
