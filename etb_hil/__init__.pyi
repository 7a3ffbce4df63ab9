from . import plugins as plugins
from . import testing as testing
from .api.connecting import ConnectedBench as ConnectedBench
from .api.connecting import connect as connect
from .api.diagnosing import Judgement as Judgement
from .api.diagnosing import diagnose as diagnose
from .api.explaining import Explanation as Explanation
from .api.explaining import explain as explain
from .api.past import Histories as Histories
from .api.past import history as history
from .api.recordings import Recording as Recording
from .api.recordings import read as read
from .api.replaying import Replayed as Replayed
from .api.replaying import replay as replay
from .api.runs import Run as Run
from .api.runs import run as run
from .api.simulation import simulate as simulate
from .base.errors import BenchFault as BenchFault
from .base.errors import EtbHilError as EtbHilError
from .base.errors import InputError as InputError
from .base.outcome import UnitVerdict as UnitVerdict
from .plant.parameters import Model as Model
from .results.explained.causes import Cause as Cause
from .results.explanation import ExplanationResult as ExplanationResult
from .results.measurement import Measurement as Measurement
from .results.run_result import RunResult as RunResult

__version__: str
