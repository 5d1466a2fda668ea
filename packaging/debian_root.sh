# Functions for scripts that run the program in a Debian root. Linux, as root; to be sourced.

# make_root SUITE MIRROR ROOT PACKAGE...: make the root with these packages, unless it is there.
make_root() {
    local suite="$1" mirror="$2" root="$3" index
    shift 3
    mkdir -p "$(dirname "$root")"
    if [ ! -e "$root/usr/bin/python3" ]; then
        mmdebstrap --mode=root --variant=apt --aptopt='Acquire::Check-Valid-Until "false"' \
            --aptopt='APT::Install-Recommends "false"' --include="$(IFS=, && echo "$*")" "$suite" "$root" "$mirror"
    fi
    # pip uses this computer's index, certificates and name servers, but not its find-links and constraints.
    cp --dereference /etc/resolv.conf /etc/hosts "$root/etc/"
    mkdir -p "$root/etc/ssl/certs"
    cp --dereference "${SSL_CERT_FILE:-/etc/ssl/certs/ca-certificates.crt}" "$root/etc/ssl/certs/ca-certificates.crt"
    if index="$(python3 -m pip config get global.index-url 2>/dev/null)"; then
        printf '[global]\nindex-url = %s\n' "$index" >"$root/etc/pip.conf"
    fi
}

# in_root ROOT [NAME=VALUE...] COMMAND...: run a command in the root, with these variables and no others of this shell.
# Namespaces of its own end with it, and with them whatever is left running or mounted.
in_root() {
    unshare --mount --pid --fork bash -c '
        root="$1"
        shift
        mount -t proc proc "$root/proc" && mount --rbind /dev "$root/dev" && mount -t tmpfs tmpfs "$root/dev/shm"
        env -i HOME=/root LANG=C.UTF-8 PATH=/usr/bin:/bin:/usr/sbin:/sbin PIP_CERT=/etc/ssl/certs/ca-certificates.crt \
            chroot "$root" env "$@"
        exit $? # this shell is process 1: it collects processes whose parent was killed' bash "$@"
}
