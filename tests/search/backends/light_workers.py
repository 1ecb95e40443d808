"""Handlers that start at once and do as they are told: answer, report, wait, raise, die.

A worker imports its setup by name, so these live in a module of their own.
"""

import os
import signal
import time

from armdesign.errors import DesignError


def light(fuse=None):
    """A setup; ``fuse`` names a file that lets one worker die."""

    def handle(content, context):
        what, *values = content
        if what == "die":
            os.kill(os.getpid(), signal.SIGKILL)
        if what == "die once" and os.path.exists(values[0]):
            os.unlink(values[0])
            os.kill(os.getpid(), signal.SIGKILL)
        if what == "raise":
            raise DesignError("no such arm", value=values[0])
        if what == "report":
            context.report({"half": 0.5 * values[0]})
        if what == "until stopped":
            while not context.stop_requested():
                context.report({"half": 0.0})
                time.sleep(0.01)
            return "stopped"
        if what == "sleep":
            time.sleep(values[0])
        return values[-1] ** 2 if values and not isinstance(values[-1], str) else what

    return handle


def never_starts():
    os._exit(3)
