"""Pictures for the documentation, from generated shapes and from a mesh of the pymeshlab wheel.

``python docs/gallery.py --out DIR`` writes the pictures, an interactive page, and gallery.md with pictures and code.
"""

from __future__ import annotations

import argparse
import inspect
import re
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

import heat_igl
from heat_igl import shapes
from heat_igl.drawing import Page, Picture, page, plot, plot_field, plot_labels


def torus() -> Picture:
    """Stripes of equal distance from one vertex, with kinks at the cut locus."""
    mesh = shapes.torus(160, 80)
    phi = heat_igl.HeatMethodSolver(mesh).distance(0)
    return plot(mesh, phi, sources=0, style="stripes", view=(30, 50))


def bunny() -> Picture:
    """Isolines of the distance from the nearest of three vertices."""
    mesh = heat_igl.sample_mesh()
    sources = [1234, 400, 2000]
    phi = heat_igl.HeatMethodSolver(mesh).distance(sources)
    return plot(mesh, phi, sources=sources)


def heat() -> Picture:
    """The heat after step 1, which decays exponentially with distance."""
    mesh = shapes.disk(40)
    solution = heat_igl.HeatMethodSolver(mesh).solve(0)
    return plot_field(mesh, np.log10(solution.heat), spacing=5, label="log10 of heat", sources=0, colormap="magma")


def error() -> Picture:
    """The error of the heat method on a sphere: distance is too short at the antipode of the source."""
    mesh = shapes.icosphere(5)
    source = int(np.argmax(mesh.V[:, 2]))
    phi = heat_igl.HeatMethodSolver(mesh).distance(source)
    exact = np.arccos(np.clip(mesh.V @ mesh.V[source], -1, 1))
    relative = np.divide(phi - exact, exact, out=np.zeros_like(exact), where=exact > 0)
    return plot_field(mesh, 100 * relative, limits=(-2, 2), label="error, % of exact", view=(150, -20))


def book() -> Picture:
    """Five pages that share an edge, which shortest paths cross."""
    mesh = shapes.book(5, 24)
    phi = heat_igl.HeatMethodSolver(mesh).distance(40)
    return plot(mesh, phi, sources=40, view=(35, 35))


def asked() -> Page:
    """An interactive page: a click moves the source."""
    mesh = shapes.torus(100, 50)
    phi = heat_igl.HeatMethodSolver(mesh).distance(0)
    return page(mesh, phi, sources=0, view=(30, 50), title="Distance on a torus", method="Distance by the heat method.")


def near() -> Picture:
    """Exact distance, searched no farther than a cutoff: the rest of the surface costs nothing."""
    mesh = heat_igl.sample_mesh()
    phi = heat_igl.geodesic_distance(mesh, 1234, method="exact", cutoff=0.2 * mesh.longest_distance)
    return plot(mesh, phi, sources=1234)


def paths() -> Picture:
    """Shortest paths from one vertex to the farthest points of the surface."""
    mesh = heat_igl.sample_mesh()
    solver = heat_igl.GeodesicSolver(mesh)
    ends = heat_igl.farthest_points(solver, 40, start=1234)[1:]
    paths = heat_igl.shortest_paths(mesh, ends, 1234)
    return plot(mesh, solver.distance(1234), sources=1234, curves=paths)


def cells() -> Picture:
    """Geodesic Voronoi cells of farthest points."""
    mesh = heat_igl.sample_mesh()
    found = heat_igl.farthest_cells(mesh, 40)
    return plot_labels(mesh, found.labels, distance=found.distance, sources=found.sites)


def samples() -> Picture:
    """Three hundred farthest points, and the distance from the nearest."""
    mesh = shapes.blob(5)
    cells = heat_igl.farthest_cells(mesh, 300)
    return plot(mesh, cells.distance, sources=cells.sites, style="plain")


def dual() -> Picture:
    """The dual triangulation of geodesic Voronoi cells: a coarse mesh with the shape of the fine one."""
    mesh = shapes.torus(120, 60)
    coarse = heat_igl.sampling.dual_triangulation(mesh, heat_igl.farthest_cells(mesh, 400))
    return plot(coarse, heat_igl.geodesic_distance(coarse, 0), sources=0, view=(30, 50))


