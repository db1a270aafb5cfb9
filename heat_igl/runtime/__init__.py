"""Execution: threads, blocks of right-hand sides, progress, memory, the range of doubles, warnings."""

from heat_igl.runtime.blocks import WORKING_MEMORY, block_size, in_blocks, in_order
from heat_igl.runtime.heat_range import LARGEST_EXPONENT, LOWEST_HEAT, RANGE_LIMIT, SOURCE_HEAT
from heat_igl.runtime.memory import PeakMemory, available_memory, release_free_memory, resident_memory
from heat_igl.runtime.progress import TimeLeft, progress_bar, rich_progress
from heat_igl.runtime.rows import float_type, row_writer
from heat_igl.runtime.threads import both, n_threads, over_rows, pool, side_by_side
from heat_igl.runtime.warn import held_warnings, warn_caller

__all__ = [
    "LARGEST_EXPONENT",
    "LOWEST_HEAT",
    "PeakMemory",
    "RANGE_LIMIT",
    "SOURCE_HEAT",
    "WORKING_MEMORY",
    "available_memory",
    "TimeLeft",
    "block_size",
    "both",
    "float_type",
    "held_warnings",
    "in_blocks",
    "in_order",
    "n_threads",
    "over_rows",
    "pool",
    "progress_bar",
    "release_free_memory",
    "resident_memory",
    "rich_progress",
    "row_writer",
    "side_by_side",
    "warn_caller",
]
