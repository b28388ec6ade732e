"""Values with their units as a person reads them."""

from __future__ import annotations

PREFIXES = ((1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))


def suitable_unit(largest: float | None, unit: str) -> tuple[float, str]:
    """Return a factor and the unit with prefix in which values of at most `largest` (in `unit`) read well."""
    for factor, prefix in PREFIXES:
        if largest and largest >= factor:
            return 1.0 / factor, prefix + unit
    return 1.0, unit


def engineering(value: float | None, unit: str) -> str:
    """Return a value for a person: three significant digits with a prefix that suits, or a dash."""
    if value is None:
        return "–"
    if value == 0.0:
        return f"0 {unit}"
    for factor, prefix in PREFIXES:
        if abs(value) >= 0.9995 * factor:
            return f"{_three_digits(value / factor)} {prefix}{unit}"
    return f"{value:.2g} {unit}"


def plain(value: float | None, unit: str) -> str:
    """Return a value for a person like :func:`engineering`, but with no prefix for small ones."""
    if value is None or value >= 999.5:
        return engineering(value, unit)
    return f"{value:#.3g}".rstrip(".") + f" {unit}"


def in_millimetres(distance: float | None) -> str:
    """Return a distance (m) to the hundredth of a millimetre, a smaller one by its first digit, or a dash."""
    if distance is None:
        return "–"
    return f"{1e3 * distance:.2f} mm" if distance >= 1e-5 else f"{1e3 * distance:.1g} mm"


def _three_digits(value: float) -> str:
    decimals = 2 if abs(value) < 9.995 else 1 if abs(value) < 99.95 else 0
    return f"{value:.{decimals}f}"
