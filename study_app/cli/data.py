"""The commands about results folders: tables, reports, exclusions, withdrawals, merged sites, checks and proofs."""

import gc
from dataclasses import replace
from functools import partial
from pathlib import Path

import click

from study_app.cli.options import (
    BY,
    PARTICIPANT,
    REASON,
    SESSION,
    Target,
    WholeNumber,
    echo_files,
    exclude_each_other,
    exit_if,
    printable,
    progress,
    study_at,
    takes_session,
    takes_study,
)
from study_app.number_text import counted


@click.command()
@takes_study
@click.option("--to", required=True, type=Target(), metavar="DIR", help="Folder to write to.")
@click.option(
    "--wide",
    is_flag=True,
    help=(
        "Also write the answers as a wide table, with one row per participant and one column per statement and "
        "condition."
    ),
)
@click.option("--parquet", is_flag=True, help="Also write every table as a Parquet file.")
@click.option(
    "--sav",
    is_flag=True,
    help="Also write the answers, in long and wide formats, for SPSS, jamovi and JASP; requires pyreadstat.",
)
@click.option(
    "--psych-ds",
    is_flag=True,
    help="Also write a Psych-DS folder for sharing, with all tables, the report and its script, and the study file.",
)
@click.option(
    "--validator",
    type=click.Path(path_type=Path, exists=True, dir_okay=False),
    metavar="PATH",
    help="Check the Psych-DS folder with the validator at PATH; the exit code is 3 if it finds errors.",
)
def export(
    results: Path, to: Path, *, wide: bool, parquet: bool, sav: bool, psych_ds: bool, validator: Path | None
) -> None:
    """Write tidy tables for all participants, with a codebook.

    With --psych-ds, the exit code is 3 if a section of the report could not be computed.
    """
    if validator is not None and not psych_ds:
        raise click.UsageError("--validator checks the folder written by --psych-ds, so add --psych-ds")
    from study_app.analysis.export import Extra
    from study_app.analysis.export_study import export as export_study

    requested: dict[Extra, bool] = {"wide": wide, "parquet": parquet, "sav": sav, "psych-ds": psych_ds}
    extras = [name for name, is_requested in requested.items() if is_requested]
    failed: list[str] = []
    with progress() as show:
        show("writing the tables")
        files = export_study(results, to, extras=extras, warn=partial(click.echo, err=True), failed=failed.append)
    echo_files(files)
    if validator is not None:
        _run_validator(validator, to)
    _report_failed_sections(failed)


def _report_failed_sections(failed: list[str]) -> None:
    """Print the sections of a report that failed; end with exit code 3 if there are any."""
    for line in failed:
        click.echo(line, err=True)
    exit_if(failed)


def _run_validator(validator: Path, to: Path) -> None:
    """Check a Psych-DS folder; end with exit code 3 if the validator finds errors."""
    import subprocess

    from study_app.analysis.export import FOLDER

    try:
        completed = subprocess.run([validator.absolute(), to / FOLDER], check=False)  # noqa: S603 - named by the user
    except OSError as error:
        raise click.UsageError(f"{validator} cannot be run: {error.strerror}; specify an executable file") from error
    exit_if(completed.returncode)


@click.command()
@takes_study
@click.option("--to", required=True, type=Target(), metavar="DIR", help="Folder to write to.")
def plot(results: Path, to: Path) -> None:
    """Plot the responses; conditions are labelled by code until the study is unblinded, and by name afterwards."""
    from study_app.analysis.report import plot as plot_study

    with progress() as show:
        show("plotting the responses")
        files = plot_study(results, to, warn=partial(click.echo, err=True))
    echo_files(files)


@click.command()
@takes_study
@click.option("--to", type=Target(), required=True, metavar="DIR", help="Folder for the report.")
def report(results: Path, to: Path) -> None:
    """Write a study's report: tests, figures, tables, conclusions, limitations, and how to reproduce the results.

    The exit code is 3 if a section could not be computed; the report says which one, and contains all the others.
    """
    gc.set_threshold(50_000, 20, 100)  # garbage collection took a tenth of the time of a report on 12 participants
    from study_app.analysis.report import report as write_report

    failed: list[str] = []
    with progress() as show:
        files = write_report(results, to, progress=show, warn=partial(click.echo, err=True), failed=failed.append)
    click.echo(f"{files[0]}  and {counted(len(files) - 1, 'more file')} in the same folder")
    _report_failed_sections(failed)


