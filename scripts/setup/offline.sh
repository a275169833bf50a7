# shellcheck shell=bash disable=SC2154,SC2034    # variables of scripts/setup.sh, of which this is a part
# A machine without internet: a folder with all that the set-up takes from the network.
#
#     packages/       .deb files, with all that they depend on down to a bare system, and their index: a repository of apt
#     wheels/         from PyPI
#     packages.txt    the packages to install
#     system          for which system; written last, so that an interrupted folder is not taken for a complete one

architecture() { dpkg --print-architecture; }

# fetch FOLDER [PACKAGE ...]: make that folder; the further packages come with it. It needs no rights.
fetch() {
  local folder=$1 state wanted
  shift
  { mkdir -p "$folder/packages/partial" "$folder/wheels" && [ -w "$folder" ]; } 2>/dev/null || fail "$folder cannot be written"
  folder=$(CDPATH='' cd -- "$folder" && pwd -P) log=$folder/fetch.log
  rm -rf "$folder/system" "$folder/wheels/"*
  [ "$(free_mb "$folder")" -ge 600 ] || fail "space is missing: 600 MB are needed in $folder, $(free_mb "$folder") MB are free"
  wanted=("${run_packages[@]}" "${late_packages[@]}" "$@")
  [ -z "${TB3_LABS_TESTS:-}" ] || wanted+=("${test_packages[@]}")

  # An apt of our own, for which nothing is installed yet.
  state=$(mktemp -d)
  # shellcheck disable=SC2064
  trap "rm -rf '$state'" EXIT
  mkdir -p "$state/lists/partial"
  touch "$state/status"
  bare_apt() {
    LC_ALL=C.UTF-8 apt-get -q -o Dir::State="$state" -o Dir::State::status="$state/status" -o Dir::Cache="$state" \
      -o Dir::Cache::archives="$folder/packages" -o Debug::NoLocking=1 -o APT::Sandbox::User=root -o Acquire::Retries=2 "$@" 8>&-
  }
  say 'reading the package lists ...'
  bare_apt update >"$log" 2>&1 || true    # a list that cannot be fetched may not be needed
  say "fetching packages into $folder ..."
  bare_apt install -y --download-only --no-install-recommends "${wanted[@]}" >>"$log" 2>&1 || {
    ! grep -Eq '^(Err|W: Failed to fetch|E: Failed to fetch)' "$log" || fail "the network is missing: the packages cannot be fetched (all of it: $log)"
    fail "the packages cannot be fetched: $(grep -m1 '^E: ' "$log") (all of it: $log)"
  }
  bare_apt autoclean >>"$log" 2>&1    # an earlier fetch's, of older versions
  rm -rf "$folder/packages/partial" "$folder/packages/lock"
  "$ws/venv/bin/python3" -m pip wheel --quiet --no-cache-dir --no-input --disable-pip-version-check \
    --wheel-dir "$folder/wheels" "${pip_exactly[@]}" -r <(pinned) >>"$log" 2>&1 || fail_log "${requirements[*]} cannot be fetched from PyPI"

  index_packages "$folder/packages"
  printf '%s\n' "${wanted[@]}" >"$folder/packages.txt"
  echo "$system $(architecture)" >"$folder/system"
  say "$folder is complete: $(find "$folder/packages" -name '*.deb' | wc -l) packages, $(du -sm "$folder" | cut -f1) MB, for $(<"$folder/system"), sum $(sum_of "$folder"). There: ./scripts/setup.sh --from FOLDER $*"
}

# The index that makes a folder of .deb files a repository, as dpkg-scanpackages (which few machines have) writes it.
index_packages() {
  local deb
  cd "$1" || return
  for deb in *.deb; do
    dpkg-deb --field "$deb"
    echo "Filename: ./$deb"
    echo "Size: $(stat -c %s "$deb")"
    echo "SHA256: $(sha256sum "$deb" | cut -d' ' -f1)"
    echo
  done >Packages
}

# The checksum of the index, which has the checksum of each package: --fetch and --from must print the same one.
sum_of() { sha256sum "$1/packages/Packages" | cut -c1-16; }

# take_from FOLDER [PACKAGE ...]: from now on apt and pip take packages from this folder alone. This repository and the
# command line name the packages to install; the folder does not.
take_from() {
  local for_system p
  [ -r "$1/system" ] || fail "$1 is not a complete folder of packages: make one with ./scripts/setup.sh --fetch FOLDER, on a machine with internet"
  for_system=$(<"$1/system")
  [ "$for_system" = "$system $(architecture)" ] || fail "$1 is for $for_system, and this machine is $system $(architecture)"
  folder=$(CDPATH='' cd -- "$1" && pwd -P)
  shift
  run_packages+=("${late_packages[@]}" "$@")
  for p in "${run_packages[@]}"; do
    grep -qxF -- "$p" "$folder/packages.txt" || fail "$folder has no package $p: fetch it anew, with ./scripts/setup.sh --fetch FOLDER $*"
  done
  say "$folder has the sum $(sum_of "$folder") (another one than --fetch told: somebody changed it)"
  apt_options=(-o Dir::Etc::SourceList="$ws/from.list" -o Dir::Etc::SourceParts=/dev/null -o Dir::State::Lists=/var/lib/apt/tb3_labs
    -o Dir::Cache::pkgcache= -o Dir::Cache::srcpkgcache= -o APT::Sandbox::User=root)
  pip_options=(--no-index --find-links "$folder/wheels")
}

# The repository's address, for apt.
list_folder() {
  local address=${folder//%/%25}
  echo "deb [trusted=yes] file:${address// /%20}/packages ./" >"$ws/from.list"
}
