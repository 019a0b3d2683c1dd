# Writes OUTPUT, a header with the commit of the tree SOURCE ("+changes" when it was edited since; "unknown" when
# there is no git or the tree is no checkout). Run at every build; the file is touched only when its text changes.
set(hash unknown)
find_program(git git)
if(git AND EXISTS ${SOURCE}/.git)
  execute_process(COMMAND ${git} -C ${SOURCE} describe --always --abbrev=12 --exclude * --dirty=+changes
                  OUTPUT_VARIABLE found RESULT_VARIABLE failed ERROR_QUIET OUTPUT_STRIP_TRAILING_WHITESPACE)
  if(NOT failed)
    set(hash ${found})
  endif()
endif()
file(CONFIGURE OUTPUT ${OUTPUT} CONTENT "#define TUBULE_GIT_HASH \"${hash}\"\n")
