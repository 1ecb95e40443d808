"""A task with settings given by name, for tests."""

from armdesign.demonstration import Recording, Task, build_task
from armdesign.settings.sections import Task as TaskSettings


def task_of(recording: Recording, **settings: object) -> Task:
    """The task of a recording with these settings."""
    return build_task(recording, TaskSettings(**settings))
