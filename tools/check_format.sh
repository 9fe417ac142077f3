#!/usr/bin/env bash
# Checks that every C++ source is formatted as .clang-format says; with --fix it formats them.
set -euo pipefail
cd "$(dirname "$0")/.."
mapfile -t files < <(git ls-files -- '*.cpp' '*.hpp')
if [ "${1:-}" = --fix ]; then
  clang-format-14 -i "${files[@]}"
  exit 0
fi
unformatted=$(clang-format-14 --dry-run "${files[@]}" 2>&1 | sed -nE 's/^([^:]+):[0-9]+:[0-9]+: .*-Wclang-format-violations.*/\1/p' | sort -u)
if [ -n "$unformatted" ]; then
  printf 'not formatted (tools/check_format.sh --fix mends it):\n%s\n' "$unformatted" >&2
  exit 1
fi
echo "format: ${#files[@]} files as .clang-format says"
