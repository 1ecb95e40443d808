"""Settings: what can be set, its default, range and meaning, declared once.

settings = Settings(design=Design(dof=4), search=Search(budget=10_000))
"""

from armdesign.settings.sections import Design, Fitness, Search, Settings, Solver, Task, read_settings

__all__ = ["Design", "Fitness", "Search", "Settings", "Solver", "Task", "read_settings"]
