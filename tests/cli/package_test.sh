#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Goal: the Debian package has all that the program needs: installed by dpkg it makes a database,
#   takes photos and serves them, as the user and with the folders that the package makes; its unit
#   is one that systemd takes, and lets the daemon do little else; its manual page and completions
#   name every command.
# Method: a copy of this machine's root that takes no space (overlayfs), in a mount namespace of its
#   own, in which the sources and the build are hidden. Skipped (77) where that cannot be made.
# usage: tests/cli/package_test.sh BUILD VEDUTA_STREET
set -euo pipefail

fail() { echo "FAILED: $*" >&2; exit 1; }
skip() { echo "SKIPPED: $*"; exit 77; }

if [[ "${1-}" != --inside ]]; then
  build=$1 street=$2
  [[ "$(id -u)" = 0 ]] || skip "making a root to install into takes root"
  for tool in cpack dpkg dpkg-shlibdeps unshare chroot; do
    command -v "$tool" > /dev/null || skip "there is no $tool"
  done
  unshare -m true 2> /dev/null || skip "no mount namespaces here"
  work=$(mktemp -d "${TMPDIR:-/tmp}/veduta_package_XXXXXX")
  trap 'rm -rf "$work"' EXIT
  (cd "$build" && cpack -B "$work/packed" > "$work/cpack.log" 2>&1) ||
    { cat "$work/cpack.log" >&2; fail "cpack"; }
  "$street" "$work/street" --photos 6 --size 512x384 --quiet > /dev/null
  source=$(sed -n 's/^CMAKE_HOME_DIRECTORY:INTERNAL=//p' "$build/CMakeCache.txt")
  mkdir "$work/root"
  code=0
  unshare -m "$0" --inside "$work" "$source" || code=$?
  exit "$code"
fi

work=$2 source=$3 root=$2/root
mount -t tmpfs tmpfs "$work/root" 2> /dev/null || skip "no tmpfs can be mounted here"
mkdir "$root/up" "$root/work" "$root/root"
mount -t overlay overlay -o "lowerdir=/,upperdir=$root/up,workdir=$root/work" "$root/root" \
  2> /dev/null || skip "no overlayfs can be mounted here"
root=$root/root
mount --rbind /proc "$root/proc"
mount --rbind /dev "$root/dev"
for hidden in /run /tmp "$source"; do
  mkdir -p "$root$hidden"
  mount -t tmpfs tmpfs "$root$hidden"
