# fastddsgen 2.3 catches only NotEnoughMemoryException round (de)serialisation; a malformed sample from the network can throw others, in
# Fast DDS's receive thread, which ends the process (measured). Both derive from fastcdr::exception::Exception: catch that instead.
file(READ ${FILE} text)
string(REPLACE "eprosima::fastcdr::exception::NotEnoughMemoryException&" "eprosima::fastcdr::exception::Exception&" patched "${text}")
if(patched STREQUAL text)
  message(FATAL_ERROR "${FILE}: no NotEnoughMemoryException to widen; has fastddsgen changed? See idl/catch_all_cdr.cmake")
endif()
string(REPLACE "#include <fastcdr/Cdr.h>" "#include <fastcdr/Cdr.h>\n#include <fastcdr/exceptions/Exception.h>" patched "${patched}")
file(WRITE ${FILE} "${patched}")
