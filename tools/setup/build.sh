# Sourced by ./breakshot: configuring and building.

presets=(release debug asan tsan coverage fuzz)

# So that a clone in another folder finds what this one compiled.
export CCACHE_BASEDIR=$root CCACHE_NOHASHDIR=1

# Compiler processes: one per core, but no more than memory allows (1.5 GiB each, as the largest of our files take).
build_jobs() {
  local cores memory
  cores=$(nproc)
  memory=$(awk '/MemAvailable/ {print int($2 / 1572864)}' /proc/meminfo)
  [ "$memory" -ge 1 ] || memory=1
  echo $((cores < memory ? cores : memory))
}

configure() { cmake --preset "$1" -S "$root"; }
compile() { cmake --build "$root/build/$1" --parallel "$(build_jobs)" --target "${@:2}"; }

# build PRESET TARGET...: says nothing when there is nothing to do.
build() {
  local preset=$1
  shift
  case " ${presets[*]} " in *" $preset "*) ;; *) fail "there is no preset \"$preset\"" "choose one of: ${presets[*]}" ;; esac
  if [ ! -f "$root/build/$preset/build.ninja" ]; then
    step "configure-$preset" "Configuring the $preset build" "read the log; a package that CMake does not find is installed by: ./breakshot setup" configure "$preset"
  fi
  # A dry run tells in a moment whether anything is out of date.
  if ninja -C "$root/build/$preset" -n "$@" 2>/dev/null | grep -q 'no work to do'; then return 0; fi
  step "build-$preset" "Building ($preset, $(build_jobs) at a time; the first time takes several minutes)" "read the log: the first \"error:\" in it is what counts" compile "$preset" "$@"
}
