"""Questions over many actuators: cases and their files, tuning, hunting maps, reports, the command line."""

from studies.cases import Case as Case
from studies.cases import built_in as built_in
from studies.cases import load_case as load_case
from studies.files import CaseError as CaseError
