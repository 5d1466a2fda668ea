#!/usr/bin/env bash
# Runs the whole check, or some tests, with another Python and the newest releases of all dependencies, in a Debian
# root. Linux, as root.
#
#     sudo packaging/other_python.sh SUITE MIRROR ROOT [words for pytest]
#     sudo packaging/other_python.sh trixie http://MIRROR/debian /var/tmp/trixie
#     sudo packaging/other_python.sh trixie http://MIRROR/debian /var/tmp/trixie -n 2 -m "not slow and not nightly"
#
# SUITE trixie has Python 3.13, forky 3.14. MIRROR is an archive of Debian packages; ROOT is made by mmdebstrap at the
# first run and used again later. The last commit of this checkout is tested. pip uses this computer's settings,
# certificates and name servers, but not its find-links and constraints.
set -euo pipefail
here="$(cd "$(dirname "$0")/.." && pwd)"
suite="$1" mirror="$2" root="$3"
shift 3
. "$here/packaging/debian_root.sh"

packages=(ca-certificates fonts-dejavu-core gcc git libc6-dev procps python3 python3-dev python3-venv)
packages+=($(sed -n '/^    packages=(/,/)$/p' "$here/.ci/run" | tr -d '()' | sed 's/packages=//')) # of a virtual display
make_root "$suite" "$mirror" "$root" "${packages[@]}"
if [ ! -e "$root/work" ]; then
    git clone --quiet "$here" "$root/work"
fi
git -C "$root/work" fetch --quiet "$here" HEAD
git -C "$root/work" reset --quiet --hard FETCH_HEAD

in_root "$root" QT_QPA_PLATFORM=offscreen LIQUID_STUDY_CONFIG=/tmp/settings LIQUID_STUDY_WORKSPACE=/work bash -euc '
    cd /work
    [ -e .venv ] || python3 -m venv .venv
    .venv/bin/pip install --quiet --upgrade --upgrade-strategy eager -e ".[test]"
    .venv/bin/python --version
    .venv/bin/pip list | grep -iE "^(pyside6_essentials|numpy|numba|pandas|pyarrow|pyqtgraph|scipy) "
    [ $# -gt 0 ] || exec bash .ci/run
    exec .venv/bin/python -m pytest "$@"' bash "$@"
