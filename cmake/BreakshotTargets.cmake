# Three shapes of target, so that a folder's CMakeLists.txt says only what is in it and what it may know.

# breakshot_library(NAME SOURCES ... PUBLIC deps... PRIVATE deps...): a static library breakshot_NAME.
function(breakshot_library name)
  cmake_parse_arguments(arg "" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  add_library(breakshot_${name} STATIC ${arg_SOURCES})
  target_link_libraries(breakshot_${name} PUBLIC ${arg_PUBLIC} PRIVATE breakshot_compile ${arg_PRIVATE})
  target_include_directories(breakshot_${name} PUBLIC ${PROJECT_SOURCE_DIR})
endfunction()

# breakshot_sanitized(TARGET): what an executable needs in a sanitizer's build.
if(BREAKSHOT_SANITIZE MATCHES address)
  add_library(breakshot_sanitizer_defaults OBJECT ${PROJECT_SOURCE_DIR}/cmake/sanitizer_defaults.cpp)
endif()
function(breakshot_sanitized target)
  if(TARGET breakshot_sanitizer_defaults)
    target_sources(${target} PRIVATE $<TARGET_OBJECTS:breakshot_sanitizer_defaults>)
    set_target_properties(${target} PROPERTIES ENABLE_EXPORTS ON)  # so that libraries, too, find what it overrides
  endif()
endfunction()

# Everything that runs, without the tests: what `./breakshot demo` and `up` build.
add_custom_target(breakshot_programs)

# breakshot_program(NAME SOURCES ... LINK deps...): an executable bin/breakshot-NAME. A benchmark (NAME bench-...) is built on request or with
# `all`, and is not installed.
function(breakshot_program name)
  cmake_parse_arguments(arg "" "" "SOURCES;LINK" ${ARGN})
  add_executable(breakshot-${name} ${arg_SOURCES})
  target_link_libraries(breakshot-${name} PRIVATE breakshot_compile ${arg_LINK})
  breakshot_sanitized(breakshot-${name})
  set_target_properties(breakshot-${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/bin)
  if(NOT name MATCHES "^bench-")
    add_dependencies(breakshot_programs breakshot-${name})
    install(TARGETS breakshot-${name} RUNTIME DESTINATION bin)
  endif()
endfunction()

# breakshot_test(NAME SOURCES ... LINK deps... [LABELS ...] [TIMEOUT s]): a gtest program that CTest runs whole.
# BREAKSHOT_SOURCE_DIR tells tests where config/ is.
function(breakshot_test name)
  cmake_parse_arguments(arg "" "TIMEOUT" "SOURCES;LINK;LABELS" ${ARGN})
  add_executable(${name} ${arg_SOURCES})
  target_link_libraries(${name} PRIVATE breakshot_compile ${arg_LINK} GTest::gtest GTest::gmock GTest::gtest_main)
  breakshot_sanitized(${name})
  target_compile_definitions(${name} PRIVATE BREAKSHOT_SOURCE_DIR="${PROJECT_SOURCE_DIR}" BREAKSHOT_BINARY_DIR="${PROJECT_BINARY_DIR}")
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/tests)
  add_test(NAME ${name} COMMAND ${name})
  if(NOT arg_TIMEOUT)
    set(arg_TIMEOUT 120)
  endif()
  if(BREAKSHOT_SANITIZE)
    math(EXPR arg_TIMEOUT "10 * ${arg_TIMEOUT}")
  endif()
  set_tests_properties(${name} PROPERTIES TIMEOUT ${arg_TIMEOUT} LABELS "${arg_LABELS}")
endfunction()
