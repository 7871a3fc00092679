"""The four challenges of chapter 1 of the dissertation (section 1.4)."""

from pipeline.report.topics import Topic

CHALLENGES = (
    Topic(
        "prediction",
        "Prediction performances",
        "1.4",
        "A digital model must predict the behaviour of the machine accurately. The dissertation compares "
        "architectures, from incomplete physics with networks for what is not modelled to black boxes with "
        "physics-inspired features.",
        "Stochastic parameters (chapter 3), networks inside the equation of motion (chapters 4 and 6) and "
        "physics-inspired features of an LSTM (chapter 5) are trained and tested on held-out data. Chapter "
        "2 compares the plain physics with the plain network.",
        "Measurements of the wet clutch and the slider-crank, which were never published. Both benches are "
        "virtual: the order of models can be compared with the dissertation, absolute errors cannot.",
        claims=(
            *("static_inside", "dynamic_explored"),
            *("emd_gaussian", "emd_maximum_entropy"),
            *("log_likelihood_error_gaussian", "log_likelihood_error_maximum_entropy"),
            *("true_log_likelihood", "log_likelihood_overestimated", "samples_mc", "samples_qmc"),
            *("recurrent_gain", "power_law", "best_input"),
            *("f_dagger_separates", "features_lower_error", "false_jumps"),
            *("interpolation_alike", "linear_fails"),
        ),
        pages=("chapter_2", "chapter_3", "chapter_4", "chapter_5", "chapter_6"),
        verbs=("train", "evaluate", "identify_uncertainty"),
    ),
    Topic(
        "robustness",
        "Robustness",
        "1.4",
        "A model must stay reliable in operating conditions that were not in its training data, and with "
        "few training data.",
        "Models are trained on slow, stable or few experiments and simulate the rest: other speeds (chapter "
        "4), other shares of the data and left-out levels of a factor (chapter 5), other settings of cam, "
        "mass and voltage (chapter 6).",
        "Extrapolation by hybrid models of machines that are not in the dissertation.",
        claims=(
            *("static_outside", "dynamic_unseen", "region_of_operations"),
            *("scarce_data", "non_uniform_data", "without_settings"),
            *("extrapolation_hybrids", "boundary_best_h2"),
        ),
        pages=("chapter_2", "chapter_4", "chapter_5", "chapter_6"),
        verbs=("evaluate", "simulate"),
    ),
    Topic(
        "explainability",
        "Explainability",
        "1.4",
        "Engineers must be able to read what a network has learned, know which parameters can be identified "
        "beside it, and know how much the physics contributes to a prediction.",
        "The force that a network has learned becomes a formula (chapter 4), sensitivities show which "
        "parameter sets can be identified with a network (chapter 4), and DeepSHAP attributes predictions "
        "to inputs (chapter 5). Beyond the dissertation, a diagnosis names the effect that the physics "
        "leaves out. The withheld check counts how often the name is right.",
        "Laws outside of the library of effects: for a gap that no effect of the library explains, the "
        "diagnosis gives the place, but no law.",
        claims=("identifiable_sets", "spring_recovered", "attribution_moves"),
        numbers=("withheld.single.top1", "withheld.null.correct"),
        pages=("chapter_4", "chapter_5", "withheld"),
        verbs=("identifiability", "diagnose"),
    ),
    Topic(
        "validation",
        "Experimental validation",
        "1.4",
        "Methods must work on measurements of real machines, with noise and disturbances, and not only on "
        "simulated data.",
        "The public measurements of the cam-follower run through the same stages (chapters 5 and 6), and "
        "published measurements of further machines are diagnosed and compared with what is known of them. "
        "Every number of this report says whether its data are measured or virtual.",
        "Measurements of the wet clutch and the slider-crank, which were never published. Claims about the "
        "cam-follower are computed on a virtual bench too, unless the report is made with the public data "
        "set (make measured).",
        claims=("table_5_1", "nominal_count"),
        numbers=("real.cases",),
        pages=("chapter_5", "chapter_6", "real", "data"),
        verbs=("diagnose",),
    ),
)
