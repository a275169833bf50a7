#!/usr/bin/env bash
# The container of .devcontainer/, built and used: by buildah, as root, on Debian. No registry is needed: the Debian 12 that the
# image begins with comes from debootstrap. It takes about six minutes and some GB, so it is not in scripts/test.sh.
#
#     apt-get install --no-install-recommends buildah curl debootstrap git
#     bash test/container.sh [BASE]     BASE: a folder with a Debian 12 from debootstrap; without it one is made
#
# buildah's chroot isolation needs neither a daemon nor cgroups. The container then has this machine's network and processes, so
# "outside" means: over this machine's address in its network, as a published port arrives. Publishing itself (-p), volumes that
# take over what an image holds, and VS Code are not tried.
set -euo pipefail

repo=$(CDPATH='' cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd -P)
work=$(mktemp -d "${TMPDIR:-/tmp}/tb3_labs_container.XXXXXX")
mkdir "$work/tmp"
base=${1:-$work/base}
image=localhost/tb3_labs ports=(11390 11391)
isolation=(--isolation chroot)
# Limits that this machine allows; buildah's own may be higher, and only some machines' root may raise them.
at_most() { if [ "$1" = unlimited ] || [ "$1" -gt "$2" ]; then echo "$2"; else echo "$1"; fi; }
files=$(at_most "$(ulimit -Hn)" 20000) processes=$(at_most "$(ulimit -Hu)" 32768)
limits=(--ulimit "nofile=$(at_most "$files" 1024):$files" --ulimit "nproc=$processes:$processes")

say() { printf '%4d s  %s\n' "$SECONDS" "$*"; }
fail() { echo "container.sh: $*" >&2; exit 1; }
# Storage of its own: images of the user's are neither used nor changed.
in_storage() { TMPDIR=$work/tmp buildah --root "$work/storage" --runroot "$work/runroot" "$@"; }

