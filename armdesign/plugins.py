"""What other installed packages add: formats of recordings and search algorithms, by entry points.

    [project.entry-points."armdesign.formats"]
    "Acme tracker" = "armdesign_acme.tracker"       # has matches(head: bytes) -> bool and read(path: Path) -> Take

    [project.entry-points."armdesign.algorithms"]
    random = "armdesign_random:RandomSearch"        # a class derived from armdesign.swarm.Algorithm

Names are known without importing anything; a plug-in is imported when it is first needed. Worker processes and the
workers of a cluster look for themselves, so the package has to be installed there, too.
"""

from __future__ import annotations

import functools
import inspect
import traceback
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from importlib.metadata import EntryPoint, entry_points
from typing import Any, TypeVar

from armdesign.errors import ArmDesignError, PluginError

T = TypeVar("T")
FORMATS, ALGORITHMS = "armdesign.formats", "armdesign.algorithms"
"""The groups of entry points."""


@dataclass(frozen=True)
class Plugin:
    """One entry point of an installed package.

    Attributes:
        name: What it is called.
        package: The package and its version, for messages.
        entry: Where it is.
    """

    name: str
    package: str
    entry: EntryPoint

    def load(self, made: Callable[[Any], T]) -> T:
        """Import it.

        Args:
            made: Makes of the imported object what is wanted, or raises a TypeError that says what is wrong with it.

        Raises:
            PluginError: It cannot be imported, or is not what is wanted.
        """
        return self.call(lambda: made(self.entry.load()))

    def call(self, function: Callable[..., T], *values: object, **named: object) -> T:
        """Call a function of the plug-in.

        Args:
            function: The function.
            values: Its arguments.
            named: Its arguments by name.

        Raises:
            PluginError: It raises something else than an error of bad input.
        """
        try:
            return function(*values, **named)
        except ArmDesignError:
            raise
        except Exception as error:  # whatever a stranger's code raises
            raised = traceback.format_exception_only(error)[-1].strip()
            message = f"the plug-in '{self.name}' of the package {self.package} fails: {raised}{self._place(error)}"
            fix = f"Mend or uninstall {self.package.partition(' ')[0]}"
            raise PluginError(message, value=self.name, fix=fix) from error

    def guarded(self, kind: type[T], names: Iterable[str]) -> type[T]:
        """A class of the plug-in of which these members are called as `call` does.

        Args:
            kind: The class.
            names: Methods, class methods and properties of it; anything else is left as it is.
        """

        def through(function: Callable[..., Any]) -> Callable[..., Any]:
            return functools.wraps(function)(lambda *values, **named: self.call(function, *values, **named))

        members: dict[str, Any] = {name: getattr(kind, name) for name in ("__module__", "__qualname__", "__doc__")}
        for name in names:
            member = inspect.getattr_static(kind, name)
            if isinstance(member, property) and member.fget is not None:
                members[name] = property(through(member.fget))
            elif isinstance(member, classmethod):
                members[name] = classmethod(through(member.__func__))
            elif inspect.isfunction(member):
                members[name] = through(member)
        made: type[T] = type(kind)(kind.__name__, (kind,), members)  # type: ignore[misc]
        return made

    def _place(self, error: Exception) -> str:
        """The last line of the plug-in's own package that an error came through, in words; empty if there is none."""
        package = self.entry.module.partition(".")[0]
        for frame, line in reversed([*traceback.walk_tb(error.__traceback__)]):
            if str(frame.f_globals.get("__name__")).partition(".")[0] == package:
                return f" ({frame.f_code.co_filename}, line {line})"
        return ""


@functools.cache
def installed(group: str) -> Mapping[str, Plugin]:
    """The plug-ins of a group by name; of two of one name the one that Python finds first.

    Args:
        group: ``FORMATS`` or ``ALGORITHMS``.
    """
    found: dict[str, Plugin] = {}
    for entry in entry_points(group=group):
        package = "unknown" if entry.dist is None else f"{entry.dist.name} {entry.dist.version}"
        found.setdefault(entry.name, Plugin(entry.name, package, entry))
    return found


class Plugged(Mapping[str, T]):
    """Things by name: the package's own, and those of plug-ins behind them, imported when they are looked up."""

    def __init__(self, own: Mapping[str, T], group: str, made: Callable[[Any, Plugin], T]) -> None:
        """Collect them.

        Args:
            own: The package's own.
            group: The group of entry points.
            made: Makes of what is imported, and of the plug-in it is from, what is wanted; see Plugin.load.
        """
        self.own, self.group, self.made = own, group, made

    def __getitem__(self, name: str) -> T:
        """The thing of that name; a PluginError where it cannot be loaded."""
        if name in self.own:
            return self.own[name]
        plugin = installed(self.group)[name]
        return plugin.load(lambda thing: self.made(thing, plugin))

    def __contains__(self, name: object) -> bool:
        return name in self.own or name in installed(self.group)

    def __iter__(self) -> Iterator[str]:
        return iter(dict.fromkeys((*self.own, *installed(self.group))))

    def __len__(self) -> int:
        return len(self.own.keys() | installed(self.group).keys())
