"""What every position law has in common.

A law is a file with two functions. `gains(nominal) -> float64 (n)`, n <= `GAINS`, designs it for a nominal plant. The
compiled `torque(gain, memory, error, rate)` returns the torque in N·m at the throttle shaft for an angle error in rad
and a velocity error in rad/s, once each millisecond, on top of the feed-forward. `memory` (float64, `MEMORY`) is the
law's own from tick to tick and zero when the bridge goes on, but for `CUT_OFF`, which the drive writes.
"""

CONTROL_PERIOD = 1e-3  # s
GAINS = 4
MEMORY = 2
CUT_OFF = 0  # index in memory: torque in N·m that the voltage limit kept back at the last tick
