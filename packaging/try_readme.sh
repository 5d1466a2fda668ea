#!/usr/bin/env bash
# Runs the README's two commands, as printed there, in Debian roots that have Python and little else. Linux, as root.
#
#     sudo packaging/try_readme.sh SUITE MIRROR FOLDER [ROOT...] [COMMAND...]
#     sudo packaging/try_readme.sh bookworm http://MIRROR/debian /var/tmp/readme
#     sudo packaging/try_readme.sh bookworm http://MIRROR/debian /var/tmp/readme bare display demo
#
# ROOT is bare (Python alone), libraries (and what Qt needs of the system) or display (and a virtual display, on which
# the window is opened and closed). COMMAND is demo, twice, or tests. Without them, all. MIRROR is an archive of Debian
# packages; mmdebstrap makes the roots in FOLDER at the first run. The last commit of this checkout is tried, without
# git. Prints how long each command took, and each one's exit code.
set -euo pipefail
here="$(cd "$(dirname "$0")/.." && pwd)"
. "$here/packaging/debian_root.sh"
suite="$1" mirror="$2" folder="$3"
shift 3
chosen=" $* "

libraries="$(cd "$here" && python3 -c 'from study_app.gui import display_check; print(display_check.PACKAGES)')"
declare -A packages=([bare]="" [libraries]="$libraries" [display]="$libraries xvfb xdotool")
mapfile -t commands < <(grep '^python3 -m venv' "$here/README.md")
failed=0

is_chosen() { # NAME ALTERNATIVE...: whether it was asked for, or none of these was
    local name="$1" each
    for each in "$@"; do
        [[ $chosen != *" $each "* ]] || { [[ $chosen == *" $name "* ]]; return; }
    done
}

run() { # TITLE ROOT [NAME=VALUE...] COMMAND...
    local title="$1" code=0
    shift
    SECONDS=0
    # Before each part of a command, how long the parts before it took.
    in_root "${@:1:$#-1}" "trap 'echo \"== after \$SECONDS s: \$BASH_COMMAND\"' DEBUG; ${*: -1}" || code=$?
    printf '== %s: exit code %d after %d s\n' "$title" "$code" "$SECONDS"
    [ "$code" = 0 ] || failed=1
}

for name in bare libraries display; do
    is_chosen "$name" bare libraries display || continue
    root="$folder/$name"
    # shellcheck disable=SC2086 # words of a list
    make_root "$suite" "$mirror" "$root" ca-certificates python3 python3-venv ${packages[$name]}
    rm -rf "$root/program" "$root/root"
    mkdir -p "$root/program" "$root/root"
    git -C "$here" archive HEAD | tar -x -C "$root/program"
    variables=(--chdir=/program)
    shown=""
    if [ "$name" = display ]; then
        variables+=(DISPLAY=:71)
        # Ctrl+Q closes the window, once it stands.
        window='xdotool search --onlyvisible --name "Liquid Study"'
        shown="rm -f /tmp/.X71-lock; Xvfb :71 -screen 0 1920x1080x24 -noreset &
            (until $window; do sleep 1; done; sleep 5; $window windowfocus --sync key ctrl+q) >/dev/null 2>&1 &"
    fi
    if is_chosen demo demo tests; then
        for time in first second; do
            run "$name, demo, $time time" "$root" "${variables[@]}" bash -c "$shown ${commands[0]}"
        done
    fi
    if is_chosen tests demo tests; then
        run "$name, tests" "$root" "${variables[@]}" bash -c "${shown%%&*}${shown:+&} ${commands[1]}"
    fi
done
exit "$failed"
