"""The search for the right number of joints in a folder: one run a number, resumable, the chosen one at the top."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path

from armdesign.errors import ArmDesignError, RunFolderError, SettingsError, counted
from armdesign.experiments.auto_dof.dof_records import (
    PICTURE,
    TABLE,
    TASKS,
    AutoState,
    auto_csv,
    fitness_of,
    has_choice,
    holds_auto,
    read_auto,
    read_dof_result,
    run_name,
    write_auto,
)
from armdesign.experiments.auto_dof.dof_rule import (
    JOINTS,
    DofResult,
    Rule,
    Verdict,
    decide,
    decide_by_tolerance,
    explain,
    explain_by_tolerance,
)
from armdesign.experiments.auto_dof.extra_joint import with_extra_joint
from armdesign.feasibility.words import tolerance_words
from armdesign.files import write_whole
from armdesign.kinematics.dh_files import read_base_pose, read_design
from armdesign.runs.folder import (
    DEMONSTRATIONS,
    HOLDOUTS,
    PREVIEW,
    REPORT,
    RESULT_FILES,
    TASK_FILES,
    claim_folder,
    inner_folders,
    settings_file,
)
from armdesign.runs.lock import locked
from armdesign.runs.reading import read_problem
from armdesign.runs.resumable import Interrupts, NothingYetError, carry_out, finished, interruptible, start_run
from armdesign.runs.writing import clear_result, write_files
from armdesign.search.backends.backend import Backend, InProcess
from armdesign.search.design_problem import DesignProblem
from armdesign.search.search import NothingFoundError, Progress
from armdesign.settings.sections import read_settings

SHARE = 4
"""One in so many particles at most begins as the smaller arm with a joint more."""
MOST_JOINTS = 10

StartWorkers = Callable[[DesignProblem], AbstractContextManager[Backend]]
"""Gives the backend that evaluates the candidates of a search."""


@dataclass(frozen=True)
class DofChoice:
    """How a search for the number of joints has ended.

    Attributes:
        folder: Its folder; with a choice it is the run folder of the chosen arm.
        results: The best arm of every number of joints that was searched, ascending.
        verdict: The choice; None while there is none.
        explanation: Why, in two sentences; where a tolerance is stated, whether it is met.
        interrupted: Whether somebody asked for the end before the choice was made.
    """

    folder: Path
    results: tuple[DofResult, ...]
    verdict: Verdict | None = None
    explanation: str = ""
    interrupted: bool = False


@dataclass(frozen=True)
class Callbacks:
    """Functions that are called on the way.

    Attributes:
        begin: Called with n and the problem before a search begins or goes on.
        progress: Called after every iteration.
        end: Called with the result of a search.
        interrupt: Called when Ctrl-C or SIGTERM asks for the end.
        note: Called with a sentence where something had to be decided.
    """

    begin: Callable[[int, DesignProblem], None] | None = None
    progress: Callable[[Progress], None] | None = None
    end: Callable[[DofResult], None] | None = None
    interrupt: Callable[[], None] | None = None
    note: Callable[[str], None] | None = None


def auto_dof(
    problem_for: Callable[[int], DesignProblem],
    folder: str | Path,
    rule: Rule | None = None,
    *,
    start_workers: StartWorkers = InProcess,
    callbacks: Callbacks | None = None,
    overwrite: bool = False,
) -> DofChoice:
    """Search 2, 3, ... joints, each number begun from the arm before, until more do not pay.

    With a tolerance in the settings: until the arm is feasible and meets it. What is interrupted goes on by
    ``carry_out_auto(folder)``.

    Args:
        problem_for: Gives the problem for a number of joints.
        folder: The folder to write, with a run folder ``nN`` for every number of joints.
        rule: When more joints do not pay; by default the paper's 4 %, or 5 mm.
        start_workers: Gives the backend for the candidates of a search; by default this process.
        callbacks: Functions that are called on the way.
        overwrite: Whether what the folder holds is given up.

    Raises:
        SettingsError: Settings that fit one number of joints only.
        RunFolderError: The folder holds something already, is in use, or cannot be written.
        NothingFoundError: No number of joints has a valid arm.
    """
    problems = problems_by_joints(problem_for)
    place = claim_auto_folder(Path(folder), overwrite=overwrite)
    start_auto(place, problems, rule or Rule())
    return carry_out_auto(place, start_workers, callbacks)


def problems_by_joints(problem_for: Callable[[int], DesignProblem]) -> dict[int, DesignProblem]:
    """The problem for every number of joints to choose from: those of design.auto_dof, or 2 to 7.

    Raises:
        SettingsError: Settings that fit one number of joints only.
    """
    fewest, most = problem_for(JOINTS[1]).settings.design.auto_dof or JOINTS
    problems = {}
    for n in range(fewest, most + 1):
        problems[n] = problem_for(n)
        try:
            problems[n].space, problems[n].path_problem
        except SettingsError as error:
            fix = "Settings that name single joints go with a --dof of that number, or with a narrower design.auto_dof"
            raise SettingsError(
                f"--dof auto, with {counted(n, 'joint')}: {error}", value=error.value, fix=fix
            ) from error
    return problems


def claim_auto_folder(folder: Path, *, overwrite: bool) -> Path:
    """Make the folder before the work begins.

    Raises:
        RunFolderError: It holds something already, or cannot be written.
    """
    if holds_auto(folder) and not overwrite:
        unfinished = "" if has_choice(folder) else f", go on with it by --resume {folder}"
        raise RunFolderError(
            f"{folder} already holds a search for the number of joints", value=str(folder),
            fix=f"Name another with --out{unfinished}, or add --overwrite",
        )  # fmt: skip
    return claim_folder(folder, overwrite=overwrite)


def start_auto(folder: Path, problems: Mapping[int, DesignProblem], rule: Rule) -> None:
    """Write down the rule, and the problem for every number of joints.

    Args:
        folder: The folder; it exists. What an earlier choice has left in it is removed.
        problems: Problems by the number of joints.
        rule: When more joints do not pay.

    Raises:
        RunFolderError: The folder holds other folders of these names, cannot be written, or is in use.
    """
    with locked(folder):
        clear_result(folder)
        for place in (folder / TASKS, *(folder / run_name(n) for n in range(1, MOST_JOINTS + 1))):
            if place.exists() and not holds_auto(folder):
                fix = "Name another folder with --out"
                raise RunFolderError(f"{place} is there already", value=str(place), fix=fix)
            shutil.rmtree(place, ignore_errors=True)
        for n, problem in problems.items():
            place = folder / TASKS / run_name(n)
            place.mkdir(parents=True)
            start_run(place, problem)
        # with a tolerance of its own each arm is judged by that
        words = tolerance_words(next(iter(problems.values())).settings.needs)
        write_auto(folder, tuple(problems), replace(rule, tolerance=words), {}, None)


def carry_out_auto(
    folder: Path, start_workers: StartWorkers = InProcess, callbacks: Callbacks | None = None
) -> DofChoice:
    """Search few joints, then more, until the rule is decided; finished searches are not repeated.

    Args:
        folder: The folder, see start_auto.
        start_workers: Gives the backend for the candidates of a search.
        callbacks: Functions that are called on the way.

    Raises:
        RunFolderError: Another process uses the folder, or a file is damaged or cannot be written.
        SearchError: The workers are lost.
        NothingFoundError: No number of joints has a valid arm.
    """
    calls = callbacks or Callbacks()
    with locked(folder), interruptible(calls.interrupt) as interrupts:
        state = read_auto(folder)
        results: dict[int, DofResult] = {}
        while (verdict := decided(results, state)) is None:
            if len(results) == len(state.joints):
                last = results[max(results)]
                raise NothingFoundError(
                    f"no arm of {min(results)} to {last.dof} joints was found; with {last.dof}: {last.reason}",
                    fix="Use more particles or iterations, or wider bounds",
                )
            n = state.joints[len(results)]
            place, result = folder / run_name(n), None
            if n in state.failed:
                result = DofResult(n, reason=state.failed[n])
            elif finished(place):
                result = read_dof_result(place)
            elif not interrupts.requested:
                result = search_joints(folder, n, results, start_workers, noting(calls, interrupts))
            if result is None:
                return DofChoice(folder, tuple(results.values()), interrupted=True)
            results[n] = result
            write_auto(folder, state.joints, state.rule, results, None)
            if calls.end is not None:
                calls.end(result)
        tolerance = state.rule.tolerance
        if tolerance:
            explanation = explain_by_tolerance(verdict, results, tolerance)
        else:
            explanation = explain(verdict, fitness_of(results), state.joints, state.rule)
        write_whole(folder / TABLE, auto_csv(results, verdict))
        from armdesign.experiments.auto_dof.dof_figure import pareto  # noqa: PLC0415 (Matplotlib)
        from armdesign.views.report.drawing import png  # noqa: PLC0415 (Matplotlib)

        allowed = read_settings(settings_file(folder / run_name(verdict.dof))).needs.hand_tolerance
        write_whole(folder / PICTURE, png(lambda: pareto(tuple(results.values()), verdict.dof, allowed)))
        publish(folder / run_name(verdict.dof), folder)
        write_auto(folder, state.joints, state.rule, results, verdict, explanation)
        return DofChoice(folder, tuple(results.values()), verdict, explanation)


def decided(results: Mapping[int, DofResult], state: AutoState) -> Verdict | None:
    """The choice, by the tolerance where one is stated; None where more has to be searched."""
    if state.rule.tolerance:
        return decide_by_tolerance(results, state.joints)
    return decide(fitness_of(results), state.joints, state.rule)


def noting(callbacks: Callbacks, interrupts: Interrupts) -> Callbacks:
    """Callbacks that note a request to stop one search for all: the search may end by itself meanwhile."""

    def interrupt() -> None:
        interrupts.requested = True
        if callbacks.interrupt is not None:
            callbacks.interrupt()

    return replace(callbacks, interrupt=interrupt)


def search_joints(
    folder: Path, n: int, results: Mapping[int, DofResult], start_workers: StartWorkers, callbacks: Callbacks
) -> DofResult | None:
    """Search the arm of n joints in its run folder; None where somebody asked for the end first."""
    try:
        read_problem(folder / TASKS / run_name(n)).space.check_not_empty()
    except SettingsError as error:  # with so few joints no arm within the bounds is long enough
        return DofResult(n, reason=without_fix(error))
    problem, fresh = problem_to_search(folder, n, results)
    if callbacks.begin is not None:
        callbacks.begin(n, problem)
    try:
        with start_workers(problem) as backend:
            result, _ = carry_out(
                folder / run_name(n), problem, backend, fresh=fresh, on_progress=callbacks.progress,
                on_interrupt=callbacks.interrupt, on_note=callbacks.note,
            )  # fmt: skip
    except NothingYetError:
        return None
    except NothingFoundError as error:
        return DofResult(n, reason=without_fix(error))
    return None if result.facts is not None and result.facts.interrupted else read_dof_result(folder / run_name(n))


def without_fix(error: ArmDesignError) -> str:
    """The message without its fix: more joints are tried anyway."""
    return str(error).removesuffix(f". {error.fix}")


def problem_to_search(folder: Path, n: int, results: Mapping[int, DofResult]) -> tuple[DesignProblem, bool]:
    """The problem of the search for n joints, and whether the search has yet to be started.

    A new search begins with the best arm of n - 1 joints, which has been given a joint of zero length.
    """
    place = folder / run_name(n)
    if settings_file(place).is_file():
        return read_problem(place), False
    problem = read_problem(folder / TASKS / run_name(n))
    place.mkdir(exist_ok=True)
    smaller = results.get(n - 1)
    if smaller is None or not smaller.valid:
        return problem, True
    most = max(1, problem.settings.search.particles // SHARE)
    before = folder / run_name(n - 1) / "result.json"
    designs = with_extra_joint(read_design(before), problem.space, most, read_base_pose(before))
    first = designs.tolist() or None
    return replace(problem, settings=problem.settings.replace({"search": {"first": first}})), True


def publish(run: Path, folder: Path) -> None:
    """Copy a run's files to another folder, result.json last, so that it can be used like the run.

    Args:
        run: The run folder.
        folder: Where to; its earlier result is removed.

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
