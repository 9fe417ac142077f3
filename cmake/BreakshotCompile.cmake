# How everything of ours is compiled. Linked by breakshot_library() and breakshot_program(); generated and third-party code does not get it.

option(BREAKSHOT_WERROR "Treat warnings as errors (CI does)" ON)
set(BREAKSHOT_SANITIZE "" CACHE STRING "Sanitizers, as for -fsanitize=: \"address,undefined\" or \"thread\"")
option(BREAKSHOT_FUZZ "Build the fuzzers of tests/fuzz (clang)" OFF)
option(BREAKSHOT_COVERAGE "Instrument for gcov" OFF)

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)

if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "" FORCE)
endif()

find_program(BREAKSHOT_CCACHE ccache)
if(BREAKSHOT_CCACHE)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${BREAKSHOT_CCACHE})
endif()

# Sanitizers must see every translation unit, generated ones too.
if(BREAKSHOT_SANITIZE)
  # GCC takes what the sanitizers add to std::regex and std::function for uses of uninitialised values.
  add_compile_options(-fsanitize=${BREAKSHOT_SANITIZE} -fno-omit-frame-pointer $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>)
  add_link_options(-fsanitize=${BREAKSHOT_SANITIZE})
  if(BREAKSHOT_SANITIZE MATCHES undefined)
    add_compile_options(-fno-sanitize-recover=undefined)
  endif()
endif()
if(BREAKSHOT_COVERAGE)
  add_compile_options(--coverage -fprofile-update=atomic)
  add_link_options(--coverage)
endif()

add_library(breakshot_compile INTERFACE)
target_compile_options(breakshot_compile INTERFACE
  -Wall -Wextra -Wpedantic -Wconversion -Wshadow -Wnon-virtual-dtor -Wold-style-cast -Woverloaded-virtual -Wcast-align
  $<$<CXX_COMPILER_ID:GNU>:-Wduplicated-cond> $<$<CXX_COMPILER_ID:GNU>:-Wlogical-op> -Wformat=2 -Wimplicit-fallthrough
  $<$<BOOL:${BREAKSHOT_WERROR}>:-Werror>
  -fstack-protector-strong)
target_compile_definitions(breakshot_compile INTERFACE $<$<CONFIG:Debug>:_GLIBCXX_ASSERTIONS>)
# Headers are named from the repository's root ("controller/motion/stroke_planner.hpp"), so an include says which folder it reaches into.
target_include_directories(breakshot_compile INTERFACE ${PROJECT_SOURCE_DIR})
