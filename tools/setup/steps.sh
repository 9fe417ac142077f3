# Sourced by ./breakshot and its parts: how a step says what it does, and what went wrong.

if [ -t 1 ]; then bold=$'\e[1m' red=$'\e[31m' green=$'\e[32m' plain=$'\e[0m'; else bold='' red='' green='' plain=''; fi

say() { printf '%s\n' "$*"; }
note() { printf '%s==>%s %s\n' "$bold" "$plain" "$*"; }

# fail MESSAGE [WHAT TO DO]: ends the script.
fail() {
  printf '%sbreakshot: %s%s\n' "$red" "$1" "$plain" >&2
  [ $# -lt 2 ] || printf '  what to do: %s\n' "$2" >&2
  exit 1
}

# step NAME "What it does" "what to do if it fails" COMMAND...: runs the command with its output in build/log/NAME.log, and says how long it took.
step() {
  local name=$1 what=$2 advice=$3 log status=0 begin=$SECONDS
  shift 3
  mkdir -p "$root/build/log"
  log="$root/build/log/$name.log"
  note "$what ..."
  "$@" >"$log" 2>&1 </dev/null || status=$?
  if [ "$status" -ne 0 ]; then
    printf '%sFailed after %d s (exit status %d). The last lines of %s:%s\n' "$red" $((SECONDS - begin)) "$status" "$log" "$plain" >&2
    tail -n 20 "$log" | sed 's/^/    /' >&2
    fail "this step failed: $what" "$advice"
  fi
  say "    done in $((SECONDS - begin)) s"
}
