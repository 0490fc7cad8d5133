"""Columns of the tables of each part: what terminal and documentation show of its rows."""

from ffrobot.bench.campaign import COLUMNS as OF_A_SCENE

COLUMNS = {
    **OF_A_SCENE,
    "growth": ("with", "size", "seconds_min", "order"),
    "evaluations": ("what", "seconds_min", "seconds", "aim", "of_hand_written", "of_hand_written_median"),
    "aims": ("what", "run", "status", "integrator", "tolerance", "ratio", "ratio_median", "aim", "accurate"),
    "replays": ("scene", "what", "integrator", "tolerance", "seconds", "of_pcid", "of_pcid_median", "steps",
                "steps_of_pcid", "off"),
    "peer": ("step", "gravity", "status", "seconds", "error_force", "error_displacement", "error_force_at_start"),
}  # fmt: skip
