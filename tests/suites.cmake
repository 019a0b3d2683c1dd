# The fast suites of a GoogleTest program, each a test of ctest:
# cmake -D PROGRAM=file -D PREFIX=name -D TIMEOUT=seconds -D OUTPUT=file -P suites.cmake
execute_process(COMMAND ${PROGRAM} --gtest_list_tests --gtest_filter=-*Study.* OUTPUT_VARIABLE lines COMMAND_ERROR_IS_FATAL ANY)
string(REGEX MATCHALL "(^|\n)[A-Za-z0-9_/]+\\." suites "${lines}")
set(tests "")
foreach(suite ${suites})
  string(REGEX REPLACE "\n|\\.$" "" suite ${suite})
  string(APPEND tests "add_test([[${PREFIX}.${suite}]] [[${PROGRAM}]] [[--gtest_filter=${suite}.*]])\n"
    "set_tests_properties([[${PREFIX}.${suite}]] PROPERTIES LABELS fast TIMEOUT ${TIMEOUT})\n")
endforeach()
file(WRITE ${OUTPUT} "${tests}")
