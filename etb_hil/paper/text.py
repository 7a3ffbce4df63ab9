"""The reproduction in words: tables of Markdown that read well in a terminal too."""

from __future__ import annotations

from collections.abc import Sequence

from etb_hil.paper.estimation import CUTOFF, MARGIN
from etb_hil.paper.reproduce import Properties, Reproduction, SetUp, is_as_the_paper_says
from etb_hil.paper.setups import AMPLITUDE, ANGULAR_FREQUENCY, healthy
from etb_hil.paper.trade import Trade
from etb_hil.results import shown

_SET_UP_HEADS = (
    "fig.", "set-up", "T_st", "reached", "estimated", "short by", "off reached", "T_c", "literal", "less viscous",
    "RMS error", "lag off",
)  # fmt: skip


def document(done: Reproduction) -> str:
    """Return the whole reproduction, pictures included, as one page."""
    parts = [
        "# The seed paper's simulations, run again",
        numbers_text(done),
        "## Pictures",
        *(f"![{title}]({name}.png)" for title, name in _pictures(done)),
        "## Places that contradict each other or stay open",
        *(
            f"**{one.place}.** Printed: {one.printed}. Taken: {one.taken}. The other reading: {one.other}."
            for one in done.readings
        ),
    ]
    return "\n\n".join(parts) + "\n"


def numbers_text(done: Reproduction) -> str:
    """Return the tables."""
    set_up = (
        f"N·m at the throttle shaft. Estimator at 20 kHz, M = {MARGIN * healthy().stiction:.2f} N·m, two poles at "
        f"{CUTOFF:.0f} Hz; PD and feed-forward at 1 kHz."
    )
    production = (
        "The same motions with production sensors (encoder, noisy current, no velocity). The model is off inside "
        "its tolerances, by this project's fit, with 95 % intervals. No unit passes: the plate slides slowly only "
        "where it turns round, so that T_st in the middle of its way stays unseen (`places_not_seen`):"
    )
    fitted = _table(("fig.", "T_st", "error", "T_c", "error", "verdict"), [_fitted(one) for one in done.set_ups])
    trades = [_trade(kind, one) for kind, one in done.trades.items()]
    table = _table(_SET_UP_HEADS, [_set_up(one) for one in done.set_ups])
    return "\n\n".join([set_up, table, _claims(done), production, fitted, *trades, _properties(done.properties)])


def _claims(done: Reproduction) -> str:
    failed = is_as_the_paper_says(done)
    if failed:
        return f"Not as the paper says: {'; '.join(failed)}."
    return (
        "What the paper says of its figures holds: T_st and T_c differ little when healthy and clearly when faulty, "
        "and the faulty unit's T_st is underestimated."
    )


def _pictures(done: Reproduction) -> list[tuple[str, str]]:
    return [
        ("Figure 2", "fig2_friction"),
        ("Figure 3", "fig3_spring"),
        *((f"Figure {one.figure}", one.picture) for one in done.set_ups),
        ("The trade, sinusoid", "trade_sinusoid"),
        ("The trade, steps", "trade_steps"),
        ("Property 3", "property3"),
    ]


def _set_up(one: SetUp) -> list[str]:
    n = one.numbers
    return [
        str(one.figure),
        one.title,
        f"{n.true_stiction:.3f}",
        f"{n.reached:.3f}",
        f"{n.stiction:.3f}",
        f"{n.underestimated:+.1%}",
        f"{n.underestimated_by_filter:+.1%}",
        f"{n.true_coulomb:.3f}",
        "-" if n.coulomb_literal is None else f"{n.coulomb_literal:.3f}",
        "-" if n.coulomb is None else f"{n.coulomb:.3f}",
        f"{n.error:.3f}",
        f"{n.error_unlagged:.3f}",
    ]


def _fitted(one: SetUp) -> list[str]:
    cells = [str(one.figure)]
    for name, true in (("T_st", one.numbers.true_stiction), ("T_c", one.numbers.true_coulomb)):
        number = one.diagnosis.measurements.get(name)
        if number is None or number.value is None:
            cells += ["-" if number is None else shown.value(number), "-"]
        else:
            cells += [
                f"{number.value:.3f} ({number.low:.3f} to {number.high:.3f})",
                f"{number.value / true - 1.0:+.1%}",
            ]
    return [*cells, str(one.diagnosis.verdict)]


def _trade(kind: str, one: Trade) -> str:
    rows = [
        [f"{switching:.2f}"]
        + [f"{1.0 - one.read[row, k]:+.0%} ({one.error[row, k]:.0%})" for k in range(len(one.cutoffs))]
        for row, switching in enumerate(one.switching)
    ]
    rows.append(["filter alone"] + [f"{1.0 - value:+.0%}" for value in one.filtered[0]])
    return (
        f"The trade, faulty unit, {kind}: T_st underestimated (RMS error over T_c) by cut-off and M. Friction itself "
        f"stays {1.0 - one.reached:.1%} below T_st.\n\n"
        + _table(("M / N·m", *(f"{cutoff:.0f} Hz" for cutoff in one.cutoffs)), rows)
    )


def _properties(found: Properties) -> str:
    steady = max(found.healthy.steady, found.faulty.steady)
    passages = "; ".join(
        f"from z_0 = {one.start:+.1f} T_st / sigma_0, z passes zero {one.zeros} x, friction comes to {one.torque:.3f} "
        f"T_st and settles at {one.end:.3f} T_c"
        for one in found.passages
    )
    limits = ", ".join(f"{one.acceleration:.3g} rad/s² at {one.stribeck_velocity:.3g} rad/s" for one in found.slow)
    first = (
        f"Property 1: over random motions sigma_0 |z| stays below {found.healthy.bristles:.3f} T_st (healthy) and "
        f"{found.faulty.bristles:.3f} T_st (faulty); friction of steady sliding is the formula's within "
        f"{steady:.0e} N·m."
    )
    third = (
        f"Property 3, f(omega_s) up to which sigma_0 z comes within 2 % of T_st, faulty unit: {limits}; it goes with "
        f"the square of omega_s. The healthy unit's is {found.slow_healthy.acceleration:.3g} rad/s². The sinusoid "
        f"passes zero at {AMPLITUDE * ANGULAR_FREQUENCY**2:.0f} rad/s²: too quick for the property, so that friction "
        "itself stays below T_st."
    )
    lines = (
        first,
        f"Property 2, faulty unit, velocity rising at a constant rate from -0.5 to 4 omega_s: {passages}.",
        third,
    )
    return "\n".join(f"- {line}" for line in lines)


def _table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    widths = [max(len(row[k]) for row in (heads, *rows)) for k in range(len(heads))]
    lines = [heads, ["-" * width for width in widths], *rows]
    return "\n".join(
        "| " + " | ".join(cell.ljust(w) for cell, w in zip(line, widths, strict=True)) + " |" for line in lines
    )
