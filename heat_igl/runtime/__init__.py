"""How work is run: threads, blocks of right-hand sides, memory, compiled kernels."""

from heat_igl.runtime.blocks import (
    WORKING_MEMORY,
    block_size,
    float_type,
    in_blocks,
    in_order,
    progress_bar,
    rich_progress,
    row_writer,
)
from heat_igl.runtime.memory import PeakMemory, release_free_memory, resident_memory
from heat_igl.runtime.threads import n_threads, pool, side_by_side

__all__ = [
    "PeakMemory",
    "WORKING_MEMORY",
    "block_size",
    "float_type",
    "in_blocks",
    "in_order",
    "n_threads",
    "pool",
    "progress_bar",
    "release_free_memory",
    "resident_memory",
    "rich_progress",
    "row_writer",
    "side_by_side",
]
