"""One set of modules under two names: `import planners` in a checkout gives the modules of `pbcs_ompl.planners`."""

import sys
from collections.abc import Sequence
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType


class _Alias(MetaPathFinder, Loader):
    """Finds `alias.x` as the module `name.x`."""

    def __init__(self, alias: str, name: str):
        self._alias, self._name = f"{alias}.", f"{name}."

    def find_spec(self, fullname: str, path: Sequence[str] | None,
                  target: ModuleType | None = None) -> ModuleSpec | None:
        return ModuleSpec(fullname, self) if fullname.startswith(self._alias) else None

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        module = import_module(self._name + spec.name.removeprefix(self._alias))
        spec.loader_state = module.__spec__  # importlib replaces it by `spec`
        return module

    def exec_module(self, module: ModuleType) -> None:
        spec = module.__spec__
        assert spec is not None
        module.__spec__ = spec.loader_state


def alias_package(alias: str, name: str) -> None:
    """Let the package `alias`, which is being imported, and its modules be those of the package `name`."""
    sys.meta_path.insert(0, _Alias(alias, name))
    sys.modules[alias] = import_module(name)
