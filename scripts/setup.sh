#!/usr/bin/env bash
# Brings a machine from "git, make and a Rust toolchain" to a built Caustica and
# a device that can trace rays. Idempotent: what is there already is left alone,
# and a second run asks nothing of the network.
set -euo pipefail
export DEBIAN_FRONTEND=noninteractive
# rustup may be set to fetch what rust-toolchain.toml names; this script only
# says what is missing.
export RUSTUP_AUTO_INSTALL=0

cd "$(dirname "${BASH_SOURCE[0]}")/.."
# What a report says of the program's source; as in the Makefile, so that nothing is built twice.
export CAUSTICA_COMMIT="${CAUSTICA_COMMIT:-$(git rev-parse --short=9 HEAD 2>/dev/null || true)}"

backports_file=/etc/apt/sources.list.d/caustica-backports.sources

# Package names are Debian's and Ubuntu's; the text says why it is needed.
compiler=(
  "build-essential|C++ compiler and headers, for glslang"
)
runtime=(
  "libvulkan1|Vulkan loader"
  "libx11-6|window on X11"
  "libx11-xcb1|window on X11"
  "libxcursor1|mouse pointer on X11"
  "libxi6|mouse and tablet on X11"
  "libxkbcommon0|keyboard layout"
  "libxkbcommon-x11-0|keyboard layout on X11"
  "libwayland-client0|window on Wayland"
)
driver=(
  "mesa-vulkan-drivers|Vulkan driver with ray tracing (lavapipe on the CPU)"
)
test_tools=(
  "vulkan-validationlayers|checks every Vulkan call of the tests"
  "xvfb|display without a screen, for the window tests"
  "xauth|access key of that display"
  "xdotool|mouse and keyboard of the window tests"
  "imagemagick|screenshots of the window tests"
  "x11-apps|screenshots of the window tests"
  "x11-utils|waits for the test display"
  "spirv-tools|checks compiled shaders"
)

usage() {
  cat <<'TEXT'
Usage: scripts/setup.sh [--compiler | --test] [--help]

Installs what Caustica needs, builds it and makes sure that some device can
trace rays: compiler, libraries of the window and the Vulkan loader,
`cargo build --release -p caustica`, `caustica devices`, and only where that
finds no device a driver (Mesa). Uses sudo only when not root.

  --compiler   only the compiler; builds nothing
  --test       also what `make test` needs: validation layer, Xvfb, xdotool ...;
               where npm is there, the validator for glTF
  --help       this text

Exit: 0 ready; 1 something is missing that the script cannot install (it says
what); 2 wrong usage.
TEXT
}

say() { printf 'setup: %s\n' "$*"; }

fail() {
  printf 'setup: %s\n' "$*" >&2
  exit 1
}

as_root() {
  if [ "$(id -u)" -eq 0 ]; then
    "$@"
  elif command -v sudo >/dev/null; then
    sudo env DEBIAN_FRONTEND=noninteractive "$@"
  else
    fail "needs root for: $* (neither root nor sudo here)"
  fi
}

# os_release NAME: that variable of the machine's os-release file, or nothing.
os_release() (
  # shellcheck source=/dev/null
  [ ! -r /etc/os-release ] || . /etc/os-release
  printf '%s' "${!1:-}"
)

# What the distribution offers: "backports" (its own Mesa is too old to trace
# rays), "main" (its own Mesa will do) or "unknown".
mesa_source() {
  local id version codename
  id=$(os_release ID)
  version=$(os_release VERSION_ID)
  codename=$(os_release VERSION_CODENAME)
  if ! command -v apt-get >/dev/null || ! command -v dpkg-query >/dev/null; then
    echo unknown
  elif [ "$id" = debian ] && [ "$codename" = bookworm ]; then
    echo backports
  elif [ "$id" = debian ] && { [ -z "$version" ] || dpkg --compare-versions "$version" ge 13; }; then
    echo main # testing and unstable state no version
  elif [ "$id" = ubuntu ] && dpkg --compare-versions "${version:-0}" ge 24.10; then
    echo main
  else
    echo unknown
  fi
}

