"""What the paper reports, to be put beside what is measured here.

Source: Cortes et al., "Optical Enhancement of Exoskeleton-Based Estimation of Glenohumeral Angles", 2016; the number of the
table or section stands with each.
"""

from dataclasses import dataclass

MOVEMENTS = ("SAbAd", "SFE", "SIR", "COMB")
"""The movement datasets, in the tables' order."""

STEP_M = 0.002
"""Increment of a marker's translation (Table 4)."""

STEPS = 10
"""Iterations of the sensitivity analysis (Table 4): translations of 0 to 20 mm."""

MEAN_RMSE_20_MM_DEG = 3.6
"""Orientation error "with marker drifts of 0.02 mts" (section 4.3.3 and Table 7)."""


@dataclass(frozen=True, slots=True)
class Reported:
    """A root mean square error with its standard deviation in parentheses."""

    rms: float
    sd: float


ACCURACY: dict[str, dict[str, Reported]] = {
    "m0_m": {  # Table 5
        "SAbAd": Reported(0.00089, 0.0001),
        "SFE": Reported(0.00060, 0.0002),
        "SIR": Reported(0.00088, 0.0001),
        "COMB": Reported(0.00097, 0.0003),
    },
    "m1_m": {  # Table 5
        "SAbAd": Reported(0.00175, 0.001),
        "SFE": Reported(0.00197, 0.0008),
        "SIR": Reported(0.00135, 0.0007),
        "COMB": Reported(0.00324, 0.002),
    },
    "position_m": {  # Table 6
        "SAbAd": Reported(0.00109, 0.0005),
        "SFE": Reported(0.00094, 0.0004),
        "SIR": Reported(0.00091, 0.0002),
        "COMB": Reported(0.00145, 0.0008),
    },
    "orientation_deg": {  # Table 6
        "SAbAd": Reported(0.92039, 0.4842),
        "SFE": Reported(0.83796, 0.3763),
        "SIR": Reported(0.73465, 0.4156),
        "COMB": Reported(1.0638, 0.5238),
    },
}
"""Tables 5 and 6, by quantity and movement; metres and degrees."""

MEAN: dict[str, float] = {"m0_m": 0.00083, "m1_m": 0.00208, "position_m": 0.00110, "orientation_deg": 0.88921}
"""Means over the movements as the text gives them (sections 4.1 and 4.2)."""

PARAMETERS: dict[str, tuple[str, str]] = {
    "q1": ("m0", "x"),
    "q2": ("m0", "y"),
    "q3": ("m0", "z"),
    "q4": ("m1", "x"),
    "q5": ("m1", "y"),
    "q6": ("m1", "z"),
}
"""Table 3: marker translated and axis; m0 along the axes of the GH joint's frame, m1 along those of the elbow joint's."""
