# SPDX-License-Identifier: Apache-2.0
"""`rfgs pose`: tracks and joints of the people in a run."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import tyro


@dataclass(frozen=True)
class PoseArgs:
    """Tells the joints of each person and writes RUN/pose.npz and RUN/pose.png.

    Where the run knows limbs they are those of its posed bodies, which are also written as motion
    capture, RUN/person0.bvh and so on, with a deviation for each joint; else a 17-joint body is
    fitted to each person's Gaussians.

    The errors are printed beside those of a standing body of average height at the same place,
    which knows nothing of the limbs: only what beats it was seen by radio. RUN/pose.json holds
    them. Where the network told limbs, how tall people are is printed too, beside what the same
    body shape has with the true limbs. Where limbs are told, each joint has an expected
    error: joints below 0.06 m count as seen, and how many of these are within 0.08 m is printed.
    """

    run: tyro.conf.Positional[Path]
    """Folder of a trained run."""


def run(args: PoseArgs) -> int:
    """Prints the errors; exit code 0."""
    import numpy as np
    from tqdm import tqdm

    from rfgs_core.arrays import save_arrays
    from rfgs_core.figures.poses import write_pose_chart
    from rfgs_core.files import write_json
    from rfgs_core.pose import estimate_poses, score_poses
    from rfgs_core.pose.bvh import write_bvh
    from rfgs_core.run import open_run
    from rfgs_core.run.limbs import read_limbs

    trained = open_run(args.run)
    trained.need_frames()
    with tqdm(total=len(trained.frames) * trained.config.settings.bodies, desc="pose") as bar:
        estimate = estimate_poses(trained, bar.update)
    scores = score_poses(estimate, trained.sequence)
    arrays = {name: getattr(estimate, name) for name in ("time_s", "centroid", "joints")}
    if estimate.sigma_m is not None:
        arrays["sigma_m"] = estimate.sigma_m
    limbs = read_limbs(args.run)
    if limbs is not None:
        arrays |= {"root": limbs.people.root, "turns": limbs.people.turns}
        for number in range(len(limbs.people.coefficients)):
            write_bvh(args.run / f"person{number}.bvh", limbs.people, number, estimate.time_s)
    save_arrays(args.run / "pose.npz", {"frames": np.array(estimate.frames), **arrays})
    write_json(args.run / "pose.json", scores)
    truth = [trained.sequence.joints(frame) for frame in estimate.frames]
    write_pose_chart(args.run / "pose.png", estimate, truth)
    for name in ("fit", "standing"):
        own = scores[name]
        if own["mpjpe_m"] is None:
            sys.stdout.write("this scene does not tell its people's joints: no error is known\n")
            break
        sys.stdout.write(
            f"{name:<9} joints {own['mpjpe_m']:.3f} m, with the pelvis in place "
            f"{own['aligned_m']:.3f} m{_each(own['people_m'])}\n"
        )
    else:
        sys.stdout.write(
            f"tracked {scores['tracked']:.2f}, identity kept {scores['identity_kept']:.2f}, "
            f"posture right {scores['posture_right']:.2f} ({scores['seated']} of "
            f"{scores['people']} sit)\n{_missed(scores['matched'], scores['people'])}"
        )
    sys.stdout.write(_height(scores["heights_m"], scores["true_heights_m"]))
    if scores["joints_seen"] is not None:
        sys.stdout.write(_seen(scores["joints_seen"], scores["confidence"]))
    sys.stdout.write(f"{args.run / 'pose.png'} written\n")
    return 0


def _missed(matched: int, present: int) -> str:
    """A line that errors leave some people out, if they do."""
    if matched >= present:
        return ""
    return (
        f"errors    of {matched} of {present} people, each counted in every frame: the others have "
        "no body\n"
    )


def _each(people_m: list[float]) -> str:
    """Errors of single people, where there are several [m]."""
    if len(people_m) < 2:
        return ""
    return "; each person " + ", ".join(f"{error:.3f}" for error in people_m) + " m"


def _height(told_m: list[float] | None, true_m: list[float] | None) -> str:
    """A line of how tall people are [m], where the network told."""
    if told_m is None:
        return ""
    told, true = (", ".join(f"{one:.2f}" for one in each or []) for each in (told_m, true_m))
    return f"height    {told} m" + (f"; by the true limbs {true} m\n" if true else "\n")


def _seen(of_joints: dict[str, float], confidence: dict[str, float | None] | None) -> str:
    """Lines of which joints count as seen, and whether that holds."""
    from rfgs_core.pose.confidence import NEAR_M, SEEN_M

    unsure = [name.replace("_", " ") for name, share in of_joints.items() if share < 0.5]
    share = sum(of_joints.values()) / len(of_joints)
    lines = f"seen      {100 * share:.0f} % of joints, expected within {SEEN_M:g} m"
    if confidence is not None and confidence["seen_near"] is not None:
        lines += (
            f"; {100 * confidence['seen_near']:.0f} % of these are within {NEAR_M:g} m (mean "
            f"error over mean expected error {confidence['error_over_sigma']:.2f})"
        )
    named = 0 < len(unsure) < len(of_joints)
    return lines + "\n" + (f"unsure    {', '.join(unsure)}\n" if named else "")