# Prints those of the given "package|why" lines whose package is not installed.
missing_of() {
  local installed line
  installed=$(dpkg-query -W -f '${db:Status-Status} ${Package}\n' "${@%%|*}" 2>/dev/null || true)
  for line in "$@"; do
    grep -qxF "installed ${line%%|*}" <<<"$installed" || printf '%s\n' "$line"
  done
}

lists_are_fresh=no
update_lists() {
  say "reading apt's package lists"
  as_root apt-get update -qq ||
    say "apt-get update reported an error; going on with the lists that are there"
  lists_are_fresh=yes
}

# ensure [-t SUITE] "package|why" ...: installs those that are missing.
ensure() {
  local suite=()
  if [ "$1" = -t ]; then
    suite=(-t "$2")
    shift 2
  fi
  local missing=()
  mapfile -t missing < <(missing_of "$@")
  [ "${#missing[@]}" -gt 0 ] || return 0
  [ "$lists_are_fresh" = yes ] || update_lists
  local line
  for line in "${missing[@]}"; do
    say "installing ${line%%|*}: ${line#*|}"
  done
  as_root apt-get install -qq --no-install-recommends "${suite[@]}" "${missing[@]%%|*}" >/dev/null ||
    fail "apt-get could not install: ${missing[*]%%|*}"
}

# targets FIELD [FILTER ...]: that field of each package list that apt's
# configuration names, one a line.
targets() {
  local field=$1
  shift
  apt-get indextargets --format "\$($field)" 'Created-By: Packages' "$@" 2>/dev/null || true
}

first_line() { awk 'NR == 1'; }

# Prints the Signed-By setting of the apt entry that gives $1 (a repository
# address) its bookworm suite, as lines of a deb822 file; nothing where the
# entry has none.
signed_by_of() {
  local entry file
  entry=$(targets SOURCESENTRY 'Codename: bookworm' "Repo-URI: $1" | first_line)
  file=${entry%:*}
  [ -r "$file" ] || return 0
  case $file in
    *.sources)
      # The stanza that names the suite; Signed-By may hold a key of many lines.
      awk -v RS='' '{
        n = split($0, line, "\n"); suite = 0; keep = 0; text = ""
        for (i = 1; i <= n; i++) {
          if (line[i] ~ /^#/) continue
          if (line[i] ~ /^[^ \t]/) keep = (tolower(line[i]) ~ /^signed-by:/)
          if (tolower(line[i]) ~ /^suites:/ && line[i] ~ /[ \t]bookworm([ \t]|$)/) suite = 1
          if (keep) text = text line[i] "\n"
        }
        if (suite && text != "") { printf "%s", text; exit }
      }' "$file"
      ;;
    *)
      sed -n "${entry##*:}"'s/.*\[[^]]*signed-by=\([^] ]*\).*/Signed-By: \1/p' "$file"
      ;;
  esac
}

# Makes apt know bookworm-backports, from the mirror that it takes bookworm from.
add_backports() {
  local mirror
  [ -z "$(targets CODENAME 'Codename: bookworm-backports' 'Origin: Debian Backports')" ] || return 0
  [ "$lists_are_fresh" = yes ] || update_lists
  mirror=$(targets REPO_URI 'Codename: bookworm' 'Origin: Debian' | first_line)
  [ -n "$mirror" ] ||
    fail "apt's configuration names no mirror of Debian 12; add the suite bookworm-backports yourself and run this again"
  say "adding the suite bookworm-backports of apt's own mirror ($backports_file)"
  {
    printf 'Types: deb\nURIs: %s\nSuites: bookworm-backports\nComponents: main\n' "$mirror"
    signed_by_of "$mirror"
  } | as_root tee "$backports_file" >/dev/null
  update_lists
}

install_driver() {
  case $1 in
    backports)
      add_backports
      # An older Mesa counts as missing here: it is what found no device.
      say "installing mesa-vulkan-drivers: ${driver[0]#*|}"
      as_root apt-get install -qq --no-install-recommends -t bookworm-backports mesa-vulkan-drivers >/dev/null ||
        fail "apt-get could not install mesa-vulkan-drivers from bookworm-backports"
      ;;
    main) ensure "${driver[@]}" ;;
    *)
      fail "no device here can trace rays, and this distribution is not one that the script knows. Install a Vulkan driver with VK_KHR_ray_tracing_pipeline: the one of your GPU's vendor, or a recent Mesa (25.0 does)."
      ;;
  esac
}

