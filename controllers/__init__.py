"""Control laws and their design rules: pure, no plant inside."""

from controllers.cascade import Cascade as Cascade
from controllers.pid import PI as PI
from controllers.pid import PID as PID
from controllers.pid import P as P
from controllers.pid import limited as limited
