# Writes a C++ source that holds text files as strings:
# cmake -DOUTPUT=x.cpp "-DFILES=name=path;name=path" -P embed_files.cmake
set(source "#include \"cli/report_assets.h\"\n\nnamespace naturel {\n\n")
foreach(pair IN LISTS FILES)
    string(REGEX MATCH "^([^=]+)=(.*)$" matched "${pair}")
    set(name ${CMAKE_MATCH_1})
    file(READ "${CMAKE_MATCH_2}" text)
    # A source map is a file beside the script that a browser's inspector would ask for.
    string(REGEX REPLACE "//# sourceMappingURL=[^\n]*" "" text "${text}")
    string(APPEND source "const std::string_view ${name} = R\"naturel_file(${text})naturel_file\";\n\n")
endforeach()
string(APPEND source "}  // namespace naturel\n")
file(WRITE "${OUTPUT}" "${source}")
