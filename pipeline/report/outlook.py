"""The suggestions for future research of chapter 7 of the dissertation (section 7.2)."""

from pipeline.report.topics import Topic

OUTLOOK = (
    Topic(
        "convergence",
        "Local minima and identifiability of complex systems",
        "7.2.1",
        "Multiple shooting may avoid local minima in the training on long trajectories. Systems with many "
        "states need more than a local sensitivity analysis: structural and practical identifiability.",
        "Hybrid models of any system file can be trained by multiple shooting; the slider-crank is trained "
        "with it beside the training of the text. Identifiability ranks parameter sets by their "
        "sensitivities, and by the share of them that networks in the ports cannot absorb.",
        "A structural analysis: the analysis of identifiability is local, for values near those of the "
        "system file and for the given logs. Multiple shooting is compared with other training on the "
        "slider-crank only.",
        claims=("identifiable_sets",),
        numbers=("chapter4.loocv.nnap.rmse", "chapter4.loocv.nnap_shooting.rmse"),
        pages=("chapter_4",),
        verbs=("train", "identifiability"),
    ),
    Topic(
        "interpretability",
        "Automated interpretation of networks",
        "7.2.1",
        "The extraction of insights from a network should be automated, also for several inputs, for "
        "example by symbolic regression or by models that separate linear from nonlinear terms.",
        "The learned force of chapter 4 becomes a short formula, chosen by cross-validation. A diagnosis "
        "fits laws of a library in free runs and names effect, place and amount with units and intervals. "
        "The withheld check compares it with a sparse regression.",
        "A search over free expressions (symbolic regression): formulas consist of listed terms, and "
        "describe forces of one position and its velocity.",
        claims=("spring_recovered",),
        numbers=("withheld.single.top1", "withheld.sparse_regression.single"),
        pages=("chapter_4", "withheld"),
        verbs=("diagnose",),
    ),
    Topic(
        "states",
        "Unmeasured states",
        "7.2.1",
        "Measurements often do not contain the full state. Unknown dynamics add an unknown number of "
        "states, and the smallest state-space model should be found.",
        "Velocities are estimated from positions, and other unmeasured states are integrated from a given "
        "or identified initial value. A diagnosis can add an effect with a state of its own, such as a "
        "flexible transmission, a lag or the heat of a winding.",
        "A search for the smallest number of states: the named law sets the number of added states. A "
        "network in a port has no state of its own.",
        pages=("real",),
        verbs=("diagnose", "simulate"),
    ),
    Topic(
        "adaptation",
        "Systems that change with time",
        "7.2.1",
        "Temperature, wear and disturbances change a machine. Hybrid models should adapt online, without "
        "losing generalization and robustness.",
        "A diagnosis names drift along an experiment and from one experiment to the next, friction that "
        "changes with the time of running, and parameters that scatter between experiments. Answers from "
        "before and after a change of the machine stand side by side; numbers whose intervals do not "
        "overlap are marked. The notebook use_a_hybrid follows a slider-crank whose spring and friction "
        "change, sample by sample.",
        "Adaptation of networks online: their weights stay as trained.",
        pages=("real", "withheld"),
        verbs=("diagnose", "report"),
    ),
    Topic(
        "design",
        "Design",
        "7.2.2",
        "Hybrid models stay reliable for unseen designs, so they can replace physics models in the "
        "optimization of design parameters.",
        "Chapter 6 trains models on the most stable runs, simulates every setting of cam, mass and voltage, "
        "and finds the voltage at which the follower starts to jump.",
        "An optimizer of design parameters: the settings are a given grid.",
        claims=("boundary_best_h2",),
        pages=("chapter_6",),
        verbs=("simulate",),
    ),
    Topic(
        "control",
        "Control",
        "7.2.2",
        "Hybrid models can improve model-based control, if they can be evaluated fast enough.",
        "Free runs are compiled; the page Speed compares their times with those of peers. A diagnosis "
        "writes the system file with the missing effect added, and for a robot the patched URDF or MJCF "
        "file. The input of the next experiment is optimized within limits. The notebook use_a_hybrid plans "
        "a motion of the slider-crank on its learned model and runs it on the bench.",
        "A controller: the planned motion is run without feedback.",
        pages=("benchmarks",),
        verbs=("diagnose", "next"),
    ),
    Topic(
        "sensing",
        "Sensing",
        "7.2.2",
        "Kalman filters with hybrid models can estimate unknown variables while they update physical and "
        "neural parameters.",
        "Chapter 5 estimates the contact force and the distance between follower and cam from signals of "
        "the motor. The design of the next experiment names the further sensor that would help most. In the "
        "notebook use_a_hybrid, an extended Kalman filter estimates the load on the slider from the angle "
        "of the crank.",
        "A filter that also updates the parameters of networks, and knows the errors of its model: its "
        "standard deviations are too small where the network is wrong.",
        claims=("f_dagger_separates", "features_lower_error"),
        pages=("chapter_5",),
        verbs=("next",),
    ),
)
