"""What somebody else's typed program does with the interface; it is checked, not run."""

from pathlib import Path

import numpy as np
import numpy.typing as npt

import etb_hil as etb


def margin(run: etb.Run) -> float:
    found = run.measurements["return_margin"]
    interval: tuple[float, float] | None = found.interval
    return interval[0] if interval else 0.0


def judged(log: Path) -> list[str]:
    recording: etb.Recording = etb.read(log, bench="virtual_fd")
    current: npt.NDArray[np.float64] = recording["motor_current"].values
    result: etb.Judgement = etb.diagnose(recording, limits="default")
    words = [reason.text for reason in result.reasons]
    if result.verdict is etb.UnitVerdict.FAIL and current.size:
        why: etb.Explanation = etb.explain([recording, log], model=etb.Model.load("default"), progress=print)
        words += [f"{cause.id}: {cause.share_of_error:.0%}" for cause in why.causes]
        if why.model is not None:
            simulated = etb.simulate(why.model, voltage=recording)
            words.append(str(simulated.to_pandas().shape))
    return words


def many(folders: list[Path]) -> dict[Path, str]:
    try:
        return {one.path: one.error or str(one.verdict) for one in etb.replay(folders, jobs=2)}
    except etb.InputError as error:
        return {Path(): str(error)}


def everything(folder: Path) -> etb.RunResult:
    run = etb.run("friction_check", bench="virtual_fd", unit="faulty", seed=7, folder=folder)
    print(run, margin(run), run.series["time"].max(), etb.history(folder).measurements.columns)
    return run.result
