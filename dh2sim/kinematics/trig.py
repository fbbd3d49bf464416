"""Sine, cosine and arctangent, correctly rounded, so that files come out the same on every machine.

The C library's functions differ in the last bit between systems. These work with whole numbers: angles and
their functions are integers over a power of two, and only the last division rounds.
"""

from __future__ import annotations

import math
from functools import lru_cache

_GUARD_BITS = 256
"""Bits behind those of the argument; a double's distance to a multiple of pi/2 takes about 62 of them."""
_USUAL_BITS = 80
"""As many are nearly always enough to see to which double a sine or a cosine rounds."""
_NODE_BITS = 8
"""Sines and cosines of multiples of 2**-8 are kept."""
_ERROR = 1 << 10
"""Upper bound of the error of ``scaled_sin_cos``, in its units."""
_SNAP_TURNS = 16
_SNAP_WIDTH = 4e-16


@lru_cache(maxsize=4096)  # robots that differ in some numbers have most of their angles in common
def sin_cos(angle: float) -> tuple[float, float]:
    """Return the sine and the cosine of ``angle``.

    An angle that is a multiple k·pi/2, ``|k|`` ≤ 16, to within the rounding of a double, which is at most
    4e-16·max(1, ``|k|``) away, is taken for that multiple and gives exact 0, 1 and -1. Everything else is
    correctly rounded.

    Args:
        angle: rad, finite.

    Returns:
        Sine and cosine; a zero is +0.0.

    Raises:
        ValueError: ``angle`` is NaN or infinite.
    """
    sine, cosine, bits = scaled_sin_cos(angle, _USUAL_BITS)
    one = 1 << bits
    rounded = (sine + _ERROR) / one, (cosine + _ERROR) / one
    if rounded == ((sine - _ERROR) / one, (cosine - _ERROR) / one):  # whatever the error is
        return rounded
    sine, cosine, bits = scaled_sin_cos(angle)
    return sine / (1 << bits), cosine / (1 << bits)


def scaled_sin_cos(angle: float, guard_bits: int = _GUARD_BITS) -> tuple[int, int, int]:
    """Return the sine and the cosine of ``angle`` before they are rounded to doubles; angles are taken as there.

    Args:
        angle: rad, finite.
        guard_bits: Bits behind those of the angle.

    Returns:
        Sine and cosine in units of 2**-bits, and bits; good to more than 70 digits with the usual guard bits.

    Raises:
        ValueError: ``angle`` is NaN or infinite.
    """
    if not math.isfinite(angle):
        raise ValueError(f"the angle must be finite, got {angle!r}")
    bits = guard_bits + (abs(math.frexp(angle)[1]) + 15 & -16)  # the same for most angles, as _node remembers it
    quadrant, rest = _reduce(angle, bits)
    if abs(quadrant) <= _SNAP_TURNS and abs(rest / (1 << bits)) <= _SNAP_WIDTH * max(1, abs(quadrant)):
        rest = 0
    return *_turn(quadrant, *_sin_cos_of_rest(rest, bits)), bits


