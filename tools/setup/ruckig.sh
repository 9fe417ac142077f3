# Sourced by ./breakshot: ruckig, which Debian does not have. CMake finds one that the system has, or ours in build/deps.

ruckig_is_there() { [ -f "$root/build/deps/.ruckig" ] && cmp -s "$root/build/deps/.ruckig" "$root/tools/setup/ruckig.txt"; }

# Asks CMake, as our own configuration will.
system_has_ruckig() {
  local folder
  folder=$(mktemp -d)
  printf 'cmake_minimum_required(VERSION 3.25)\nproject(ask LANGUAGES CXX)\nfind_package(ruckig 0.19 REQUIRED)\n' >"$folder/CMakeLists.txt"
  local status=0
  cmake -S "$folder" -B "$folder/build" -G Ninja >/dev/null 2>&1 || status=$?
  rm -rf "$folder"
  return $status
}

fetch_ruckig() {
  rm -rf "$root/build/deps/src"
  mkdir -p "$root/build/deps/src"
  # Only ruckig from source: with ":all:" pip would build even its own build tools, for many minutes.
  PIP_CONSTRAINT="$root/tools/setup/ruckig-metadata.txt" /usr/bin/python3 -m pip download --no-binary ruckig --no-deps --require-hashes \
    -r "$root/tools/setup/ruckig.txt" -d "$root/build/deps/src"
  tar -xzf "$root"/build/deps/src/ruckig-*.tar.gz -C "$root/build/deps/src"
}

build_ruckig() {
  local source
  source=$(echo "$root"/build/deps/src/ruckig-*/)
  # The cloud client would add heap use and network calls to a library that runs beside a real-time loop.
  cmake -S "$source" -B "$root/build/deps/build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_INSTALL_PREFIX="$root/build/deps" \
    -DCMAKE_INSTALL_LIBDIR=lib -DBUILD_CLOUD_CLIENT=OFF -DBUILD_EXAMPLES=OFF -DBUILD_TESTS=OFF -DBUILD_PYTHON_MODULE=OFF \
    -DBUILD_SHARED_LIBS=OFF -DCMAKE_POSITION_INDEPENDENT_CODE=ON &&
    cmake --build "$root/build/deps/build" &&
    cmake --install "$root/build/deps/build"
}

install_ruckig() {
  ruckig_is_there && return 0
  if system_has_ruckig; then
    mkdir -p "$root/build/deps"
    cp "$root/tools/setup/ruckig.txt" "$root/build/deps/.ruckig"
    say "    (ruckig: the system has one)"
    return 0
  fi
  step ruckig-fetch "Fetching ruckig's source from PyPI" "check the network and pip's configuration (pip config list); then run the same command again" fetch_ruckig
  step ruckig-build "Building ruckig" "read the log" build_ruckig
  rm -rf "$root/build/deps/src" "$root/build/deps/build"
  cp "$root/tools/setup/ruckig.txt" "$root/build/deps/.ruckig"
}
