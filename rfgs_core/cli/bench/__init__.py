# SPDX-License-Identifier: Apache-2.0
"""`rfgs bench`: parts timed beside their plain twins, judged beside baselines, and tables."""

from __future__ import annotations

from typing import Annotated, Any

from tyro.conf import subcommand

from rfgs_core.cli.bench.gallery import Gallery
from rfgs_core.cli.bench.judges import Fields, Limbs, Live, People, Pictures, Real, Tracers
from rfgs_core.cli.bench.pose_networks import PoseNetworks
from rfgs_core.cli.bench.sensitivity import Sensitivity
from rfgs_core.cli.bench.speed import (
    Blender,
    Performance,
    Propagation,
    Raster,
    Readers,
    Scaling,
    Training,
)
from rfgs_core.cli.bench.tables import Table1, Table2, Table3

SUMMARY = "Times parts beside their plain twins, and judges others beside baselines."

#: Every part has its own options.
BenchArgs = (
    Annotated[Propagation, subcommand("propagation")]
    | Annotated[Raster, subcommand("raster")]
    | Annotated[Training, subcommand("training")]
    | Annotated[Readers, subcommand("readers")]
    | Annotated[Blender, subcommand("blender")]
    | Annotated[Scaling, subcommand("scaling")]
    | Annotated[Performance, subcommand("performance")]
    | Annotated[Tracers, subcommand("tracers")]
    | Annotated[Limbs, subcommand("limbs")]
    | Annotated[PoseNetworks, subcommand("posenets")]
    | Annotated[People, subcommand("people")]
    | Annotated[Pictures, subcommand("pictures")]
    | Annotated[Live, subcommand("live")]
    | Annotated[Real, subcommand("real")]
    | Annotated[Fields, subcommand("fields")]
    | Annotated[Table1, subcommand("table1")]
    | Annotated[Table2, subcommand("table2")]
    | Annotated[Table3, subcommand("table3")]
    | Annotated[Gallery, subcommand("gallery")]
    | Annotated[Sensitivity, subcommand("sensitivity")]
)


def run(args: Any) -> int:
    """Runs a part; exit code 0, or 1 where a table lacks cells."""
    return args.run()
