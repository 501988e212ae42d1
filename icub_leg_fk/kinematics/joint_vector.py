"""Joint positions and velocities as they are given: sequences, arrays or mappings to numbers."""

from array import array
from collections.abc import Mapping, Sequence
import math
from typing import Any

from icub_leg_fk.errors import JointVectorError
from icub_leg_fk.kinematics.rotation import Array
import numpy as np
from numpy.typing import ArrayLike

JointVector = Sequence[float] | Mapping[str, float] | Array

_KINDS = {'U': 'text', 'S': 'bytes', 'c': 'complex numbers'}
_SHAPES = {1: '({n},)', 2: '(N, {n})', None: '(..., {n})'}


def joint_floats(
    q: JointVector, joint_names: Sequence[str], name: str = 'q'
) -> Sequence[float]:
    """Return one joint vector as n floats, fast; whether they are finite is not looked at.

    Args:
        q: (n,) joint positions, or a mapping from joint names; a list or tuple is fastest.
        joint_names: the n names.
        name: what q is called in an error.

    Raises:
        JointVectorError: q has not n entries, or lacks a joint.
        ArithmeticError, TypeError, ValueError: an entry of a list or tuple is not a number;
            `joint_array` says which.
    """
    if type(q) is list or type(q) is tuple:
        if len(q) == len(joint_names):
            return array('d', q)
    return joint_array(q, joint_names, 1, name).tolist()  # type: ignore[no-any-return]


def joint_array(
    q: ArrayLike | Mapping[str, ArrayLike],
    joint_names: Sequence[str],
    ndim: int | None = None,
    name: str = 'q',
) -> Array:
    """Return joint vectors in float64.

    Args:
        q: (..., n) joint positions, or a mapping from joint names to (...) ones.
        joint_names: the n names.
        ndim: number of dimensions that q must have; None if any will do.
        name: what q is called in an error.

    Raises:
        JointVectorError: q has another shape, lacks a joint, or an entry is not finite.
    """
    n = len(joint_names)
    allowed = f'{_SHAPES[ndim].format(n=n)} finite real numbers, one per joint'
    if isinstance(q, Mapping):
        values = _values(_in_order(q, joint_names, name), name, allowed)
        values = np.moveaxis(values, 0, -1)
    else:
        values = _values(q, name, allowed)
    has_shape = values.ndim == ndim if ndim else values.ndim >= 1
    if not has_shape or values.shape[-1] != n:
        raise JointVectorError(name, f'has the shape {values.shape}', allowed)
    _refuse_not_finite(values, name)
    return values


def too_large(name: str) -> JointVectorError:
    """Return the error for a vector of finite numbers that gives no finite result."""
    return JointVectorError(
        name, 'has values too large to compute with', 'finite numbers'
    )


def _in_order(
    q: Mapping[str, ArrayLike], joint_names: Sequence[str], name: str
) -> list[Any]:
    missing = [joint for joint in joint_names if joint not in q]
    if missing:
        raise JointVectorError(
            name,
            f'lacks {", ".join(missing)}',
            f'a mapping with all of {", ".join(joint_names)}',
        )
    return [q[joint] for joint in joint_names]


def _values(q: ArrayLike, name: str, allowed: str) -> Array:
    """Return an array of real numbers in float64."""
    try:
        values = np.asarray(q)
        if values.ndim and values.dtype == object:  # such as Decimal or Fraction
            values = np.reshape(array('d', values.ravel()), values.shape)
    except (OverflowError, TypeError, ValueError) as error:
        fault = (
            f'is {_type_in_words(q)} whose parts differ in length, or are not numbers'
        )
        raise JointVectorError(name, fault, allowed) from error
    is_masked = type(q).__module__.startswith(
        'numpy.ma'
    )  # whose import takes a start 7 ms
    is_number = values.dtype.kind in 'biuf' or not values.size
    if isinstance(q, (str, bytes)) or is_masked or not is_number:
        found = _type_in_words(q)
        if values.ndim:
            found += f' of {_KINDS.get(values.dtype.kind, values.dtype.name)}'
        raise JointVectorError(name, f'is {found}', allowed)
    with np.errstate(over='ignore'):
        return values.astype(float, copy=False)


def _type_in_words(q: object) -> str:
    if q is None:
        return 'None'
    return 'an array' if type(q) is np.ndarray else f'a {type(q).__name__}'


def _refuse_not_finite(values: Array, name: str) -> None:
    with np.errstate(all='ignore'):
        is_finite = math.isfinite(
            values.sum()
        )  # a mask as large as the values only if needed
    if is_finite or np.isfinite(values).all():
        return
    index = tuple(np.argwhere(~np.isfinite(values))[0].tolist())
    place = ', '.join(map(str, index))
    raise JointVectorError(f'{name}[{place}]', f'is {values[index]}', 'finite numbers')
