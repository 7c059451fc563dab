# docs/parameters.md says what the parameter table says.
execute_process(COMMAND ${VIRGA} info --parameters OUTPUT_VARIABLE now COMMAND_ERROR_IS_FATAL ANY)
file(READ ${PAGE} page)
if(NOT now STREQUAL page)
  message(FATAL_ERROR "${PAGE} is not what the parameter table says: virga info --parameters > docs/parameters.md")
endif()