@click.command()
@takes_study
@BY
@REASON
def unblind(results: Path, by: str, reason: str) -> None:
    """Open a study's sealed key and write the sealed columns; your name, the time and the reason are recorded.

    In a merged study, the command opens every site's key. To open only one key, specify that site's folder, such as
    pooled/sites/A. If a file could not be changed, the command explains why and what to do, and the exit code is 3.
    """
    from study_app.store.exclusions import describe_exclusion
    from study_app.store.unblinding import unblind_folder

    with progress() as show:
        unblinded = unblind_folder(results, by=by, reason=reason, progress=show)
    for prefix, unblinding in unblinded.items():
        for block, codes in unblinding.codes.items():
            for code, condition in codes.items():
                standard, is_track, _ = condition.partition("/")
                track = f"standard {standard}" if standard else "all levels"
                click.echo(f"{block}  {prefix}{code}  {track if is_track else condition}")
        for row in unblinding.excluded:
            click.echo(f"excluded  {describe_exclusion(row)}: {row.reason}")
        for sentence in unblinding.left:
            click.echo(f"warning: {sentence}", err=True)
    exit_if([sentence for unblinding in unblinded.values() for sentence in unblinding.left])


@click.command()
@takes_study
@PARTICIPANT
@SESSION
@click.option("--trial", type=WholeNumber(1), help="Exclude only this trial; default: the whole session.")
@click.option(
    "--rule", metavar="RULE", default="", help="A planned exclusion rule that the session meets; this is checked."
)
@BY
@REASON
def exclude(results: Path, participant: str, session: int, trial: int | None, rule: str, by: str, reason: str) -> None:
    """Exclude a session or a trial from the analysis, with a reason; nothing is deleted."""
    from study_app.store.exclusions import describe_exclusion
    from study_app.store.exclusions import exclude as exclude_from
    from study_app.store.merged import locate_participant

    exclude_each_other(trial=trial, rule=rule or None)
    if rule and not _was_rule_checked(results, participant, session, rule):
        reason += "; the rule could not be checked because the key was sealed"
    exclusion = exclude_from(
        *locate_participant(results, participant), session, trial=trial, by=by, reason=reason, rule=rule
    )
    click.echo(describe_exclusion(replace(exclusion, participant=participant)))
    _warn_if_unblinded(results)


def _was_rule_checked(results: Path, participant: str, session: int, rule: str) -> bool:
    """Return whether a session meets a rule; print a warning if this can only be checked after unblinding."""
    from study_app.analysis.data import load_study
    from study_app.analysis.planned_exclusions import check_rule

    if check_rule(load_study(results), participant, session, rule):
        return True
    click.echo(f"warning: the rule {rule} can only be checked after unblinding; the report will check it", err=True)
    return False


def _warn_if_unblinded(results: Path) -> None:
    """Print a warning if a key of the study is open."""
    from study_app.store.unblinding import has_opened_keys

    if has_opened_keys(results):
        click.echo(
            "warning: the key is open, so the report will state that this was decided after unblinding", err=True
        )


@click.command()
@takes_study
@PARTICIPANT
@SESSION
@click.option("--trial", type=WholeNumber(1), help="Include only this trial, if it was excluded individually.")
@click.option("--rule", metavar="RULE", help="Keep a session to which this exclusion rule applies (e.g. below_chance).")
@BY
@REASON
def include(
    results: Path, participant: str, session: int, trial: int | None, rule: str | None, by: str, reason: str
) -> None:
    """Include a session or trial again, or keep a session that a rule would exclude.

    Your name, the time and the reason are recorded.
    """
    from study_app.store.exclusions import describe_exclusion, keep
    from study_app.store.exclusions import include as include_in
    from study_app.store.merged import locate_participant

    exclude_each_other(trial=trial, rule=rule)
    located = locate_participant(results, participant)
    if rule is None:
        exclusion = include_in(*located, session, trial=trial, by=by, reason=reason)
    else:
        exclusion = keep(*located, session, rule=rule, by=by, reason=reason)
    outcome = "included again" if rule is None else f"kept, although the rule {rule} applies"
    click.echo(f"{outcome}: {describe_exclusion(replace(exclusion, participant=participant))}")
    _warn_if_unblinded(results)


