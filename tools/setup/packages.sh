# Sourced by ./breakshot: the Debian packages of tools/setup/packages.txt.

wanted_packages() { sed 's/#.*//' "$root/tools/setup/packages.txt" | tr -s ' \n' '\n\n' | sed '/^$/d'; }

# missing_packages [PACKAGE...]: those of the list, or of the arguments, that are not installed. Asks dpkg only: no network, some 50 ms.
missing_packages() {
  local wanted
  wanted=$({ [ $# -gt 0 ] && printf '%s\n' "$@" || wanted_packages; } | sort)
  # shellcheck disable=SC2086 # one word per package
  comm -23 <(printf '%s\n' $wanted) <(dpkg-query -W -f '${db:Status-Status} ${Package}\n' $wanted 2>/dev/null | sed -n 's/^installed //p' | sort -u)
}

install_packages() {
  command -v dpkg-query >/dev/null || fail "this is not a Debian system: dpkg-query is not here" "use Debian 12, or install the counterparts of tools/setup/packages.txt by hand"
  local missing
  missing=$(missing_packages)
  # shellcheck disable=SC2086
  [ -z "$missing" ] || apt_install $missing
}

# apt_install PACKAGE...
apt_install() {
  local missing=$* as_root=()
  if ! grep -q '^VERSION_CODENAME=bookworm' /etc/os-release 2>/dev/null; then
    say "    (this is not Debian 12 \"bookworm\", for which breakshot is made; going on with what apt has)"
  fi
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || fail "these Debian packages are missing, and neither root nor sudo is at hand: $(echo $missing)" "as root: apt-get install --no-install-recommends $(echo $missing)"
    as_root=(sudo)
    sudo -v || fail "sudo refused" "as root: apt-get install --no-install-recommends $(echo $missing)"
  fi
  local count
  count=$#
  step apt-update "Reading Debian's package lists" "check the network and /etc/apt/sources.list; then run the same command again" \
    "${as_root[@]}" apt-get -o DPkg::Lock::Timeout=300 update
  # shellcheck disable=SC2086
  step apt-install "Installing $count Debian packages and what they need" "check the network and the log; if a package is not found, check that /etc/apt/sources.list names Debian 12 \"main\"" \
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -o DPkg::Lock::Timeout=300 install -y --no-install-recommends $missing
}
