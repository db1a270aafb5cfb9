"""Examples for the help of each command."""

from __future__ import annotations

__all__ = ["EXAMPLES", "epilog"]

EXAMPLES = {
    "info": ("info bunny.obj", "info lh.pial --json -"),
    "validate": ("validate bunny.obj", "validate bunny.obj --methods heat,windows --sources 10 --picture errors.png"),
    "distance": (
        "distance bunny.obj --source 1234 --output distance.ply --picture distance.png",
        "distance bunny.obj --source 12 --source 40 --cutoff 0.1 --output distance.npy",
        "distance bunny.obj --at 0.3,0.1,0 --method exact --json -",
        "distance scan.xyz --source 1234 --output distance.ply --picture distance.png",
    ),
    "matrix": (
        "matrix lh.midthickness --radius 20 --region cortex.npy --output within.npz",
        "matrix lh.gii --parcels atlas.dlabel.nii::cortex_left --output parcels.csv",
        "matrix bunny.obj --normalize --dtype float16 --output all.npy",
    ),
    "isolines": (
        "isolines bunny.obj --source 1234 --spacing 0.05 --output lines.obj",
        "isolines bunny.obj --source 1234 --spacing 0.05 --output lines.svg",
    ),
    "path": (
        "path bunny.obj --from 12 --to 2000 --output path.obj",
        "path bunny.obj 12 2000 0.1,0.2,0.05 --output path.obj",
    ),
    "trace": ("trace bunny.obj --from 12 --direction 1,0,0 --length 0.1 --output line.obj",),
    "signed": ("signed bunny.obj --curves loops.obj --output signed.ply",),
    "cut": (
        "cut bunny.obj --curves loops.obj --output cut.ply",
        "cut bunny.obj --curves loops.obj --output part.ply --split",
    ),
    "view": (
        "view bunny.obj --source 1234",
        "view bunny.obj --html bunny.html --exact",
        "view bunny.obj --html signed.html --curves loops.obj",
        "view scan.ply --points",
    ),
    "demo": ("demo", "demo --out results"),
    "batch": ("batch meshes --store distances.zarr --sources farthest:200",),
    "dataset": ("dataset meshes truth --normalize --format mat",),
}


def epilog(command: str) -> str | None:
    """The examples of a command, one a line, for the end of its help; None where there are none."""
    if command not in EXAMPLES:
        return None
    # click keeps the lines of a paragraph that begins with this character.
    return "\n".join(["\b", "Examples:", *(f"  heat-igl {example}" for example in EXAMPLES[command])])
