# SPDX-License-Identifier: GPL-3.0-or-later
# Install libraries, headers and programs, with a CMake package (felmi) and pkg-config files.
include(CMakePackageConfigHelpers)

install(TARGETS demC couplingLib caseLib particlePhase
        EXPORT felmi
        LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(FILES src/demC/dem.h src/couplingLib/cpl.h src/caseLib/case.h src/particlePhase/phase.h
        DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/felmi)

# the scripts find each other by their own folder
install(DIRECTORY applications/utilities/plot DESTINATION ${CMAKE_INSTALL_BINDIR}
        PATTERN __pycache__ EXCLUDE)
install(PROGRAMS applications/utilities/felmiPython applications/utilities/felmiPlotParticles
                 applications/utilities/felmiPlotSeries DESTINATION ${CMAKE_INSTALL_BINDIR})

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/felmi)
install(EXPORT felmi NAMESPACE felmi:: FILE felmiTargets.cmake DESTINATION ${package_dir})
configure_package_config_file(cmake/felmiConfig.cmake.in felmiConfig.cmake
                              INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(felmiConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/felmiConfig.cmake ${PROJECT_BINARY_DIR}/felmiConfigVersion.cmake
        DESTINATION ${package_dir})

# pkg-config: name, what it is, what a user of the header needs besides
# The prefix is where the file stands, as install --prefix may be given later than configure.
file(RELATIVE_PATH PC_PREFIX /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
function(pkg_config_file name description requires libs)
    set(PC_NAME ${name})
    set(PC_DESCRIPTION ${description})
    set(PC_REQUIRES ${requires})
    set(PC_LIBS ${libs})
    configure_file(cmake/pkgconfig.pc.in ${name}.pc @ONLY)
    install(FILES ${PROJECT_BINARY_DIR}/${name}.pc
            DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
endfunction()
pkg_config_file(demC "Discrete element engine" "ompi-c" "-ldemC")
pkg_config_file(couplingLib "Particle-fluid coupling on arrays" "ompi-c" "-lcouplingLib")
pkg_config_file(caseLib "Reader of case directories" "demC couplingLib" "-lcaseLib")
pkg_config_file(particlePhase "The particle phase of a coupled flow solver" "demC couplingLib"
                "-lparticlePhase")