def curve() -> Picture:
    """Distance from a closed curve that is projected onto the surface."""
    mesh = shapes.icosphere(5)
    angle = np.linspace(0, 2 * np.pi, 200)[:-1]
    ring = np.stack([np.cos(angle), np.sin(angle), 0.4 * np.sin(3 * angle)], axis=1)
    source = heat_igl.curve_on(mesh, ring / np.linalg.norm(ring, axis=1, keepdims=True), closed=True)
    return plot(mesh, heat_igl.geodesic_distance(mesh, source), sources=source)


def region() -> Picture:
    """Distance from a region, given as a mask of vertices."""
    mesh = shapes.blob(5)
    region = mesh.V[:, 1] > 0.6 * mesh.V[:, 1].max()
    return plot(mesh, heat_igl.geodesic_distance(mesh, region))


def offsets() -> Picture:
    """Curves at a given distance from two vertices."""
    mesh = heat_igl.sample_mesh()
    solver = heat_igl.GeodesicSolver(mesh)
    phi = solver.distance([1234, 2000])
    found = heat_igl.curves.offset_curves(mesh, solver, [1234, 2000], 0.3 * phi.max())
    return plot(mesh, phi, sources=[1234, 2000], style="plain", curves=found)


def scribble() -> Picture:
    """Signed distance from a loop with four gaps."""
    mesh = shapes.torus(160, 80)
    angle = np.linspace(0, 2 * np.pi, 200)
    x = np.cos(angle) * (0.55 + 0.15 * np.cos(3 * angle))
    loop = np.stack([0.9 + 0.55 * x, np.sin(angle) * 0.6, np.full(200, 0.39)], axis=1)
    places = heat_igl.closest_points(mesh, loop).points.positions(mesh)
    arcs = [heat_igl.curve_on(mesh, places[i : i + 36]) for i in (0, 50, 100, 150)]
    phi = heat_igl.SignedHeatSolver(mesh).distance(arcs)
    return plot_field(mesh, phi, label="signed distance", limits=(-1, 1), spacing=0.1, curves=arcs, view=(10, 60))


def grown() -> Picture:
    """A region of disks, with lines at which it is grown and shrunk: signed distance from the boundary."""
    mesh = heat_igl.sample_mesh()
    sites = np.random.default_rng(2).choice(mesh.n_vertices, 25, replace=False)
    region = heat_igl.HeatMethodSolver(mesh).distance(sites) < 0.07
    phi = heat_igl.SignedHeatSolver(mesh).distance(region)
    outline = heat_igl.isolines(mesh, phi, [0])[0]
    return plot_field(mesh, phi, label="signed distance", spacing=0.03, limits=(-0.12, 0.12), curves=outline)


def noisy() -> Picture:
    """The inside of noisy samples of a curve, with one normal in six that points the wrong way."""
    mesh, rng = shapes.grid(60), np.random.default_rng(5)
    angle = rng.uniform(0, 2 * np.pi, 150)
    radius = 0.3 + 0.06 * np.cos(3 * angle) + rng.uniform(-0.02, 0.02, 150)
    outwards = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    points = heat_igl.closest_points(mesh, mesh.V.mean(axis=0) + radius[:, None] * outwards).points
    normals = np.where(rng.permutation(150) < 25, -1, 1)[:, None] * outwards
    phi = heat_igl.SignedHeatSolver(mesh, t_coef=8).distance(heat_igl.OrientedPoints(points, normals))
    return plot_field(mesh, phi, label="signed distance", spacing=0.05, sources=points)


