#!/bin/bash
# The installed cell under a real systemd: comes up, survives a killed process, goes down and leaves nothing. Argument: a build folder.
set -u
build=$1
here=$(cd "$(dirname "$0")" && pwd)
services=(sim_bridge controller perception planner mes_gateway)

skip() { echo "skipped: $1"; exit 77; }
[ "$(id -u)" -eq 0 ] || skip "namespaces with a systemd of their own need root"
unshare --mount --pid --uts --ipc --cgroup --fork --kill-child true 2>/dev/null || skip "unshare is not permitted here"
[ -x /lib/systemd/systemd ] || skip "systemd is not installed"

stage=$(mktemp -d)
sandbox=''
cleanup() {
  [ -z "$sandbox" ] || kill -9 "$sandbox" 2>/dev/null
  while kill -0 "$sandbox" 2>/dev/null; do sleep 0.1; done
  rm -rf "$stage"
}
trap cleanup EXIT

DESTDIR=$stage cmake --install "$build" --prefix /opt/breakshot >"$stage/install.log" || { cat "$stage/install.log"; exit 1; }
# DDS domains of this test's own, since the network is the host's; lockstep, so that the outcome does not depend on the machine's load.
sed -i -E 's/^( *mode:) *real_time/\1 lockstep/; s/^( *cell_domain:) *[0-9]+/\1 221/; s/^( *mes_domain:) *[0-9]+/\1 222/' "$stage/opt/breakshot/etc/cell.yaml"
# LeakSanitizer, where a build has it, looks by ptrace, which the units forbid.
printf '[Service]\nEnvironment=ASAN_OPTIONS=detect_leaks=0\n' >"$stage/opt/breakshot/lib/systemd/system/breakshot-.service.d/sanitizer.conf"

STAGE=$stage unshare --mount --pid --uts --ipc --cgroup --fork --kill-child "$here/systemd_sandbox.sh" >"$stage/systemd.log" 2>&1 &
sandbox=$!
disown

inside() { nsenter -t "$init" -m -p -u -i -C -- "$@"; }
# property UNIT NAME
property() { inside systemctl show "breakshot-$1.service" -P "$2" 2>/dev/null; }
# wait_for SECONDS WHAT COMMAND...: until the command succeeds.
wait_for() {
  local until=$((SECONDS + $1)) what=$2
  shift 2
  until "$@"; do
    if [ $SECONDS -ge $until ]; then
      echo "FAILED: $what"
      inside systemctl status 'breakshot*' --no-pager -n 15 2>&1 | tail -n 150
      cat "$stage/systemd.log"
      exit 1
    fi
    sleep 0.1
  done
  echo "ok: $what"
}
find_init() { init=$(pgrep -P "$sandbox" 2>/dev/null) && inside systemctl is-system-running 2>/dev/null | grep -qE 'running|starting|degraded'; }
all_active() { for service in "${services[@]}"; do [ "$(property "$service" ActiveState)" = active ] || return 1; done; }
all_inactive() { for service in "${services[@]}"; do [ "$(property "$service" ActiveState)" = inactive ] || return 1; done; }
restarted() { [ "$(property planner NRestarts)" = 1 ] && [ "$(property planner ActiveState)" = active ] && [ "$(property planner MainPID)" != "$killed" ]; }
nothing_left() { ! inside pgrep -u breakshot >/dev/null && [ -z "$(inside find /dev/shm -name 'fast*')" ]; }

wait_for 20 "systemd is up" find_init
inside systemctl --no-block start breakshot.target
wait_for 90 "every process is READY" all_active
for service in "${services[@]}"; do echo "    $service: $(property "$service" StatusText), user $(property "$service" User)"; done

if inside /opt/breakshot/bin/breakshot-client --config /opt/breakshot/etc/cell.yaml order >"$stage/order.log" 2>&1; then
  echo "ok: an order is carried out inside the units' sandbox"
else
  echo "FAILED: an order is carried out inside the units' sandbox"
  cat "$stage/order.log"
  exit 1
fi

killed=$(property planner MainPID)
inside systemctl kill --signal=KILL breakshot-planner.service
wait_for 60 "a killed planner is READY again" restarted

inside systemctl --no-block stop breakshot.target
wait_for 40 "every process has stopped cleanly" all_inactive
inside systemctl start breakshot-shm-clean.service
wait_for 10 "no process and no shared memory is left" nothing_left
