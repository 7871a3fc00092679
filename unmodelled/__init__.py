"""Find what a model of a machine leaves out, from logs of the machine.

    import unmodelled as um

    system = um.read_system("pendulum.yaml")
    logs = um.read_logs("logs", system)
    answer = um.diagnose(system, logs)

A name is imported when it is used first, so that importing the package costs next to nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    __version__: str
    from unmodelled.api.answer import Answer as Answer
    from unmodelled.api.answer_list import AnswerList as AnswerList
    from unmodelled.api.answer_list import list_answers as list_answers
    from unmodelled.api.audit import Audit as Audit
    from unmodelled.api.audit import audit as audit
    from unmodelled.api.comparison import Comparison as Comparison
    from unmodelled.api.comparison import compare as compare
    from unmodelled.api.diagnosis import check_law as check_law
    from unmodelled.api.diagnosis import diagnose as diagnose
    from unmodelled.api.diagnosis import read_answer as read_answer
    from unmodelled.api.example import example as example
    from unmodelled.api.fmu import write_fmu as write_fmu
    from unmodelled.api.learned_laws import LearnedLaws as LearnedLaws
    from unmodelled.api.learned_laws import learned_laws as learned_laws
    from unmodelled.api.named_effect import GapLocation as GapLocation
    from unmodelled.api.named_effect import NamedEffect as NamedEffect
    from unmodelled.api.next_experiment import NextExperiment as NextExperiment
    from unmodelled.api.next_experiment import next_experiment as next_experiment
    from unmodelled.api.parameter_study import ParameterStudy as ParameterStudy
    from unmodelled.api.parameter_study import identifiability as identifiability
    from unmodelled.api.plan import Plan as Plan
    from unmodelled.api.plan import plan as plan
    from unmodelled.api.simulation import Simulation as Simulation
    from unmodelled.api.simulation import simulate as simulate
    from unmodelled.base.errors import BadInput as BadInput
    from unmodelled.diagnosis.data.options import Options as Options
    from unmodelled.effects.own_law import Law as Law
    from unmodelled.engine.robot.supplement import supplement as supplement
    from unmodelled.learning.evaluation import Evaluation as Evaluation
    from unmodelled.learning.evaluation import evaluate as evaluate
    from unmodelled.learning.fit import Fit as Fit
    from unmodelled.learning.structures import one_per_port as one_per_port
    from unmodelled.learning.training import train as train
    from unmodelled.learning.uncertainty.identified import IdentifiedUncertainty as IdentifiedUncertainty
    from unmodelled.learning.uncertainty.identified import identify_response as identify_response
    from unmodelled.learning.uncertainty.identified import identify_uncertainty as identify_uncertainty
    from unmodelled.logs.folder import read_logs as read_logs
    from unmodelled.logs.logs import Logs as Logs
    from unmodelled.systems.model import System as System
    from unmodelled.systems.reader import read_system as read_system
    from unmodelled.systems.writer import write_system as write_system
else:
    #: Modules and the public names that they define: the imports above, which a test compares.
    _NAMES = {
        "api.answer": ("Answer",),
        "api.answer_list": ("AnswerList", "list_answers"),
        "api.audit": ("Audit", "audit"),
        "api.comparison": ("Comparison", "compare"),
        "api.diagnosis": ("check_law", "diagnose", "read_answer"),
        "api.example": ("example",),
        "api.fmu": ("write_fmu",),
        "api.learned_laws": ("LearnedLaws", "learned_laws"),
        "api.named_effect": ("GapLocation", "NamedEffect"),
        "api.next_experiment": ("NextExperiment", "next_experiment"),
        "api.parameter_study": ("ParameterStudy", "identifiability"),
        "api.plan": ("Plan", "plan"),
        "api.simulation": ("Simulation", "simulate"),
        "base.errors": ("BadInput",),
        "diagnosis.data.options": ("Options",),
        "effects.own_law": ("Law",),
        "engine.robot.supplement": ("supplement",),
        "learning.evaluation": ("Evaluation", "evaluate"),
        "learning.fit": ("Fit",),
        "learning.structures": ("one_per_port",),
        "learning.training": ("train",),
        "learning.uncertainty.identified": (
            "IdentifiedUncertainty",
            "identify_response",
            "identify_uncertainty",
        ),
        "logs.folder": ("read_logs",),
        "logs.logs": ("Logs",),
        "systems.model": ("System",),
        "systems.reader": ("read_system",),
        "systems.writer": ("write_system",),
    }
    _MODULES = {name: f"{__name__}.{module}" for module, names in _NAMES.items() for name in names}
    __all__ = sorted(_MODULES)

    def __getattr__(name: str) -> Any:
        if name == "__version__":
            return import_module("importlib.metadata").version(__name__)
        if name not in _MODULES:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        return getattr(import_module(_MODULES[name]), name)

    def __dir__() -> list[str]:
        return __all__
