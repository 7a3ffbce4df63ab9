"""The rows of a virtual end-of-line run, as its diagnosis gets them."""

from unittest import mock

from end_of_line_study import job_of, run

from etb_hil.diagnosis.diagnosis import Diagnosis


def pushed_rows():
    """Return the rows of a healthy unit with the phase of each, and the model of the bench."""
    job, found, usual = job_of(), [], Diagnosis.push

    def push(self, rows, phase):
        found.append((rows, phase))
        usual(self, rows, phase)

    with mock.patch.object(Diagnosis, "push", push):
        run(job, job.unit, 5, piece_s=0.1)
    return found, job.model