done
chmod 1777 "$root/tmp"
cp "$work"/packed/veduta_*.deb "$work/street/photos"/*.jpg "$root/tmp"
in_root() { chroot "$root" "$@"; }
as_veduta() { chroot "$root" runuser -u veduta -- "$@"; }

in_root bash -c 'dpkg -i /tmp/veduta_*.deb' > "$work/dpkg.log" 2>&1 ||
  { cat "$work/dpkg.log" >&2; fail "dpkg -i"; }
in_root bash -c 'ldd /usr/bin/veduta | grep "not found"' && fail "a library is missing"
[[ "$(in_root which veduta)" = /usr/bin/veduta ]] || fail "another veduta is found"
[[ "$(in_root stat -c '%U %a' /var/lib/veduta)" = "veduta 700" ]] || fail "/var/lib/veduta"

db=/var/lib/veduta/city
as_veduta veduta init "$db"
as_veduta veduta camera add "$db" c --size 512x384 --params 450.56,450.56,255.5,191.5
as_veduta python3 - "$db" <<'SERVED'
import json, os, signal, socket, subprocess, sys, urllib.request
notices = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
notices.bind('/tmp/notices')
notices.settimeout(60)
daemon = subprocess.Popen(['veduta', 'serve', sys.argv[1], '--http', '127.0.0.1:0', '--json',
                           '--log', 'json'], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                          env={**os.environ, 'NOTIFY_SOCKET': '/tmp/notices'})
assert notices.recv(100) == b'READY=1'
address = json.loads(daemon.stdout.readline())['http']
page = urllib.request.urlopen(address + '/').read()
assert b'<title>' in page and urllib.request.urlopen(address + '/page.js').read()
for n in range(1, 7):
    subprocess.run(['veduta', 'add', sys.argv[1], '--camera', 'c', f'/tmp/photo{n:04}.jpg'],
                   check=True, capture_output=True)
status = json.load(urllib.request.urlopen(address + '/v1/status'))
assert status['images'] == 6 and status['placed'] >= 3, status
subprocess.run(['veduta', 'densify', sys.argv[1], '--size', '64', '--device', 'cpp'], check=True,
               capture_output=True)
subprocess.run(['veduta', 'backup', sys.argv[1], '/var/lib/veduta/backups'], check=True,
               capture_output=True)
daemon.send_signal(signal.SIGTERM)
assert notices.recv(100) == b'STOPPING=1'
_, log = daemon.communicate(timeout=60)
assert daemon.returncode == 0, log
routes = {json.loads(line).get('route') for line in log.splitlines() if line.startswith(b'{')}
assert {'/', '/page.js', '/v1/photos', '/v1/status', '/v1/densify'} <= routes, routes
SERVED
as_veduta veduta restore /var/lib/veduta/backups /var/lib/veduta/restored > /dev/null
[[ "$(as_veduta veduta digest "$db")" = "$(as_veduta veduta digest /var/lib/veduta/restored)" ]] ||
  fail "the digests differ"

# Every command is in the manual page, and completed.
manual=$(in_root zcat -f /usr/share/man/man1/veduta.1)
for command in $(in_root veduta --help | sed '1,/^Subcommands:/d' | grep -oE '^  [a-z]+'); do
  grep -qE "^\.SS \"veduta $command[ \"]" <<< "$manual" || fail "no $command in the manual page"
  in_root bash -c '. /usr/share/bash-completion/completions/veduta
    COMP_WORDS=(veduta "$1"); COMP_CWORD=1; _veduta
    [[ " ${COMPREPLY[*]} " == *" $1 "* ]]' bash "$command" || fail "$command is not completed"
done
# The same by zsh, whose own completion is played by three functions that print what they are given.
cat > "$root/tmp/complete.zsh" <<'COMPLETE'
compdef() { : }
_describe() { print -rl -- "${(@P)@[-1]}" }
_files() { print files }
. /usr/share/zsh/vendor-completions/_veduta
words=("$@") CURRENT=$# PREFIX=${@[-1]}
_veduta
COMPLETE
if command -v zsh > /dev/null; then
  by_zsh() { in_root zsh -f /tmp/complete.zsh veduta "$@"; }
  [[ "$(by_zsh '' | cut -d: -f1)" = "$(in_root veduta --help | sed '1,/^Subcommands:/d' |
    grep -oE '^  [a-z]+' | tr -d ' ')" ]] || fail "zsh completes other commands"
  grep -q '^create:Make a token' <<< "$(by_zsh token '')" || fail "zsh: no 'token create'"
  grep -q '^--role:' <<< "$(by_zsh token create --)" || fail "zsh: no 'token create --role'"
  [[ "$(by_zsh show '')" = files ]] || fail "zsh: no files"
else
  echo "there is no zsh: its completions were not tried"
fi
if command -v groff > /dev/null; then
  warnings=$(groff -man -ww -z <<< "$manual" 2>&1)
  [[ -z "$warnings" ]] || fail "groff says of the manual page: $warnings"
fi

unit=/lib/systemd/system/veduta@.service
if in_root systemd-analyze --version > /dev/null 2>&1; then
  in_root cp "$unit" /tmp/veduta@city.service
  in_root systemd-analyze verify --man=no /tmp/veduta@city.service || fail "the unit"
  # Of 10, in which 10 is a daemon that may do anything.
  in_root systemd-analyze security --offline=true --threshold=15 --no-pager \
    /tmp/veduta@city.service > "$work/security" || { cat "$work/security"; fail "security"; }
  tail -n 1 "$work/security"
else
  in_root test -s "$unit" || fail "there is no unit"
  echo "there is no systemd-analyze: the unit was not checked"
fi

in_root dpkg -r veduta > /dev/null 2>&1 || fail "dpkg -r"
[[ ! -e "$root/usr/bin/veduta" ]] || fail "the program stays when it is removed"
[[ -e "$root$db/VEDUTA" ]] || fail "the database went with the program"
echo "installed, run and removed: $(basename "$work"/packed/veduta_*.deb)"
