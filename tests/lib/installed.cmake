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

# The example of docs/library.md: a grey picture comes back wet.
run(${CC} -std=c99 -Wall -Wextra -Wpedantic -Werror ${flags} ${EXAMPLE} -o ${WORK}/rain_on_a_frame ${words}
    -Wl,-rpath,${prefix}/${LIBDIR})
string(REPEAT "ddd" 3072 grey)  # 64 x 48
file(WRITE ${WORK}/dry.ppm "P6\n64 48\n255\n${grey}")
run(${WORK}/rain_on_a_frame ${WORK}/dry.ppm ${WORK}/wet.ppm 80)
file(SIZE ${WORK}/dry.ppm dry)
file(SIZE ${WORK}/wet.ppm wet)
file(SHA1 ${WORK}/dry.ppm dryHash)
file(SHA1 ${WORK}/wet.ppm wetHash)
if(NOT dry EQUAL wet OR dryHash STREQUAL wetHash)
  message(FATAL_ERROR "${EXAMPLE}: ${wet} bytes came out of ${dry}, changed or not")
endif()
execute_process(COMMAND ${WORK}/rain_on_a_frame ${WORK}/dry.ppm ${WORK}/wet.ppm -3 RESULT_VARIABLE code
                ERROR_VARIABLE sentence)
if(code EQUAL 0 OR NOT sentence MATCHES "rate.*-3.*0 to 2000")
  message(FATAL_ERROR "${EXAMPLE} with a rate of -3: ${code}, ${sentence}")
endif()
