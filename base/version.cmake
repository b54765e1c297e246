# SPDX-License-Identifier: Apache-2.0
# Sets EMBERLOCK_VERSION. At a tag vMAJOR.MINOR.PATCH it is that; commits later it is 0.2.0+12.g1a2b3c4d5e, and 0.2.0+0.g1a2b3c4d5e where no
# such tag is known; in an archive that git made it is what git wrote here; without git it is the release below and "+unknown".
# EMBERLOCK_RELEASE is the part before the +.
# `cmake -D FOLDER=... -P base/version.cmake` prints that of another folder.
set(EMBERLOCK_RELEASE 0.3.0)  # the last one in CHANGELOG.md
set(archived "$Format:%(describe:tags=true,match=v[0-9]*)$")

if(NOT FOLDER)
  set(FOLDER ${CMAKE_CURRENT_SOURCE_DIR})
endif()
set(described "")
find_program(EMBERLOCK_GIT git)
if(EMBERLOCK_GIT AND EXISTS ${FOLDER}/.git)  # not that of a folder around this one
  execute_process(COMMAND ${EMBERLOCK_GIT} -C ${FOLDER} describe --tags --match v[0-9]* --abbrev=10
    OUTPUT_VARIABLE described OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
elseif(NOT archived MATCHES "Format")
  set(described "${archived}")
endif()
set(EMBERLOCK_VERSION ${EMBERLOCK_RELEASE}+unknown)
if(described MATCHES "^v([0-9]+\\.[0-9]+\\.[0-9]+)(-([0-9]+)-(g[0-9a-f]+))?$")
  set(EMBERLOCK_RELEASE ${CMAKE_MATCH_1})
  set(EMBERLOCK_VERSION ${CMAKE_MATCH_1})
  if(CMAKE_MATCH_3)
    string(APPEND EMBERLOCK_VERSION "+${CMAKE_MATCH_3}.${CMAKE_MATCH_4}")
  endif()
elseif(EMBERLOCK_GIT AND EXISTS ${FOLDER}/.git)
  execute_process(COMMAND ${EMBERLOCK_GIT} -C ${FOLDER} rev-parse --short=10 HEAD
    OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  if(commit MATCHES "^[0-9a-f]+$")
    set(EMBERLOCK_VERSION ${EMBERLOCK_RELEASE}+0.g${commit})
  endif()
endif()
if(CMAKE_SCRIPT_MODE_FILE)
  execute_process(COMMAND ${CMAKE_COMMAND} -E echo ${EMBERLOCK_VERSION})
else()
  foreach(tags refs/tags packed-refs)  # a tag made or moved configures anew
    if(EXISTS ${FOLDER}/.git/${tags})
      set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${FOLDER}/.git/${tags})
    endif()
  endforeach()
endif()
