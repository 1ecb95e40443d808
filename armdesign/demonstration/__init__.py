"""Recordings of a human arm, and the tasks made of them."""

from armdesign.demonstration.plain_csv import read_plain_csv, write_plain_csv
from armdesign.demonstration.readers import READERS, Reader, read_recording
from armdesign.demonstration.recording import Recording
from armdesign.demonstration.task import BASE_MODES, Task, build_task, task_from_recording, task_recording

__all__ = [
    "BASE_MODES",
    "READERS",
    "Reader",
    "Recording",
    "Task",
    "build_task",
    "read_plain_csv",
    "read_recording",
    "task_from_recording",
    "task_recording",
    "write_plain_csv",
]