def atan2(y: float, x: float) -> float:
    """Return the angle of the point (``x``, ``y``), correctly rounded.

    The C library's answer b is refined by the angle between the point and the direction of b,
    atan((y cos b - x sin b) / (x cos b + y sin b)).

    Args:
        y: finite.
        x: finite.

    Returns:
        The angle, rad, in (-pi, pi]; 0.0 at the origin. The signs of zeros do not matter.

    Raises:
        ValueError: ``x`` or ``y`` is NaN or infinite.
    """
    if not (math.isfinite(y) and math.isfinite(x)):
        raise ValueError(f"the coordinates must be finite, got y = {y!r}, x = {x!r}")
    if y == 0.0:
        return math.pi if x < 0.0 else 0.0
    if x == 0.0:
        return math.copysign(math.pi / 2, y)
    guess = math.atan2(y, x)
    if guess == 0.0:  # too small for a double
        return 0.0
    bits = _GUARD_BITS + abs(math.frexp(guess)[1])
    quadrant, rest = _reduce(guess, bits)
    sine, cosine = _turn(quadrant, *_sin_cos_of_rest(rest, bits))
    (y_over, y_under), (x_over, x_under) = y.as_integer_ratio(), x.as_integer_ratio()
    y_whole, x_whole = y_over * x_under, x_over * y_under
    tangent = ((y_whole * cosine - x_whole * sine) << bits) // (x_whole * cosine + y_whole * sine)
    correction = tangent - (tangent**3 // 3 >> 2 * bits)  # next term: below 1e-75 of the guess
    return (_fixed(guess, bits) + correction) / (1 << bits)


def _fixed(value: float, bits: int) -> int:
    """``value`` in units of 2**-bits, rounded down."""
    numerator, denominator = value.as_integer_ratio()  # a power of two
    return (numerator << bits) >> (denominator.bit_length() - 1)


@lru_cache(maxsize=64)
def _pi(bits: int) -> int:
    """Pi in units of 2**-bits, to within one: Machin's 16 atan(1/5) - 4 atan(1/239)."""
    extra = 16
    one = 1 << (bits + extra)
    return (16 * _arctangent_of_inverse(5, one) - 4 * _arctangent_of_inverse(239, one)) >> extra


def _arctangent_of_inverse(x: int, one: int) -> int:
    """Gregory's series for atan(1/x), in units of 1/one."""
    power, total, k, sign = one // x, 0, 1, 1
    while power:
        total += sign * (power // k)
        power, k, sign = power // (x * x), k + 2, -sign
    return total


def _reduce(angle: float, bits: int) -> tuple[int, int]:
    """Return k and the rest in units of 2**-bits such that angle = k·pi/2 + rest, with |rest| <= pi/4."""
    scaled = _fixed(angle, bits)
    finer = bits + abs(math.frexp(angle)[1])  # k has as many bits as the angle
    half_pi = _pi(finer) >> 1
    quadrant = ((scaled << (finer - bits)) + (half_pi >> 1)) // half_pi
    return quadrant, scaled - (quadrant * half_pi >> (finer - bits))


def _sin_cos_of_rest(rest: int, bits: int) -> tuple[int, int]:
    """Sine and cosine of ``rest``, at most pi/4, all in units of 2**-bits: those of the nearest node, turned on."""
    step = ((rest >> (bits - _NODE_BITS - 1)) + 1) >> 1
    if step == 0:
        return _taylor(rest, bits)
    sine, cosine = _taylor(rest - (step << (bits - _NODE_BITS)), bits)
    sine_before, cosine_before = _node(step, bits)
    return (
        (sine_before * cosine + cosine_before * sine) >> bits,
        (cosine_before * cosine - sine_before * sine) >> bits,
    )


@lru_cache(maxsize=1024)
def _node(step: int, bits: int) -> tuple[int, int]:
    """Sine and cosine of a node, step·2**-8, in units of 2**-bits."""
    return _taylor(step << (bits - _NODE_BITS), bits)


def _taylor(rest: int, bits: int) -> tuple[int, int]:
    """Sine and cosine of ``rest``, all in units of 2**-bits, by their Taylor series."""
    sine, cosine, term, k = 0, 0, 1 << bits, 0
    while term not in (0, -1):
        cosine += term
        term = (term * rest >> bits) // (k + 1)
        sine += term
        k += 2
        term = -(term * rest >> bits) // k
    return sine, cosine


def _turn(quadrant: int, sine: int, cosine: int) -> tuple[int, int]:
    """Sine and cosine of an angle that is ``quadrant`` quarter turns further."""
    match quadrant % 4:
        case 0:
            return sine, cosine
        case 1:
            return cosine, -sine
        case 2:
            return -sine, -cosine
        case _:
            return -cosine, sine