# The processes in the container: their root is a folder of buildah's, in $work/tmp.
inside() {
  local process
  for process in /proc/[0-9]*; do
    if [[ $(readlink "$process/root" 2>/dev/null) == "$work"/* ]]; then echo "${process#/proc/}"; fi
  done
}

end() {
  local status=$? left
  mapfile -t left < <(inside)
  if [ ${#left[@]} != 0 ]; then kill -KILL "${left[@]}" 2>/dev/null || true; sleep 1; fi
  in_storage rm -a >/dev/null 2>&1 || true
  in_storage rmi -a -f >/dev/null 2>&1 || true
  if mountpoint -q "$work/storage/overlay"; then umount "$work/storage/overlay" || true; fi
  rm -rf --one-file-system "$work" || true
  exit "$status"
}
trap end EXIT
trap 'exit 130' INT TERM HUP

[ "$EUID" = 0 ] || fail 'root is needed'
for tool in buildah curl debootstrap git; do command -v $tool >/dev/null || fail "$tool is missing: apt-get install $tool"; done

# --- the image -----------------------------------------------------------------------------------------------------
if [ ! -e "$base/etc/debian_version" ]; then
  debootstrap --variant=minbase bookworm "$base" >"$work/base.log" 2>&1 || { tail -n 3 "$work/base.log" >&2; fail 'debootstrap failed'; }
fi
begun=$(in_storage from scratch)
in_storage add -q "$begun" "$base" / >/dev/null
# A proxy's own certificate, which this machine trusts.
if [ -n "${PIP_CERT:-}" ]; then
  printf '[global]\ncert = /etc/trusted_here.crt\n' >"$work/pip.conf"
  in_storage copy -q "$begun" "$PIP_CERT" /etc/trusted_here.crt >/dev/null
  in_storage copy -q "$begun" "$work/pip.conf" /etc/pip.conf >/dev/null
fi
in_storage commit -q "$begun" docker.io/library/debian:12 >/dev/null
say "Debian 12 is there: $(in_storage images --format '{{.Size}}' docker.io/library/debian:12)"

# The files that git tracks, as a new clone has them.
git -c safe.directory='*' clone -q --no-local "$repo" "$work/clone"
# It also has changes that are not committed yet.
git -c safe.directory='*' -C "$repo" ls-files -z | (cd "$repo" && xargs -0 tar -c --ignore-failed-read) | tar -x -C "$work/clone"

# The image `$image`$1, built as given: OPTIONS of buildah.
build() {
  local begin=$SECONDS name=$image$1
  in_storage bud "${isolation[@]}" --layers --pull-never "${limits[@]}" "${@:2}" \
    -t "$name" -f "$work/clone/.devcontainer/Dockerfile" "$work/clone" >"$work/build.log" 2>&1 ||
    { tail -n 20 "$work/build.log" >&2; fail "the image $name could not be built"; }
  say "$name is built: $((SECONDS - begin)) s, $(in_storage images --format '{{.Size}}' "$name")"
}
build ''
container=$(in_storage from --pull-never "$image")
# The image's own entry, which `buildah run` leaves out.
mapfile -t entry < <(in_storage inspect --type image --format '{{range .OCIv1.Config.Entrypoint}}{{println .}}{{end}}' "$image" | sed '/^$/d')
[ "${entry[0]}" = bash ] || fail "the image's entry is unexpected: ${entry[*]}"
# COMMAND in the container, as `docker run` starts it. OPTIONS: buildah run's, in the array `options`.
options=()
in_container() {
  in_storage run "${isolation[@]}" --env "ROS_MASTER_URI=http://localhost:${ports[0]}" ${options[@]+"${options[@]}"} "$container" -- "${entry[@]}" "$@"
}

# --- the demonstration, to its end ------------------------------------------------------------------------------------
[ "$(in_container id -un)" = student ] || fail 'the user is not student'
begin=$SECONDS
in_container true
say "a terminal is ready after $((SECONDS - begin)) s"

begin=$SECONDS
in_container ./scripts/demo.sh >"$work/demo.log" 2>&1 || { tail -n 20 "$work/demo.log" >&2; fail 'the demonstration failed'; }
grep '^drive' "$work/demo.log"
say "the demonstration passed in $((SECONDS - begin)) s"

# --- the page, from outside -------------------------------------------------------------------------------------------
mkdir -m 777 "$work/shared"
options=(--env "ROS_MASTER_URI=http://localhost:${ports[1]}" --volume "$work/shared:/shared")
# shellcheck disable=SC2016    # for the shell in the container
# A command in the background ignores Ctrl+C; `docker run` does not.
in_container bash -c 'echo $$ >/shared/pid; exec env --default-signal=INT,QUIT ./scripts/demo.sh stay:=true' </dev/null >"$work/stay.log" 2>&1 &
begin=$SECONDS
until grep -q 'in a browser' "$work/stay.log"; do
  [ $((SECONDS - begin)) -lt 60 ] || { cat "$work/stay.log" >&2; fail 'no address was printed'; }
  sleep 0.5
done
demo=$(<"$work/shared/pid")
address=$(sed -n 's/.*open \(http[^ ]*\) in a browser.*/\1/p' "$work/stay.log")
[[ $address =~ ^http://localhost:([0-9]+)/\?token=.{10,}$ ]] || fail "the address is unexpected: $address"
port=${BASH_REMATCH[1]} plain=${address%%\?*} token=${address#*token=}
say "the page is offered after $((SECONDS - begin)) s"

# Through the network's side, under the name that the browser uses, as through a published port.
here=$(hostname -I | cut -d ' ' -f 1)
[ -n "$here" ] || fail 'this machine has no address in a network'
fetch() { curl -s -m 5 --noproxy '*' --connect-to "localhost:$port:$here:$port" "$@"; }
status_of() { fetch -o "$work/answer" -w '%{http_code}' "$@" || true; }
[ "$(status_of "$address")" = 200 ] || fail "the page: $(<"$work/answer")"
grep -qi '<html' "$work/answer" || fail "no page: $(<"$work/answer")"
for wrong in "$plain" "$plain?token=" "$plain?token=${token%?}" "$plain?token=${token}x"; do
  [ "$(status_of "$wrong")" = 403 ] || fail "not refused: $wrong"
done
[ "$(status_of -H 'Host: evil.example' "$address")" = 403 ] || fail 'a page under another name was not refused'
say 'the page works with the token alone'

[ "$(inside | wc -l)" -gt 5 ] || fail 'the processes of the container were not found'
kill -INT "$demo"
begin=$SECONDS
while [ -n "$(inside)" ]; do
  [ $((SECONDS - begin)) -lt 20 ] || { ps -o pid,args -p "$(inside | paste -sd,)" >&2; fail 'Ctrl+C did not end the demonstration within 20 s'; }
  sleep 0.5
done
say "Ctrl+C ended all of it in $((SECONDS - begin)) s"

# --- a student's workspace ----------------------------------------------------------------------------------------------
options=()
begin=$SECONDS
# shellcheck disable=SC2016
in_container bash -ic 'set -e; rosrun tb3_labs skeleton.py turn ~/catkin_ws/src; cd ~/catkin_ws; catkin_make; cd
  bash -ic "rospack find lab2; python3 -c \"import tb3_labs.ros.node, squaternion\"" ' \
  </dev/null >"$work/student.log" 2>&1 || true
grep -q '^/home/student/catkin_ws/src/lab2' "$work/student.log" || { tail -n 20 "$work/student.log" >&2; fail "a student's workspace was not found"; }
say "a student's workspace was built in $((SECONDS - begin)) s, and is found in a new terminal"

# --- a clone that is mounted over the image's -------------------------------------------------------------------------------
# In an image as VS Code builds it, for a user with another number.
user=1234
build _editor --build-arg "UID=$user" --build-arg "PACKAGES=$(sed -n 's/.*"PACKAGES": "\(.*\)".*/\1/p' "$repo/.devcontainer/devcontainer.json")"
container=$(in_storage from --pull-never "${image}_editor")
options=()
[ "$(in_container id -u)" = $user ] || fail "the user's number is not $user"
[ "$(in_container sudo -n id -u)" = 0 ] || fail 'sudo does not work'
in_container git --version >/dev/null || fail 'git is missing'
chown -R "$user:$user" "$work/clone"
options=(--volume "$work/clone:/home/student/tb3_labs")
begin=$SECONDS
in_container true >"$work/mounted.log" 2>&1 || { cat "$work/mounted.log" >&2; fail 'the set-up in a mounted clone failed'; }
say "a mounted clone without a folder build was ready in $((SECONDS - begin)) s"
foreign=$(find "$work/clone" ! -uid "$user" -print -quit)
[ -z "$foreign" ] || fail "not the user's: $foreign"

# VS Code's new volume takes this over from the image.
rm -rf "$work/clone/build"
mkdir "$work/volume"
cp -a "$(in_storage mount "$container")/home/student/tb3_labs/build/." "$work/volume"
chown "$user:$user" "$work/volume"
mkdir "$work/clone/build"
options+=(--volume "$work/volume:/home/student/tb3_labs/build")
begin=$SECONDS
in_container true >"$work/mounted.log" 2>&1 || { cat "$work/mounted.log" >&2; fail 'the set-up with a volume failed'; }
[ ! -s "$work/mounted.log" ] || { cat "$work/mounted.log" >&2; fail 'what the image had built was not good enough for the clone'; }
say "with what the image had built: $((SECONDS - begin)) s"
say 'all passed'
