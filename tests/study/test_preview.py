"""A study in a few rows."""

from softsim.study.loading import study_from
from softsim.study.preview import describe


def test_a_study_in_words(folder):
    study = study_from(
        {
            "scene": "block.yaml",
            "set": {"environment.inclination": "35 deg", "time": {"end": "1 s"}},
            "factors": {
                "end": {"key": "time.end", "log_range": ["1 ms", "1 s"], "count": 7},
                "thick": {"key": "bodies.block.thickness", "values": ["5 mm", "1 cm"]},
                "friction": {"key": "contact.friction_coefficient", "range": [0, 1]},
            },
            "design": {"kind": "latin_hypercube", "count": 2000},
            "repeats": {"count": 2, "perturb": {"solver.bulk_viscosity": "5 %"}},
            "measures": {"moved": {"of": "body_displacement"}, "error": {"of": "energy_error"}},
            "optimize": {"minimize": "error", "trials": 3},
        },
        folder,
    )
    assert describe(study) == [
        ("end [ms]", "7 values, 1, 3.16228, 10 ... 1000, in equal ratios"),
        ("thick [mm]", "5, 10"),
        ("friction", "any from 0 to 1"),
        ("scene", "block.yaml"),
        ("in all cases", "environment.inclination: 35 deg, time: {end: 1 s}"),
        ("design", "latin hypercube, 4,000 cases"),
        ("repeats", "2 of each case, perturbed: solver.bulk_viscosity by 5 %"),
        ("measures", "moved [mm], error"),
        ("goal", "minimize error"),
    ]
