"""The Stribeck curve's exponent is the paper's, or another one: what a run says is averaged over both.

Bayesian model averaging (Hoeting, Madigan, Raftery and Volinsky 1999). Each has the same prior probability; the Bayes
factor is the posterior density of the free exponent at the paper's value over its prior density there (Dickey 1971).
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from etb_hil.diagnosis.friction_model import LOG_EXPONENT
from etb_hil.diagnosis.prior import LOG_USUAL_EXPONENT, Prior
from etb_hil.diagnosis.segment_bootstrap import Spread
from etb_hil.diagnosis.stribeck_fit import StribeckFit
from etb_hil.plant.exactmath import exp


def averaged(usual: StribeckFit, free: StribeckFit, prior: Prior) -> StribeckFit:
    """Return the average of a fit with the paper's exponent and one with a `free` exponent, which has this prior.

    Draws of the bootstrap go to each in the proportion of their probabilities, so that an interval holds both.
    """
    error = free.error({LOG_EXPONENT: 1.0})
    off = (LOG_USUAL_EXPONENT - float(free.parameters[LOG_EXPONENT])) / error
    odds = float(exp(-0.5 * off * off)) / (error * math.sqrt(prior.precision[LOG_EXPONENT]))
    share = odds / (1.0 + odds)
    parameters = share * usual.parameters + (1.0 - share) * free.parameters
    count = round(share * len(free.spread.steps))
    parts = ((usual, usual.spread.steps[:count]), (free, free.spread.steps[count:]))
    steps = np.concatenate([draws + (fit.parameters - parameters) for fit, draws in parts])
    known = share * usual.spread.known + (1.0 - share) * free.spread.known
    return replace(usual if share > 0.5 else free, parameters=parameters, spread=Spread(steps, known))