def tool_path() -> Picture:
    """A pocket on a turned part: offsets inwards, on which a tool clears it, and one outwards, the clearance."""
    # A flange, a cone and a shaft: a section (radius, height), turned about the y axis.
    section = np.array([(0.9, 0), (0.9, 0.4), (0.75, 0.4), (0.35, 1), (0.35, 1.4)])
    ends = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(section, axis=0), axis=1))])
    x, y, along = shapes.cylinder(300, 150, ends[-1]).V.T
    radius, height = (np.interp(along - along.min(), ends, column) for column in section.T)
    turned = np.stack([radius * y, height, radius * x], axis=1)
    part = heat_igl.Mesh(turned, shapes.cylinder(300, 150).F)
    # The shortest closed polygon through six points.
    angle, reach = np.radians([-45, 0, 45, 40, 0, -40]), np.array([0.9, 0.9, 0.9, 0.48, 0.58, 0.48])
    corners = np.stack([reach * np.sin(angle), [0.15, 0.15, 0.15, 0.8, 0.65, 0.8], reach * np.cos(angle)], axis=1)
    contour = heat_igl.geodesic_path(part, heat_igl.closest_points(part, [*corners, corners[0]]).points)
    phi = heat_igl.SignedHeatSolver(part).distance(contour)
    paths = heat_igl.isolines(part, phi, [*np.arange(-0.06, phi.min(), -0.06), 0.06])
    drawn = [contour, *(curve for level in paths for curve in level)]
    return plot_field(part, phi, label="signed distance", limits=(-0.4, 0.4), curves=drawn, view=(0, 25))


def pieces() -> Picture:
    """A surface cut along a curve and two offsets of it, the pieces moved apart."""
    mesh, axis = shapes.blob(5), np.array([0.2, 1, 0.3])
    phi = heat_igl.SignedHeatSolver(mesh).distance(heat_igl.isolines(mesh, mesh.V @ axis, [0]))
    found = heat_igl.cut(mesh, heat_igl.isolines(mesh, phi, [-0.4, 0, 0.4]))
    carried, parts = found.carry(phi), found.split()
    moved = [part.mesh.V + 2 * carried[part.vertices].mean() * axis for part in parts]
    first = np.cumsum([0, *(len(V) for V in moved)])
    F = np.concatenate([part.mesh.F + start for part, start in zip(parts, first, strict=False)])
    values = np.concatenate([carried[part.vertices] for part in parts])
    return plot_field(heat_igl.Mesh(np.concatenate(moved), F), values, label="signed distance", view=(20, 20))


def tetrahedra() -> Picture:
    """Distance through a solid of tetrahedra, along straight lines."""
    mesh = shapes.box(12, (2.0, 1.0, 1.0))
    return plot(mesh, heat_igl.GeodesicSolver(mesh).distance(0), sources=0, view=(215, -30))


def voxels() -> Picture:
    """Distance through voxels, in lines that bend around the edges of a wall."""
    mask = np.ones((10, 24, 24), bool)
    mask[:, :18, 11] = False
    body = heat_igl.image_domain(mask)
    source = body.index[-1, 4, 4]
    return plot(body.mesh, heat_igl.GeodesicSolver(body.mesh).distance(source), sources=source, view=(25, 50))


def polygons() -> Picture:
    """Distance on quadrilaterals, which stay as they are."""
    rows, columns = np.mgrid[:60, :60]
    V = np.stack([columns / 59, 0.1 * np.sin(columns / 8) * np.cos(rows / 8), rows / 59], axis=-1).reshape(-1, 3)
    at = np.arange(3600).reshape(60, 60)
    F = np.stack([at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]], axis=-1).reshape(-1, 4)
    mesh = heat_igl.PolygonMesh(V, F)
    return plot(mesh, heat_igl.HeatMethodSolver(mesh).distance(1830), sources=1830, view=(30, 45))


def cloud() -> Picture:
    """Distance on points without faces, drawn on the triangles that the cloud finds for itself."""
    P = np.random.default_rng(0).standard_normal((4000, 3))
    cloud = heat_igl.PointCloud(P / np.linalg.norm(P, axis=1, keepdims=True) * [1.0, 0.6, 0.8])
    phi = heat_igl.GeodesicSolver(cloud).distance(0)
    return plot(cloud.triangles, phi, sources=0)


def scan() -> Picture:
    """A scan of hilly ground with noise, and a pond without points: each point is drawn as a disc."""
    rng = np.random.default_rng(3)
    x, y = rng.uniform(-3, 3, (2, 20000))
    height = 1.5 * np.exp(-((x - 1) ** 2) - y**2) + np.exp(-((x + 1.5) ** 2) - (y - 1) ** 2)
    ground = np.stack([x, y, height + 0.01 * rng.standard_normal(len(x))], axis=1)
    cloud = heat_igl.PointCloud(ground[np.hypot(x + 0.8, y + 1.4) > 0.7])
    source = int(np.argmax(cloud.P[:, :2].sum(axis=1)))
    return plot(cloud, heat_igl.geodesic_distance(cloud, source), sources=source, view=(20, -40), up="z")


