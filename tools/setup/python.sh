# Sourced by ./breakshot: the Python environment of tests/interop, in build/venv.

make_venv() {
  rm -rf "$root/build/venv"
  /usr/bin/python3 -m venv "$root/build/venv" && "$root/build/venv/bin/pip" install -r "$root/tools/setup/requirements.txt"
}

install_python() {
  cmp -s "$root/build/venv/requirements.txt" "$root/tools/setup/requirements.txt" && return 0
  step python "Installing ROS 2 (rclpy) and Cyclone DDS for the tests, into build/venv" "check the network and pip's configuration (pip config list); then run the same command again" make_venv
  cp "$root/tools/setup/requirements.txt" "$root/build/venv/requirements.txt"
}
