# Sourced by ./breakshot: the fuzzers of tests/fuzz. Their compiler and its runtime are installed for them only.

fuzz_packages=(clang-14 libclang-rt-14-dev)
fuzzers=(image_file frame camera_file cell_file urdf_file formation_file)

install_fuzz() {
  local missing
  missing=$(missing_packages "${fuzz_packages[@]}")
  [ -z "$missing" ] || apt_install $missing
}

# Folders of inputs that a fuzzer begins with: its own, and what the repository ships of the kind.
fuzz_seeds() {
  local own=$root/tests/fuzz/corpus/$1
  [ ! -d "$own" ] || echo "$own"
  case $1 in
    camera_file) echo "$root/config/cameras" ;;
    formation_file) echo "$root/config/formations" ;;
    urdf_file) echo "$root/config/arms" && echo "$root/tests/support/arms" ;;
    cell_file)
      # Of cell.yaml the one section that is read here: shorter inputs go faster.
      local folder=$root/build/fuzz/seeds/cell_file
      mkdir -p "$folder"
      awk '/^[a-z_]+:/ {inside = /^cell:/} inside' "$root/config/cell.yaml" >"$folder/cell.yaml"
      echo "$folder" ;;
  esac
}

# run_fuzzer NAME SECONDS: what it finds goes to build/fuzz/found, what it learns to build/fuzz/corpus.
run_fuzzer() {
  local name=$1 corpus=$root/build/fuzz/corpus/$1 found=$root/build/fuzz/found log=$root/build/log/fuzz-$1.log seeds status=0
  mkdir -p "$corpus" "$found" "$root/build/log"
  mapfile -t seeds < <(fuzz_seeds "$name")
  note "Fuzzing $name for $2 s ..."
  nice -n 10 "$root/build/fuzz/bin/fuzz-$name" -max_total_time="$2" -timeout=20 -rss_limit_mb=3000 -print_final_stats=1 -verbosity=0 \
    -artifact_prefix="$found/$name-" "$corpus" "${seeds[@]}" >"$log" 2>&1 || status=$?
  sed -nE 's/^stat::(number_of_executed_units|average_exec_per_sec|peak_rss_mb): */    \1 /p' "$log"
  [ $status -eq 0 ] || fail "$name found something: $(sed -nE 's/^(SUMMARY.*|.*Test unit written to .*)$/\1/p' "$log" | tr '\n' ' ')" "read $log; the input reproduces it: build/fuzz/bin/fuzz-$name FILE"
  say "    nothing found"
}
