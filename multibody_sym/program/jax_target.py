"""The JAX target: a Program as a pure function of JAX arrays, for `jit`, `vmap` and `grad` on JAX's device."""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

from multibody_sym.errors import InputError, MissingPackageError
from multibody_sym.program.replay import ToolFunction


def jax_function(function: ToolFunction, result: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function of the arguments in their order; `result` makes a tuple of several arrays.

    Raises MissingPackageError without JAX; InputError unless JAX has 64 bits, in a call, too.
    """
    try:
        import jax
    except ImportError:
        raise MissingPackageError("to_jax needs JAX: pip install 'multibody-sym[jax]'") from None
    import jax.numpy as jnp

    operations, arguments, outputs = _operations(jnp), function.arguments, function.program.outputs
    taken = ", ".join(each.name for each in arguments)
    _verify_bits(jax)

    def called(*given: Any) -> Any:
        _verify_bits(jax)
        if len(given) != len(arguments):
            raise InputError(f"{function.name} takes {len(arguments)} arguments ({taken}), not {len(given)}")
        values: list[list[Any]] = []
        for argument, array in zip(arguments, given, strict=True):
            known, shape = jnp.asarray(array, dtype=float), () if argument.scalar else (len(argument.places),)
            if known.shape != shape:
                message = f"{argument.name} has the shape {known.shape}, not {shape}"
                raise InputError(f"{message}: jax.vmap takes many states")
            values.append([known] if argument.scalar else [known[k] for k in range(len(argument.places))])
        found = function.replayed(values, operations)
        arrays = [
            jnp.stack([jnp.asarray(x, dtype=float) for x in elements]).reshape(output.shape)
            if elements
            else jnp.zeros(output.shape)
            for output, elements in zip(outputs, found, strict=True)
        ]
        return arrays[0] if len(arrays) == 1 else result(*arrays)

    called.__name__ = called.__qualname__ = function.name
    called.__doc__ = f"{function.name}({taken}) -> {', '.join(output.name for output in outputs)}"
    return called


def _verify_bits(jax: Any) -> None:
    if not jax.config.jax_enable_x64:
        raise InputError("JAX computes with 32 bits: jax.config.update('jax_enable_x64', True) before its first array")


def _operations(jnp: Any) -> dict[str, Any]:
    """Return JAX's functions by operation."""
    names = "sin cos tan sinh cosh tanh exp log sqrt sign".split()
    return {name: getattr(jnp, name) for name in names} | {
        "asin": jnp.arcsin,
        "acos": jnp.arccos,
        "atan": jnp.arctan,
        "atan2": jnp.arctan2,
        "neg": operator.neg,
        "add": operator.add,
        "mul": operator.mul,
        "div": operator.truediv,
        "pow": jnp.power,
        "abs": jnp.abs,
        "min": jnp.minimum,
        "max": jnp.maximum,
        "less": lambda a, b: jnp.where(a < b, 1.0, 0.0),
        "less_equal": lambda a, b: jnp.where(a <= b, 1.0, 0.0),
        "where": lambda condition, a, b: jnp.where(condition != 0.0, a, b),
    }
