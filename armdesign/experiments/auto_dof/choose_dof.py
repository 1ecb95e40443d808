"""The search for the right number of joints in a folder: one run a number, resumable, the chosen one at the top."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path

from armdesign.errors import ArmDesignError, RunFolderError, SettingsError
from armdesign.experiments.auto_dof.dof_records import (
    PICTURE,
    TABLE,
    TASKS,
    Found,
    auto_csv,
    fitness_of,
    holds_auto,
    read_auto,
    read_found,
    run_name,
    write_auto,
)
from armdesign.experiments.auto_dof.dof_rule import Rule, Verdict, decide, explain
from armdesign.experiments.auto_dof.extra_joint import with_extra_joint
from armdesign.files import write_whole
from armdesign.kinematics.dh_files import read_design
from armdesign.runs.folder import (
    DEMONSTRATIONS,
    HOLDOUTS,
    PREVIEW,
    REPORT,
    RESULT_FILES,
    TASK_FILES,
    inner_folders,
    settings_file,
)
from armdesign.runs.lock import locked
from armdesign.runs.reading import read_problem
from armdesign.runs.resumable import (
    Interrupts,
    NothingYetError,
    carry_out,
    finished,
    interruptible,
    start_run,
)
from armdesign.runs.writing import clear_result, write_files
from armdesign.search.backends import Backend
from armdesign.search.design_problem import DesignProblem
from armdesign.search.search import NothingFoundError, Progress

SHARE = 4
"""One in so many particles at most begins as the smaller arm with a joint more."""
MOST_JOINTS = 10


@dataclass(frozen=True)
class Outcome:
    """Where the choice stands.

    Attributes:
        folder: Its folder.
        found: What came of every number of joints that was searched, ascending.
        verdict: The choice; None while there is none.
        explanation: Why, in two sentences.
        interrupted: Whether somebody asked for the end before the choice was made.
    """

    folder: Path
    found: tuple[Found, ...]
    verdict: Verdict | None = None
    explanation: str = ""
    interrupted: bool = False


@dataclass(frozen=True)
class Watch:
    """Who is told how it goes.

    Attributes:
        begin: Called with n and the settings of a search before it begins or goes on.
        progress: Gives the function to call after every iteration of the next search.
        end: Called with what came of a search.
        interrupt: Called when Ctrl-C or SIGTERM asks for the end.
        note: Called with a sentence where something had to be decided.
    """

    begin: Callable[[int, DesignProblem], None] | None = None
    progress: Callable[[Progress], None] | None = None
    end: Callable[[Found], None] | None = None
    interrupt: Callable[[], None] | None = None
    note: Callable[[str], None] | None = None


def start_auto(folder: Path, tasks: Mapping[int, DesignProblem], rule: Rule) -> None:
    """Write down what is asked: the rule, and the task ready for every number of joints.

    Args:
        folder: The folder; it exists. What an earlier choice has left in it is removed.
        tasks: Task and settings by the number of joints.
        rule: When more joints do not pay.

    Raises:
        RunFolderError: The folder holds other folders of these names, cannot be written, or a process is at it.
    """
    with locked(folder):
        clear_result(folder)
        places = [folder / TASKS, *(folder / run_name(n) for n in range(1, MOST_JOINTS + 1))]
        for place in places:
            if place.exists() and not holds_auto(folder):
                raise RunFolderError(
                    f"{place} is there already", value=str(place), fix="Name another folder with --out"
                )
            shutil.rmtree(place, ignore_errors=True)
        for n, problem in tasks.items():
            place = folder / TASKS / run_name(n)
            place.mkdir(parents=True)
            start_run(place, problem)
        write_auto(folder, tuple(tasks), rule, {}, None)


def carry_out_auto(
    folder: Path, hire: Callable[[DesignProblem], AbstractContextManager[Backend]], watch: Watch
) -> Outcome:
    """Search few joints, then more, until the rule is decided; what is finished already is not searched again.

    Args:
        folder: The folder, see start_auto.
        hire: Gives who evaluates the candidates of a search.
        watch: Who is told how it goes.

    Raises:
        RunFolderError: Another process is at it, or a file is damaged or cannot be written.
        SearchError: The workers are lost.
        NothingFoundError: No number of joints has a valid arm.
    """
    with locked(folder), interruptible(watch.interrupt) as interrupts:
        joints, rule, _, failed = read_auto(folder)
        found: dict[int, Found] = {}
        while (verdict := decide(fitness_of(found), joints, rule)) is None and len(found) < len(joints):
            n = joints[len(found)]
            result = known(folder, n, failed)
            if result is None and not interrupts.requested:
                result = one_search(folder, n, found, hire, noticed(watch, interrupts))
            if result is None:
                return Outcome(folder, tuple(found.values()), interrupted=True)
            found[n] = result
            write_auto(folder, joints, rule, found, None)
            if watch.end is not None:
                watch.end(result)
        if verdict is None:
            raise nothing_at_all(found)
        return conclude(folder, joints, rule, found, verdict)


def known(folder: Path, n: int, failed: Mapping[int, str]) -> Found | None:
    """What came of n joints, if that is settled."""
    if n in failed:
        return Found(n, reason=failed[n])
    return read_found(folder / run_name(n)) if finished(folder / run_name(n)) else None


def noticed(watch: Watch, interrupts: Interrupts) -> Watch:
    """The same watch, with the requests to stop one search noted for all: a search may end by itself meanwhile."""

    def interrupt() -> None:
        interrupts.requested = True
        if watch.interrupt is not None:
            watch.interrupt()

    return replace(watch, interrupt=interrupt)


def one_search(
    folder: Path,
    n: int,
    found: Mapping[int, Found],
    hire: Callable[[DesignProblem], AbstractContextManager[Backend]],
    watch: Watch,
) -> Found | None:
    """Search the arm of n joints in its run folder; None where somebody asked for the end first."""
    try:
        read_problem(folder / TASKS / run_name(n)).space.check_not_empty()
    except SettingsError as error:  # with so few joints no arm within the bounds is long enough
        return Found(n, reason=bare(error))
    problem, fresh = begun(folder, n, found)
    if watch.begin is not None:
        watch.begin(n, problem)
    try:
        with hire(problem) as backend:
            result, _ = carry_out(
                folder / run_name(n), problem, backend, fresh=fresh,
                on_progress=watch.progress, on_interrupt=watch.interrupt, on_note=watch.note,
            )  # fmt: skip
    except NothingYetError:
        return None
    except NothingFoundError as error:
        return Found(n, reason=bare(error))
    return None if result.facts is not None and result.facts.interrupted else read_found(folder / run_name(n))


def bare(error: ArmDesignError) -> str:
    """What is wrong, without the way out: more joints are tried anyway."""
    return str(error).removesuffix(f". {error.fix}")


def begun(folder: Path, n: int, found: Mapping[int, Found]) -> tuple[DesignProblem, bool]:
    """Task and settings of the search for n joints, and whether it has yet to be started."""
    place = folder / run_name(n)
    if settings_file(place).is_file():
        return read_problem(place), False
    problem = read_problem(folder / TASKS / run_name(n))
    place.mkdir(exist_ok=True)
    smaller = found.get(n - 1)
    if smaller is None or not smaller.valid:
        return problem, True
    most = max(1, problem.settings.search.particles // SHARE)
    designs = with_extra_joint(read_design(folder / run_name(n - 1) / "result.json"), problem.space, most)
    first = [[float(x) for x in Phi] for Phi in designs]
    return replace(problem, settings=problem.settings.replace({"search": {"first": first or None}})), True


def conclude(
    folder: Path, joints: tuple[int, ...], rule: Rule, found: Mapping[int, Found], verdict: Verdict
) -> Outcome:
    """Put the chosen arm at the top of the folder, with the table and the picture of all."""
    from armdesign.experiments.auto_dof.dof_figure import pareto_png  # noqa: PLC0415 (Matplotlib)

    explanation = explain(verdict, fitness_of(found), joints, rule)
    write_whole(folder / TABLE, auto_csv(found, verdict))
    write_whole(folder / PICTURE, pareto_png(tuple(found.values()), verdict.dof, rule))
    publish(folder / run_name(verdict.dof), folder)
    write_auto(folder, joints, rule, found, verdict, explanation)
    return Outcome(folder, tuple(found.values()), verdict, explanation)


def publish(run: Path, folder: Path) -> None:
    """Copy a run's files to another folder, result.json last, so that it can be used like the run.

    Args:
        run: The run folder of the chosen number of joints.
        folder: Where the files go.

    Raises:
        RunFolderError: A file cannot be read or written.
    """
    clear_result(folder)
    places = [*inner_folders(run, DEMONSTRATIONS), *inner_folders(run, HOLDOUTS), run]
    names = [name for name in (*TASK_FILES, *reversed(RESULT_FILES)) if name not in (PREVIEW, REPORT)]
    paths = [place / name for place in places for name in names if (place / name).is_file()]
    try:
        files = {str(path.relative_to(run)): path.read_text(encoding="utf-8") for path in paths}
    except (OSError, ValueError) as error:
        raise RunFolderError(f"cannot copy the run in {run}: {error}", value=str(run)) from error
    write_files(folder, files)


def nothing_at_all(found: Mapping[int, Found]) -> NothingFoundError:
    """The error where no number of joints has a valid arm."""
    most = found[max(found)]
    return NothingFoundError(
        f"no arm of {min(found)} to {most.dof} joints was found; with {most.dof}: {most.reason}",
        fix="Use more particles or iterations, or wider bounds",
    )