@click.command()
@takes_study
@PARTICIPANT
@BY
@click.option(
    "--reason", required=True, metavar="TEXT", help="The reason. It is stored, so it must not identify the participant."
)
@click.option(
    "--also",
    multiple=True,
    type=click.Path(path_type=Path, exists=True, file_okay=False),
    metavar="DIR",
    help="Folder to search (including subfolders) for copies of the study; the option can be repeated.",
)
def withdraw(results: Path, participant: str, by: str, reason: str, also: tuple[Path, ...]) -> None:
    """Erase a participant's data; only the date, the operator, the reason and checksums are kept."""
    from study_app.store.integrity import checked_line
    from study_app.store.merged import locate_participant
    from study_app.store.withdrawals import proof_of_withdrawal
    from study_app.store.withdrawals import withdraw as withdraw_from
    from study_app.workspace import workspace

    withdrawal = withdraw_from(*locate_participant(results, participant), by=by, reason=reason, also=also)
    for folder in withdrawal.folders:
        click.echo(f"erased     the data of participant {participant} in {folder}")
    for path in withdrawal.outputs:
        click.echo(f"deleted    {path}, which was produced from the results")
    click.echo(f"keep this line with the fingerprints:  {checked_line(*proof_of_withdrawal(withdrawal.tombstone))}")
    if not (withdrawal.folders or withdrawal.outputs):
        click.echo(f"nothing to erase: participant {participant} already withdrew at {withdrawal.tombstone.at}")
    for output in withdrawal.elsewhere:
        state = "delete it and create it again" if output.paths else "it no longer exists"
        click.echo(f"warning: output created at {output.at} outside the workspace ({state}): {output.to}", err=True)
    for sentence in withdrawal.left:
        click.echo(f"warning: {sentence}", err=True)
    searched = ", ".join(map(str, (workspace().results, *also)))
    click.echo(f"searched   {searched}; if there are copies elsewhere, repeat the command with --also DIR")


def _parse_sites(_context: click.Context, _parameter: click.Parameter, texts: tuple[str, ...]) -> dict[str, Path]:
    sites: dict[str, Path] = {}
    for text in texts:
        name, equals, folder = text.partition("=")
        if not (name and equals and folder):
            raise click.BadParameter(f"{text!r} does not have the form NAME=RESULTS, such as A=results/rek2024")
        if name in sites:
            raise click.BadParameter(f"site {name!r} is specified twice")
        sites[name] = study_at(folder, None)
    return sites


@click.command()
@click.argument("sites", nargs=-1, required=True, callback=_parse_sites, metavar="NAME=RESULTS...")
@click.option(
    "--to",
    required=True,
    type=Target(),
    metavar="DIR",
    help="New folder, or an existing merged study to which the sites are added.",
)
def merge(sites: dict[str, Path], to: Path) -> None:
    """Merge the study folders of several sites that ran the same protocol; the folders are copied unchanged.

    Participant IDs are prefixed with the site's name (A-P001), and each site keeps its own sealed key. Use the
    merged folder as RESULTS in report, export, plot, verify, unblind, exclude and withdraw.
    """
    from study_app.store.sites import damaged_sessions, merge_sites

    with progress() as show:
        show("reading the sites")
        merged = merge_sites(sites, to, progress=show)
    for site in merged.sites:
        state = "merged" if site.name in sites else "kept  "
        click.echo(f"{state}  site {site.name}: {counted(site.sessions, 'session')}, key {site.key_hash[:12]}")
    for name, folder in sites.items():
        for session in damaged_sessions(folder):
            warning = f"warning: the journal of {session} (site {name}) is damaged, so its results may be incomplete"
            click.echo(f"{warning}; the verify command describes the damage", err=True)
    click.echo(f"study {merged.study}, protocol {merged.protocol_hash[:12]}: {to}")


@click.command()
@takes_session
def rebuild(session: Path) -> None:
    """Rebuild a session's tables from its journal."""
    from study_app.store.sessions import rebuild_session

    rebuilt = rebuild_session(session)
    for path in rebuilt.rewritten:
        click.echo(f"rewritten  {path}")
    for path in rebuilt.swept:
        click.echo(f"removed    {path}, an incomplete file")
    if rebuilt.torn_bytes:
        click.echo(
            f"the journal ends with an incomplete line of {counted(rebuilt.torn_bytes, 'byte')}, which has been kept"
        )
    for path in rebuilt.lost:
        click.echo(f"warning: {path} is missing and cannot be rebuilt; restore it from a backup", err=True)
    if not (rebuilt.rewritten or rebuilt.swept):
        click.echo("nothing to do: every table agrees with the journal")


@click.command()
@takes_session
def reproduce(session: Path) -> None:
    """Recompute a session's orders and levels and compare them with the recorded ones."""
    from study_app.store.verification import reproduce_session

    reproduction = reproduce_session(session)
    for line in (*reproduction.differences, *reproduction.followed):
        click.echo(line)
    same = "reproduced: the order of trials and statements matches the receipt"
    click.echo("orders or levels differ" if reproduction.differences else same)
    exit_if(reproduction.differences)


