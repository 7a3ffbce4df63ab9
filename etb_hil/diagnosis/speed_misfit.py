"""Whether a run bears its likeliest law of friction out at every speed.

Only the law's form separates T_c, omega_s and viscosity. Where friction at some speeds is off the
law, as by losses in the motor's iron, the form is another one, and none of the three is known from it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from etb_hil.diagnosis.assessment import Assessment
from etb_hil.diagnosis.drift import SPEEDS
from etb_hil.diagnosis.law_score import score_of
from etb_hil.diagnosis.result import Reason
from etb_hil.diagnosis.stribeck_fit import Linearised
from etb_hil.diagnosis.window_weights import weights_of
from etb_hil.recording.samples import Float64

# Standard errors. Of 308 units whose friction goes by a law 306 reach 2.2 in a run at most, and 29 of 36 with iron
# losses more than 2.5 (`benchmarks/interval_coverage.py`, and `verdicts_under_effects.py --effects iron_loss`).
_SURE = 2.5
# Share of T_st: less says nothing of the form. Where hundreds of windows have one speed, healthy runs of the virtual
# bench are surely off by 0.1 %.
_MATTERS = 0.003


@dataclass(frozen=True, slots=True)
class SpeedMisfit:
    """Friction off the likeliest law: by `torque` N·m about `speed` rad/s.

    It is off in the half octave of that speed.
    """

    speed: float
    torque: float

    def at(self, speeds: Float64) -> Float64:
        """Return by how many N·m friction is off the law at speeds (n) in rad/s."""
        return np.where(np.searchsorted(SPEEDS, speeds) == np.searchsorted(SPEEDS, self.speed), self.torque, 0.0)


def speed_misfit(assessment: Assessment) -> SpeedMisfit | None:
    """Return where friction over speed is most surely off the likeliest law.

    None where it is nowhere. Each half octave of speed may have a level of its own beside the law; its score says
    whether it has (Rao 1948), and by how much.
    """
    if not assessment.laws:
        return None
    law, evidence = assessment.laws[0], assessment.evidence
    fit, count = law.fit, law.prior.count
    weight = weights_of(evidence, fit.parameters, fit.residual).of_sliding
    speed, way = np.abs(evidence.velocity), np.sign(evidence.velocity)
    octave = np.searchsorted(SPEEDS, speed)
    levels = np.unique(octave[weight > 0.0])
    own = np.where(octave[:, None] == levels, way[:, None], 0.0)
    at = Linearised(fit.parameters, fit.residual, np.concatenate([fit.jacobian, own], axis=1))
    worst, found = _SURE, None
    for place, level in enumerate(levels.tolist()):
        score = score_of(evidence, law.prior, at, range(count), count + place, weight)
        if not score.information > 0.0:  # the fitted parameters take all of it
            continue
        variance = max(score.information, score.squares)  # neither few segments nor one of them make it small
        if abs(score.total) > worst * math.sqrt(variance):
            torque = score.total / score.information
            if abs(torque) > _MATTERS * fit.stiction[0]:
                worst = abs(score.total) / math.sqrt(variance)
                found = SpeedMisfit(float(speed[(octave == level) & (weight > 0.0)].mean()), torque)
    return found


def speed_remarks(misfit: SpeedMisfit | None) -> list[Reason]:
    """Return the remark on friction that goes by no fitted law.

    The remark is made whatever the verdict.
    """
    if misfit is None:
        return []
    text = (
        f"at about {misfit.speed:.2g} rad/s friction is {1e3 * misfit.torque:+.1f} mN·m off the likeliest law of "
        "friction: T_c and viscosity are bounded above only, and omega_s is not given"
    )
    return [Reason("friction_by_no_law", text)]
