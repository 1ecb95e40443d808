"""From a recording and settings to the best arm: the only room that knows the swarm and the robot.

As a function, ``armdesign.search(problem)`` is :func:`armdesign.search.search.search`.
"""

import sys

from armdesign._types import CallableRoom

MAIN = ("armdesign.search.search", "search")
sys.modules[__name__].__class__ = CallableRoom
