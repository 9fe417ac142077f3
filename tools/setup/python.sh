# Sourced by ./breakshot: the Python environments of tests/interop (build/venv) and of tools/plots (build/plots-venv).

# make_venv FOLDER REQUIREMENTS
make_venv() {
  rm -rf "$1"
  /usr/bin/python3 -m venv "$1" && "$1/bin/pip" install -r "$2"
}

# install_venv NAME WHAT REQUIREMENTS: nothing when build/NAME was made from the same requirements.
install_venv() {
  local folder=$root/build/$1
  cmp -s "$folder/requirements.txt" "$3" && return 0
  step "python-$1" "Installing $2, into build/$1" "check the network and pip's configuration (pip config list); then run the same command again" make_venv "$folder" "$3"
  cp "$3" "$folder/requirements.txt"
}

install_python() { install_venv venv "ROS 2 (rclpy) and Cyclone DDS for the tests" "$root/tools/setup/requirements.txt"; }
install_plots() { install_venv plots-venv "matplotlib" "$root/tools/plots/requirements.txt"; }
