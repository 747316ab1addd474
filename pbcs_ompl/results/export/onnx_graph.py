"""ONNX graphs, built one operation at a time."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from pbcs_ompl.core.errors import MissingDependency

OPSET, IR_VERSION = 18, 9
"""Of 2022 and 2023: what runs controllers may be older than what makes them."""


class Graph:
    """A graph that grows by operations; values are known by their names.

    Raises:
        MissingDependency: onnx is not installed.
    """

    def __init__(self) -> None:
        try:
            import onnx
        except ModuleNotFoundError as error:
            raise MissingDependency('ONNX files are written with onnx: pip install "pbcs-ompl[onnx]"') from error
        self._onnx = onnx
        self._nodes: list[Any] = []
        self._numbers: dict[tuple[str, tuple[int, ...], bytes], Any] = {}
        self._inputs: list[Any] = []
        self._outputs: list[Any] = []

    def input(self, name: str, shape: Sequence[str | int], dtype: Any) -> str:
        """Add an input; axes that are words are free."""
        self._inputs.append(self._value(name, shape, dtype))
        return name

    def output(self, name: str, value: str, shape: Sequence[str | int], dtype: Any) -> None:
        """Let a value be an output."""
        self._nodes.append(self._onnx.helper.make_node("Identity", [value], [name]))
        self._outputs.append(self._value(name, shape, dtype))

    def constant(self, numbers: Any, dtype: Any = None) -> str:
        """Return the name of a constant; equal ones are stored once."""
        array = np.asarray(numbers, dtype)
        key = (str(array.dtype), array.shape, array.tobytes())
        if key not in self._numbers:
            self._numbers[key] = self._onnx.numpy_helper.from_array(array, f"constant_{len(self._numbers)}")
        return str(self._numbers[key].name)

    def __call__(self, operation: str, *inputs: Any, **attributes: Any) -> str:
        """Add an operation with one output, whose name is returned; inputs that are no names are constants."""
        name = f"value_{len(self._nodes)}"
        names = [one if isinstance(one, str) else self.constant(one) for one in inputs]
        self._nodes.append(self._onnx.helper.make_node(operation, names, [name], **attributes))
        return name

    def cast(self, value: str, dtype: Any) -> str:
        """Return a value in another type."""
        return self("Cast", value, to=self._type(dtype))

    def columns(self, value: str, entries: Any) -> str:
        """Return some entries of the last axis."""
        return self("Gather", value, np.asarray(entries, np.int64), axis=-1)

    def model(self, words: dict[str, str]) -> Any:
        """Return the model of the graph, checked by onnx, with words as its metadata."""
        helper = self._onnx.helper
        graph = helper.make_graph(self._nodes, "controller", self._inputs, self._outputs, list(self._numbers.values()))
        model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], ir_version=IR_VERSION,
                                  producer_name="pbcs_ompl")
        helper.set_model_props(model, words)
        self._onnx.checker.check_model(model, full_check=True)
        return model

    def _value(self, name: str, shape: Sequence[str | int], dtype: Any) -> Any:
        return self._onnx.helper.make_tensor_value_info(name, self._type(dtype), list(shape))

    def _type(self, dtype: Any) -> int:
        return int(self._onnx.helper.np_dtype_to_tensor_dtype(np.dtype(dtype)))
