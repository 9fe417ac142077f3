# Runs at install time, when the prefix is known: puts units, user and configuration where the prefix says.
#   cmake --install build/release --prefix /opt/breakshot
set(source ${CMAKE_CURRENT_LIST_DIR})
set(target ${CMAKE_INSTALL_PREFIX})  # file(INSTALL) goes to DESTDIR by itself, configure_file() does not
file(GLOB templates ${source}/*.in)
foreach(template IN LISTS templates)
  get_filename_component(name ${template} NAME_WLE)
  message(STATUS "Installing: ${target}/lib/systemd/system/${name}")
  configure_file(${template} $ENV{DESTDIR}${target}/lib/systemd/system/${name} @ONLY)
endforeach()
file(INSTALL ${source}/breakshot-.service.d DESTINATION ${target}/lib/systemd/system)
file(INSTALL ${source}/sysusers.conf DESTINATION ${target}/lib/sysusers.d RENAME breakshot.conf)
# All that the cell reads: cell.yaml and the folders that it names.
file(GLOB configuration ${source}/../*)
list(FILTER configuration EXCLUDE REGEX "/systemd$")
file(INSTALL ${configuration} DESTINATION ${target}/etc)
file(INSTALL ${source}/../../README.md DESTINATION ${target}/share/doc/breakshot)