def directions() -> Picture:
    """The first coordinate of the log map: how far along one direction of the tangent plane each vertex lies."""
    mesh = shapes.blob(5)
    x, _ = heat_igl.VectorHeatSolver(mesh).log_map(0).T
    return plot_field(mesh, x, spacing=0.2, label="x of the log map", sources=0)


def straightest() -> Picture:
    """Straightest geodesics in all directions from one vertex."""
    mesh = shapes.torus(120, 60)
    angles = np.linspace(0, 2 * np.pi, 25)[:-1]
    rays = [heat_igl.trace_geodesic(mesh, 0, (np.cos(angle), np.sin(angle)), 2.0) for angle in angles]
    return plot(mesh, heat_igl.geodesic_distance(mesh, 0), sources=0, style="plain", curves=rays, view=(30, 50))


def checkerboard() -> Picture:
    """A checkerboard in the coordinates of the log map, which is exact as far as the cut locus."""
    mesh = shapes.blob(6)
    log = heat_igl.log_map(mesh, 0)
    # Interpolated and cut off, a product of sines has straight borders within triangles, which a jump has not.
    board = np.sin(log / 0.25 * np.pi).prod(axis=1)
    shown = np.where(np.hypot(*log.T) < 2, board, 0.0)
    return plot_field(mesh, shown, label="checkerboard", limits=(-0.02, 0.02), sources=0, colormap="gray")


def transported() -> Picture:
    """A vector at one vertex, transported along the shortest paths to evenly spread ones."""
    mesh = shapes.blob(4)
    vectors = heat_igl.VectorHeatSolver(mesh, method="windows").transport(0, [1.0, 0.0])
    sites = heat_igl.farthest_points(mesh, 200)
    short = [heat_igl.trace_geodesic(mesh, int(v), vectors[v], 0.12) for v in sites]
    return plot(mesh, heat_igl.geodesic_distance(mesh, 0), sources=0, style="plain", curves=short)


def bezier() -> Picture:
    """A cubic Bezier curve by geodesics, the polygon of its control points, and distance from the mean of these."""
    ball = shapes.icosphere(5)
    mesh = heat_igl.Mesh(ball.V * [1.5, 1.0, 0.7], ball.F)
    control = [int(np.argmax(ball.V @ place)) for place in ([-2, -1, 2], [-1, 2, 1], [1, -2, 1], [2, 1, 1])]
    curves = [heat_igl.curves.geodesic_bezier(mesh, control), heat_igl.geodesic_path(mesh, control)]
    mean = heat_igl.karcher_mean(mesh, control)
    return plot(mesh, heat_igl.geodesic_distance(mesh, mean), sources=mean, curves=curves, view=(15, 15))


def extended() -> Picture:
    """Values at five vertices, extended to all others by the vector heat method."""
    mesh = shapes.blob(5)
    sites = heat_igl.farthest_points(mesh, 5)
    values = heat_igl.VectorHeatSolver(mesh).extend(sites, [1.0, 4.0, 2.0, 5.0, 3.0])
    return plot_field(mesh, values, label="value", sources=sites, limits=(1, 5))


def travel_time() -> Picture:
    """Travel time where one half of a square is four times as fast."""
    mesh = shapes.grid(80)
    fast = mesh.V[mesh.F].mean(axis=1)[:, 0] > mesh.V[:, 0].mean()
    domain = heat_igl.speed_operators(mesh, np.where(fast, 4.0, 1.0))
    time = heat_igl.GeodesicSolver(domain).distance(41)
    return plot(mesh, time, sources=41, label="time")


def fibres() -> Picture:
    """Distance on a cylinder with helical fibres, across which lengths count three times."""
    mesh = shapes.cylinder(96, 72, 4.0)
    side = mesh.V[mesh.F].mean(axis=1)
    along = np.stack([-side[:, 1], side[:, 0], np.full(mesh.n_faces, 0.5)], axis=1)
    domain = heat_igl.metric_operators(mesh, heat_igl.fibre_metric(along, along=1, across=3))
    source = 36 * 96 + 80
    phi = heat_igl.GeodesicSolver(domain).distance(source)
    turned = heat_igl.Mesh(mesh.V[:, [1, 2, 0]], mesh.F)
    return plot(turned, phi, sources=source, view=(20, 15))