# On an unknown distribution: names what is needed, and stops if it is not there.
check_by_hand() {
  local lacks=()
  command -v c++ >/dev/null || command -v g++ >/dev/null || lacks+=("a C++ compiler (g++)")
  if [ "$1" != compiler ]; then
    has_library libvulkan.so.1 || lacks+=("the Vulkan loader (libvulkan.so.1)")
  fi
  if [ "$1" = test ]; then
    command -v Xvfb >/dev/null || lacks+=("Xvfb")
    command -v xdotool >/dev/null || lacks+=("xdotool")
  fi
  [ "${#lacks[@]}" -gt 0 ] || return 0
  {
    say "this distribution is not one that the script knows (Debian 12 or later, Ubuntu 24.10 or later)."
    say "Caustica needs, under the names that your distribution has for these Debian packages:"
    local line
    for line in "${compiler[@]}" "${runtime[@]}" "${driver[@]}"; do
      say "  ${line%%|*}: ${line#*|}"
    done
    say "and for make test:"
    for line in "${test_tools[@]}"; do
      say "  ${line%%|*}: ${line#*|}"
    done
    local item
    for item in "${lacks[@]}"; do
      say "missing here: $item"
    done
  } >&2
  exit 1
}

has_library() {
  { PATH=$PATH:/sbin:/usr/sbin ldconfig -p 2>/dev/null || true; } | grep -F "$1" >/dev/null
}

check_rust() {
  local wanted
  wanted=$(sed -n 's/^channel *= *"\(.*\)"/\1/p' rust-toolchain.toml)
  command -v cargo >/dev/null || fail "no cargo here: install Rust $wanted (with rustup) and run this again"
  cargo --version >/dev/null 2>&1 ||
    fail "cargo cannot use Rust $wanted, which rust-toolchain.toml asks for: run 'rustup toolchain install $wanted --component rustfmt --component clippy'"
}

# Exit code of `caustica devices`: 0 some device traces rays, 3 none does.
devices() {
  "${CARGO_TARGET_DIR:-target}/release/caustica" devices
}

build_and_find_device() {
  say "building (cargo build --release -p caustica)"
  cargo build --release -p caustica
  local code=0
  devices >/dev/null 2>&1 || code=$?
  if [ "$code" -eq 3 ]; then
    say "caustica devices: none that can trace rays"
    install_driver "$1"
    code=0
    devices || code=$?
  fi
  [ "$code" -eq 0 ] || {
    devices >&2 || true
    fail "caustica devices still finds no device that can trace rays (exit $code); see its reasons above"
  }
}

# The Khronos validator, for the test of exported files; where there is no node that test is skipped.
install_validator() {
  local folder="${CARGO_TARGET_DIR:-target}/validator"
  command -v npm >/dev/null && [ ! -d "$folder/node_modules/gltf-validator" ] || return 0
  say "installing gltf-validator: the rules of Khronos for exported files"
  timeout 120 npm install --silent --prefix "$folder" gltf-validator >/dev/null 2>&1 ||
    say "gltf-validator could not be installed; the test that runs it is skipped"
}

main() {
  local mode=demo
  case ${1:-} in
    '') ;;
    --compiler) mode=compiler ;;
    --test) mode='test' ;;
    -h | --help)
      usage
      return 0
      ;;
    *)
      usage >&2
      exit 2
      ;;
  esac
  if [ $# -gt 1 ]; then
    usage >&2
    exit 2
  fi

  local mesa
  mesa=$(mesa_source)
  if [ "$mesa" = unknown ]; then
    check_by_hand "$mode"
  else
    local wanted=("${compiler[@]}")
    [ "$mode" = compiler ] || wanted+=("${runtime[@]}")
    [ "$mode" != test ] || wanted+=("${test_tools[@]}")
    ensure "${wanted[@]}"
  fi
  check_rust
  [ "$mode" != compiler ] || return 0
  build_and_find_device "$mesa"
  [ "$mode" != test ] || install_validator
  say "ready"
}

main "$@"
