# Installs the build tree BUILD below WORK, builds the program in SOURCE against it in both ways, runs it.
set(prefix ${WORK}/prefix)
file(REMOVE_RECURSE ${WORK})

function(run)
  execute_process(COMMAND ${ARGN} COMMAND_ECHO STDOUT COMMAND_ERROR_IS_FATAL ANY)
endfunction()

run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${prefix})
foreach(file bin/virga ${LIBDIR}/libvirga.so ${INCLUDEDIR}/virga/virga.h ${LIBDIR}/pkgconfig/virga.pc)
  if(NOT EXISTS ${prefix}/${file})
    message(FATAL_ERROR "cmake --install left out ${file}")
  endif()
endforeach()
run(${prefix}/bin/virga --version)

set(flags "")
if(SANITIZE)
  set(flags -fsanitize=${SANITIZE})
endif()
run(${CMAKE_COMMAND} -S ${SOURCE} -B ${WORK}/cmake -G Ninja -DCMAKE_PREFIX_PATH=${prefix} -DCMAKE_C_COMPILER=${CC}
    -DCMAKE_C_FLAGS=${flags} -DVIRGA_WANTED=${VERSION})
run(${CMAKE_COMMAND} --build ${WORK}/cmake)
run(${WORK}/cmake/consumer)

set(ENV{PKG_CONFIG_PATH} ${prefix}/${LIBDIR}/pkgconfig)
execute_process(COMMAND pkg-config --cflags --libs virga OUTPUT_VARIABLE words OUTPUT_STRIP_TRAILING_WHITESPACE
                COMMAND_ERROR_IS_FATAL ANY)
separate_arguments(words)
run(${CC} -std=c99 -Wall -Wextra -Wpedantic -Werror ${flags} ${SOURCE}/consumer.c -o ${WORK}/consumer ${words}
    -Wl,-rpath,${prefix}/${LIBDIR})
run(${WORK}/consumer brief)
