# Writes build_info.f90 at each build, with the commit and the digest of the sources as they are then;
# a file that would not change is left alone. Takes SOURCE, TEMPLATE and OUTPUT.
execute_process(COMMAND git rev-parse --short HEAD WORKING_DIRECTORY ${SOURCE}
                OUTPUT_VARIABLE GIT_COMMIT OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
if(GIT_COMMIT STREQUAL "")
  set(GIT_COMMIT "commit unknown")      # the sources of an archive
endif()
file(GLOB_RECURSE files RELATIVE ${SOURCE} ${SOURCE}/src/*.f90 ${SOURCE}/src/*.F90
     ${SOURCE}/src/*.inc ${SOURCE}/src/*.in ${SOURCE}/src/CMakeLists.txt)
list(FILTER files EXCLUDE REGEX "^src/bench/")
list(SORT files)
foreach(file CMakeLists.txt input/KEYWORDS.md ${files})
  file(SHA256 ${SOURCE}/${file} digest)
  string(APPEND digests "${file} ${digest}\n")
endforeach()
string(SHA256 SOURCE_DIGEST "${digests}")
string(SUBSTRING ${SOURCE_DIGEST} 0 16 SOURCE_DIGEST)
configure_file(${TEMPLATE} ${OUTPUT} @ONLY)
