# One library target a folder. emberlock_library(NAME [SOURCES ...] [PUBLIC ...] [PRIVATE ...]):
# without SOURCES every .cpp below the folder belongs to it. PUBLIC and PRIVATE are what it links.
set(EMBERLOCK_WARNINGS -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion -Werror
  $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>)  # GCC bug 105651: false alarms inside std::string

function(emberlock_compile_options target)
  target_compile_options(${target} PRIVATE $<$<COMPILE_LANGUAGE:CXX>:${EMBERLOCK_WARNINGS} -ffp-contract=off>)
  target_include_directories(${target} PUBLIC ${CMAKE_SOURCE_DIR})
  if(EMBERLOCK_SANITIZE)
    # Sanitizers change the inlining, and GCC 12 then reports impossible overflows inside its own containers.
    target_compile_options(${target} PRIVATE $<$<COMPILE_LANGUAGE:CXX>:-fsanitize=${EMBERLOCK_SANITIZE}
      -fno-omit-frame-pointer -fno-sanitize-recover=all>
      $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized$<SEMICOLON>-Wno-stringop-overflow>)
    target_link_options(${target} PUBLIC -fsanitize=${EMBERLOCK_SANITIZE})
  endif()
  if(EMBERLOCK_FUZZ)
    target_compile_options(${target} PRIVATE -fsanitize=fuzzer-no-link)
  endif()
endfunction()

function(emberlock_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  if(NOT ARG_SOURCES)
    file(GLOB_RECURSE ARG_SOURCES CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.cpp)
  endif()
  add_library(emberlock_${name} STATIC ${ARG_SOURCES})
  add_library(emberlock::${name} ALIAS emberlock_${name})
  emberlock_compile_options(emberlock_${name})
  target_link_libraries(emberlock_${name} PUBLIC ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE})
endfunction()
