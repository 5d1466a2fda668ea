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

packages=(ca-certificates fonts-dejavu-core gcc git libc6-dev procps python3 python3-dev python3-venv)
packages+=($(sed -n '/^    packages=(/,/)$/p' "$here/.ci/run" | tr -d '()' | sed 's/packages=//')) # of a virtual display
if [ ! -e "$root/usr/bin/python3" ]; then
    mmdebstrap --mode=root --variant=apt --aptopt='Acquire::Check-Valid-Until "false"' \
        --aptopt='APT::Install-Recommends "false"' --include="$(IFS=, && echo "${packages[*]}")" "$suite" "$root" "$mirror"
fi
cp --dereference /etc/resolv.conf /etc/hosts "$root/etc/"
cp --dereference "${SSL_CERT_FILE:-/etc/ssl/certs/ca-certificates.crt}" "$root/etc/ssl/certs/ca-certificates.crt"
if index="$(python3 -m pip config get global.index-url 2>/dev/null)"; then
    printf '[global]\nindex-url = %s\n' "$index" >"$root/etc/pip.conf"
fi
if [ ! -e "$root/work" ]; then
    git clone --quiet "$here" "$root/work"
fi
git -C "$root/work" fetch --quiet "$here" HEAD
git -C "$root/work" reset --quiet --hard FETCH_HEAD

# In namespaces of mounts and processes of its own: whatever is left running or mounted ends with it.
export root
exec unshare --mount --pid --fork bash -c '
    mount -t proc proc "$root/proc" && mount --rbind /dev "$root/dev" && mount -t tmpfs tmpfs "$root/dev/shm"
    env -i HOME=/root LANG=C.UTF-8 PATH=/usr/bin:/bin:/usr/sbin:/sbin PIP_CERT=/etc/ssl/certs/ca-certificates.crt \
        QT_QPA_PLATFORM=offscreen LIQUID_STUDY_CONFIG=/tmp/settings LIQUID_STUDY_WORKSPACE=/work \
        chroot "$root" bash -euc "
            cd /work
            [ -e .venv ] || python3 -m venv .venv
            .venv/bin/pip install --quiet --upgrade --upgrade-strategy eager -e \".[test]\"
            .venv/bin/python --version
            .venv/bin/pip list | grep -iE \"^(pyside6_essentials|numpy|numba|pandas|pyarrow|pyqtgraph|scipy) \"
            [ \$# -gt 0 ] || exec bash .ci/run
            exec .venv/bin/python -m pytest \"\$@\"" bash "$@"
    exit $? # this shell is process 1: it collects processes whose parent was killed' bash "$@"
