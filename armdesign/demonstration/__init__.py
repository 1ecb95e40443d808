"""Recordings of a human arm, and the tasks made of them."""

from armdesign.demonstration.files.hints import Hints
from armdesign.demonstration.files.plain_csv import read_plain_csv, write_plain_csv
from armdesign.demonstration.files.readers import read_recording, read_recordings, read_take
from armdesign.demonstration.points.selection import Selection, resolve
from armdesign.demonstration.recording import About, Recording, Step, Take
from armdesign.demonstration.task import Task, build_task, task_from_recording, task_recording

__all__ = [
    "About",
    "Hints",
    "Recording",
    "Selection",
    "Step",
    "Take",
    "Task",
    "build_task",
    "read_plain_csv",
    "read_recording",
    "read_recordings",
    "read_take",
    "resolve",
    "task_from_recording",
    "task_recording",
    "write_plain_csv",
]
