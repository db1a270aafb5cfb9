// The logarithmic map of sources: directions in which shortest paths depart, passed on from vertex to vertex. As in Melvaer and
// Reimers, "Geodesic polar coordinates on polygonal meshes" (2012), the direction of a vertex across an edge lies between those
// of both ends, as the angles at the unfolded source do.
"use strict";

// Ends of an edge whose directions differ by more than this lie on both sides of a cut: there is nothing between them.
const OPPOSITE = 0.5 * Math.PI;

// Angle from the direction (ax, ay) to (bx, by), between -pi and pi.
const turnFrom = (ax, ay, bx, by) => Math.atan2(ax * by - ay * bx, ax * bx + ay * by);
const wrapped = (angle) => angle - 2 * Math.PI * Math.round(angle / (2 * Math.PI));

// Directions of the edges around s, scaled to a full turn, or to half of one on the boundary: a Map from neighbour to angle.
function fanAngles(tables, s) {
  const { first, ends, shape } = tables, rows = new Map(), isSecond = new Set();
  for (let k = first[s]; k < first[s + 1]; k++) { rows.set(ends[3 * k], k); isSecond.add(ends[3 * k + 1]); }
  const starts = [...rows.keys()], begin = starts.find((a) => !isSecond.has(a));
  const angles = new Map(), isClosed = begin === undefined;
  let total = 0;
  for (let a = isClosed ? starts[0] : begin; a !== undefined && !angles.has(a);) {
    angles.set(a, total);
    const k = rows.get(a);
    if (k === undefined) break;
    const [px, py] = [shape[7 * k], shape[7 * k + 1]];
    total += Math.abs(turnFrom(-px, -py, 1 - px, -py));
    a = ends[3 * k + 1];
  }
  const scale = (isClosed ? 2 : 1) * Math.PI / total;
  for (const [a, angle] of angles) angles.set(a, angle * scale);
  return angles;
}

// Vectors (u, v) one after the other, as long as the distance d from the nearest source, in the direction of the departure; NaN
// at vertices without a direction.
function logMap(tables, d, sources) {
  const { n, first, ends, shape } = tables;
  const angle = new Float64Array(n).fill(NaN), label = new Int32Array(n).fill(-1), isNeighbour = new Uint8Array(n);
  for (const s of sources) label[s] = s;
  for (const s of sources) {
    for (const [a, direction] of fanAngles(tables, s)) {
      if (sources.includes(a)) continue;
      let length = Infinity;
      for (let k = first[a]; k < first[a + 1]; k++) {
        for (const end of [0, 1]) if (ends[3 * k + end] === s) length = Math.min(length, shape[7 * k + 3 + end]);
      }
      if (length <= d[a] * (1 + 1e-6)) [angle[a], label[a], isNeighbour[a]] = [direction, s, 1];
    }
  }
  const order = Array.from(d.keys()).filter((v) => isFinite(d[v])).sort((v, w) => d[v] - d[w]);
  for (const v of order) {
    if (label[v] === v || isNeighbour[v]) continue;
    let best = Infinity;
    for (let k = first[v]; k < first[v + 1]; k++) {
      const [a, b] = [ends[3 * k], ends[3 * k + 1]], at = 7 * k, base = shape[at + 2];
      for (const [end, length] of [[a, d[a] + shape[at + 3]], [b, d[b] + shape[at + 4]]]) {
        // A path along an edge departs as that of the other end.
        if (d[end] < d[v] && length < best && !isNaN(angle[end])) [best, angle[v], label[v]] = [length, angle[end], label[end]];
      }
      const between = wrapped(angle[b] - angle[a]);
      if (label[a] !== label[b] || label[a] < 0 || !(Math.abs(between) < OPPOSITE) || Math.min(d[a], d[b]) >= d[v]) continue;
      const [px, py] = [shape[at], shape[at + 1]];
      const x = 0.5 * ((d[a] - d[b]) * (d[a] + d[b]) / (base * base) + 1);
      const y = Math.sqrt(Math.max(d[a] * d[a] / (base * base) - x * x, 0));
      const crossing = x * py + px * y, length = base * Math.hypot(px - x, py + y);
      if (!(crossing >= 0 && crossing <= y + py) || length >= best) continue;
      const whole = turnFrom(-x, y, 1 - x, y), part = turnFrom(-x, y, px - x, py + y);
      best = length;
      label[v] = label[a];
      angle[v] = angle[a] + between * (whole === 0 ? 0.5 : Math.min(Math.max(part / whole, 0), 1));
    }
  }
  const map = new Float64Array(2 * n);
  for (let v = 0; v < n; v++) {
    const length = d[v] === 0 ? 0 : d[v], direction = length === 0 ? 0 : angle[v];
    map[2 * v] = length * Math.cos(direction);
    map[2 * v + 1] = length * Math.sin(direction);
  }
  return map;
}