@click.command()
@takes_study
@click.option(
    "--fingerprints",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help=(
        "Compare the study with fingerprints kept elsewhere (a copy of fingerprints.txt, or the output of the proof "
        "command), and list what has been changed or removed since."
    ),
)
@click.option(
    "--xdf",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Compare the study with a recording of its LSL streams (markers, lost samples, clock drift); requires pyxdf.",
)
def verify(results: Path, fingerprints: Path | None, xdf: Path | None) -> None:
    """Check everything in a study folder: columns, checksums, receipts, journals, the key and recordings."""
    from study_app.store.verification import check_recording
    from study_app.store.verification import verify_study as verify_folder

    with progress() as show:
        show("checking every file")
        verification = verify_folder(results, fingerprints)
        measured = [] if xdf is None else check_recording(xdf, results, verification)
    for finding in verification.errors:
        click.echo(printable(f"error: {finding}"))
    for finding in sorted(verification.warnings, key=lambda finding: finding.shares):
        click.echo(printable(f"{'before sharing' if finding.shares else 'warning'}: {finding}"))
    for package, names in verification.plug_ins.items():
        click.echo(f"plug-in {package}: {', '.join(names)}")
    for line in measured:
        click.echo(line)
    running = f", {verification.running} running" if verification.running else ""
    click.echo(
        f"{counted(verification.sessions, 'session')}{running}: {'sound' if verification.is_sound else 'not sound'}"
    )
    exit_if(not verification.is_sound)


@click.command()
@takes_study
@click.option("--to", type=Target(), metavar="FILE", help="Write the lines to this file; default: print them.")
@click.option(
    "--sign", is_flag=True, help="Sign the lines with the lab's key, which is kept in the system's key store."
)
@click.option("--server", metavar="URL", help="Obtain a time stamp from this server (RFC 3161).")
@click.option(
    "--root",
    type=click.Path(path_type=Path, exists=True, dir_okay=False),
    metavar="FILE",
    help="The server's root certificate (PEM), used to verify its time stamps; this setting is remembered.",
)
@click.option(
    "--always",
    type=click.Path(path_type=Path, exists=True, file_okay=False),
    metavar="DIR",
    help=(
        "Write the proof to this folder after every session, with a time stamp from --server; both settings are "
        "remembered."
    ),
)
def proof(
    results: Path, to: Path | None, *, sign: bool, server: str | None, root: Path | None, always: Path | None
) -> None:
    """Print a proof of a study: one line for each session, withdrawal, unblinding and exclusion.

    Store these lines where people with access to the results cannot change them; verify --fingerprints compares the
    study with these lines.
    """
    from study_app.store import workstation
    from study_app.store.files import StudyFolder, write_file
    from study_app.store.verification import proof_text

    text = proof_text(StudyFolder(results), server=server or "", sign=sign or None)
    changes = {"proofs": always and str(always.absolute()), "stamp_root": root and str(root.absolute())}
    changes |= {"stamps": server} if always is not None else {}
    if changed := {name: value for name, value in changes.items() if value is not None}:
        workstation.save_settings(workstation.MachineSettings(**(workstation.load_settings().model_dump() | changed)))
    if to is None:
        click.echo(text, nl=False)
    else:
        write_file(to, text.encode())
        click.echo(to)


@click.command()
@takes_session
def replay(session: Path) -> None:
    """Recompute every force from the recording, with the same kernel, and list every second in which forces differ.

    The command also lists the trials whose recordings were lost, are missing or cannot be compared. The exit code is 3
    if a force differs, a recording is missing, or nothing could be compared.
    """
    from study_app.session.replay import replay as replay_session

    replayed = replay_session(session)
    for sentence in (*replayed.differences, *replayed.missing, *replayed.uncompared):
        click.echo(sentence)
    if not (replayed.recordings or replayed.missing or replayed.uncompared):
        click.echo("no recordings were stored for this session")
    verdict = "forces differ" if replayed.differences else "all compared forces are equal"
    if not replayed.seconds:
        verdict = "no forces could be compared, so the session has not been verified"
    if replayed.recordings:
        pace = replayed.lasted_s / replayed.computed_s if replayed.computed_s else 0.0
        click.echo(
            f"{counted(replayed.recordings, 'recording')}, {replayed.lasted_s:.1f} s, recomputed at {pace:.0f} times "
            f"real-time speed ({replayed.took_s:.1f} s in all): {verdict}"
        )
    else:
        click.echo(verdict)
    exit_if(not replayed.proved)