def maze() -> Picture:
    """Distance in the white pixels of an image."""
    mask = np.ones((60, 60), bool)
    for k in range(1, 5):
        mask[12 * k, slice(10, None) if k % 2 else slice(None, 50)] = False
    domain = heat_igl.image_domain(mask)
    source = domain.index[4, 55]
    return plot(domain.mesh, heat_igl.geodesic_distance(domain.mesh, source), sources=source)


def cut_locus() -> Picture:
    """Where fronts from two sides meet: the gradient of the distance is shorter than 1 there."""
    mesh = shapes.blob(5)
    phi = heat_igl.geodesic_distance(mesh, 0)
    residual = heat_igl.validation.metrics.eikonal_residual(mesh, phi)
    largest = np.zeros(mesh.n_vertices)
    np.maximum.at(largest, mesh.F, residual[:, None])
    return plot_field(mesh, largest, label="| |grad d| - 1 |", limits=(0, 0.5), view=(180, 20))


def swept() -> Picture:
    """The error of a sweep on a logarithmic scale."""
    mesh = shapes.blob(5)
    exact = heat_igl.geodesic_distance(mesh, 0, method="exact")
    error = np.abs(heat_igl.geodesic_distance(mesh, 0, method="sweep") - exact) / exact.max()
    return plot_field(mesh, np.log10(np.maximum(error, 1e-9)), label="log10 of error", limits=(-6, -2), sources=0)


ENTRIES = (
    torus, bunny, near, paths, cells, samples, dual, curve, region, offsets, scribble, grown, noisy, tool_path, pieces,
    heat, error, swept, cut_locus, book, tetrahedra, voxels, polygons, cloud, scan, maze,
    travel_time, fibres, directions, checkerboard,
    straightest, transported, extended, bezier, asked,
)  # fmt: skip


def main(argv: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--out", type=Path, default=Path("gallery"), help="directory for the results; made if missing")
    out: Path = parser.parse_args(argv).out
    (out / "pages").mkdir(parents=True, exist_ok=True)
    thumbnails, sections = [], []
    for entry in ENTRIES:
        name, title, result = entry.__name__, str(entry.__doc__), entry()
        if isinstance(result, Picture):
            result.save(out / f"{name}.png")
            shown = f"![{title}]({name}.png)"
            # The sections below bring the pictures into this folder of the site.
            link, picture = name.replace("_", "-"), f'<img src="_images/{name}.png" alt="{title}">'
            thumbnails.append(f'<a href="#{link}">{picture}{_short(title)}</a>')
        else:
            result.save(out / "pages" / f"{name}.html")
            shown = f'<iframe src="{name}.html" style="width: 100%; height: 520px; border: 0"></iframe>'
        sections.append(f"({name})=\n\n## {title}\n\n{shown}\n\n```python\n{_body(entry)}```\n")
    grid = "\n".join(['<div class="thumbnails">', *thumbnails, "</div>", ""])
    (out / "gallery.md").write_text("\n".join([grid, *sections]), encoding="utf8")
    return 0


def _short(title: str) -> str:
    """The beginning of a sentence, up to the first mark."""
    return re.split("[,.:]", title)[0]


def _body(entry: Callable[[], object]) -> str:
    """The lines of a function without signature and docstring, after the imports that they need."""
    lines = inspect.getsource(entry).splitlines(keepends=True)[2:]
    code = "".join(line[4:].removeprefix("return ") for line in lines)
    used = set(re.findall(r"\b[a-z]\w*", code))
    drawing = [name for name in ("page", "plot", "plot_field", "plot_labels") if name in used]
    imports = ["import numpy as np"] * ("np" in used) + ["import heat_igl"]
    imports += ["from heat_igl import shapes"] * ("shapes" in used) + [
        f"from heat_igl.drawing import {', '.join(drawing)}"
    ]
    return "\n".join(imports) + f"\n\n{code}"


if __name__ == "__main__":
    raise SystemExit(main())
