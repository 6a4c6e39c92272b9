# pbm_embed_hex(TARGET INPUT OUTPUT): a text file of bytes in hexadecimal digits (lines that start with # are comments)
# becomes OUTPUT, a list of C++ integers that TARGET can #include between braces. Made anew when INPUT changes.
function(pbm_embed_hex target input output)
    set(source ${CMAKE_CURRENT_SOURCE_DIR}/${input})
    set(folder ${CMAKE_CURRENT_BINARY_DIR}/embedded)
    add_custom_command(OUTPUT ${folder}/${output}
        COMMAND ${CMAKE_COMMAND} -DINPUT=${source} -DOUTPUT=${folder}/${output}
            -P ${PROJECT_SOURCE_DIR}/cmake/PbmEmbedHex.cmake
        DEPENDS ${source} ${PROJECT_SOURCE_DIR}/cmake/PbmEmbedHex.cmake
        COMMENT "Embedding ${input}" VERBATIM)
    target_sources(${target} PRIVATE ${folder}/${output})
    target_include_directories(${target} PRIVATE ${folder})
endfunction()

# As a script (cmake -P): does the work.
if(CMAKE_SCRIPT_MODE_FILE)
    file(READ ${INPUT} text)
    string(REGEX REPLACE "#[^\n]*\n" "" digits "${text}")
    string(REGEX REPLACE "[ \r\n]" "" digits "${digits}")
    if(digits MATCHES "[^0-9a-f]")
        message(FATAL_ERROR "${INPUT}: '${CMAKE_MATCH_0}' is no hexadecimal digit")
    endif()
    string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${digits}")
    string(REGEX REPLACE "(0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,)" "\\1\n" bytes "${bytes}")
    file(WRITE ${OUTPUT} "${bytes}")
endif()
