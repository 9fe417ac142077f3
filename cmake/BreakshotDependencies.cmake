# All third-party packages. `./breakshot setup` installs them on Debian 12; versions are Debian 12's unless said otherwise.

find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)                                  # libeigen3-dev
find_package(OpenCV 4.6 REQUIRED COMPONENTS core imgproc imgcodecs calib3d aruco)  # libopencv-dev (aruco: libopencv-contrib-dev, which it brings)
find_package(fastcdr REQUIRED)                                               # libfastcdr-dev
find_package(fastrtps 2.9 REQUIRED)                                          # libfastrtps-dev (Fast DDS)
find_package(orocos_kdl REQUIRED)                                            # liborocos-kdl-dev
find_package(urdfdom REQUIRED)                                               # liburdfdom-dev
find_package(fmt REQUIRED)                                                   # libfmt-dev
find_package(tinyxml2 REQUIRED)                                              # libtinyxml2-dev
find_package(spdlog REQUIRED)                                                # libspdlog-dev
find_package(yaml-cpp 0.7 REQUIRED)                                          # libyaml-cpp-dev
find_package(ZLIB REQUIRED)                                                  # zlib1g-dev
find_package(CLI11 2.1 REQUIRED)                                             # libcli11-dev
find_package(nlohmann_json 3.11 REQUIRED)                                    # nlohmann-json3-dev
find_package(GTest 1.12 REQUIRED)                                            # libgtest-dev, libgmock-dev
find_package(benchmark 1.7 REQUIRED)                                         # libbenchmark-dev
find_package(box2d 2.4 REQUIRED)                                             # libbox2d-dev (bench world only)
find_package(PkgConfig REQUIRED)
pkg_check_modules(ODE REQUIRED IMPORTED_TARGET ode)                          # libode-dev
pkg_check_modules(EGL REQUIRED IMPORTED_TARGET egl)                          # libegl-dev
pkg_check_modules(GLES REQUIRED IMPORTED_TARGET glesv2)                      # libgles-dev
pkg_check_modules(SYSTEMD REQUIRED IMPORTED_TARGET libsystemd)               # libsystemd-dev

find_program(FASTDDSGEN fastddsgen REQUIRED)                                 # fastddsgen

# ruckig is not in Debian: `./breakshot setup` builds the pinned source distribution from PyPI into build/deps (see tools/setup/).
find_package(ruckig 0.19 REQUIRED HINTS ${PROJECT_SOURCE_DIR}/build/deps)
