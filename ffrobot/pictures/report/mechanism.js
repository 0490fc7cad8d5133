// The mechanism in motion: r = R + A (x + s Φ p), with the exaggeration s of the slider.

for (const run of MECHANISM.runs) {
  for (const body of run.bodies) {
    for (const key of ["position", "angle", "outline", "modes", "p", "points", "deflection"]) body[key] = decoded(body[key]);
    body.n = body.p.length / run.time.length;
    body.pointCount = body.points.length / 2;
  }
  for (const path of run.paths) if (path.target) path.target = decoded(path.target);
}

const rotated = (angle, x, y) => [
  Math.cos(angle) * x - Math.sin(angle) * y,
  Math.sin(angle) * x + Math.cos(angle) * y,
];

// How much more than in truth the deflection moves a point at output k, in global axes.
function excess(body, point, k, s) {
  const at = 2 * (k * body.pointCount + point);
  return rotated(body.angle[k], (s - 1) * body.deflection[at], (s - 1) * body.deflection[at + 1]);
}

// Each body moves along with the exaggerated point that it hangs from; bodies come in that order.
function shifts(run, k, s) {
  const found = [];
  for (const body of run.bodies) {
    let shift = [0, 0];
    if (body.hangs) {
      const own = excess(body, body.hangs.own, k, s);
      shift = [-own[0], -own[1]];
      if (body.hangs.from) {
        const [parent, point] = body.hangs.from;
        const carried = excess(run.bodies[parent], point, k, s);
        shift = shift.map((value, i) => value + carried[i] + found[parent][i]);
      }
    }
    found.push(shift);
  }
  return found;
}

function placed(body, shift, k, x, y) {
  const [dx, dy] = rotated(body.angle[k], x, y);
  return [body.position[2 * k] + dx + shift[0], body.position[2 * k + 1] + dy + shift[1]];
}

function outline(body, shift, k, s) {
  const x = [], y = [];
  for (let i = 0; i < body.outline.length / 2; i++) {
    const at = [body.outline[2 * i], body.outline[2 * i + 1]];
    for (let c = 0; c < 2; c++)
      for (let l = 0; l < body.n; l++) at[c] += s * body.modes[(2 * i + c) * body.n + l] * body.p[k * body.n + l];
    const [px, py] = placed(body, shift, k, at[0], at[1]);
    x.push(px);
    y.push(py);
  }
  return { x, y };
}

function pointAt(body, shift, point, k, s) {
  const at = 2 * (k * body.pointCount + point);
  const x = body.points[2 * point] + s * body.deflection[at];
  const y = body.points[2 * point + 1] + s * body.deflection[at + 1];
  return placed(body, shift, k, x, y);
}

// Traces of a run at time t: bodies, their points, and the paths taken so far, always in the same order.
function traces(run, t, s) {
  const k = outputAt(run, t), found = shifts(run, k, s);
  const shapes = run.bodies.map((body, i) => outline(body, found[i], k, s));
  const joints = { x: [], y: [] };
  run.bodies.forEach((body, i) => {
    for (let point = 0; point < body.pointCount; point++) {
      if (body.names[point].endsWith(".mid")) continue;
      const [x, y] = pointAt(body, found[i], point, k, s);
      joints.x.push(x);
      joints.y.push(y);
    }
  });
  const paths = run.paths.map((path) => {
    const taken = { x: [], y: [] };
    for (let j = 0; j <= k; j++) {
      const [x, y] = pointAt(run.bodies[path.point[0]], [0, 0], path.point[1], j, 1);
      taken.x.push(x);
      taken.y.push(y);
    }
    return taken;
  });
  return [...shapes, joints, ...paths];
}

function styles(run) {
  const group = { type: "scatter", mode: "lines", legendgroup: run.label, showlegend: false };
  const line = { color: run.color, width: 2 };
  const bodies = run.bodies.map((body, i) => ({
    ...group, name: run.label, showlegend: i === 0, line, hoverinfo: "name", hoverlabel: { namelength: -1 },
    ...(body.filled ? { fill: "toself", fillcolor: run.color + "55" } : {}),
  }));
  const marker = { color: pageColor("--paper"), size: 7, line: { color: run.color, width: 2 } };
  const joints = { ...group, name: "points of " + run.label, mode: "markers", marker, hoverinfo: "x+y" };
  const paths = run.paths.map((path) => ({ ...group, name: `${path.name}, ${run.label}`, line: { ...line, width: 1 } }));
  return [...bodies, joints, ...paths].map((trace) => ({ ...trace, visible: run.visible ? true : "legendonly" }));
}

// What stands still: where the ground is, and the paths wanted.
function scenery() {
  const ground = {
    type: "scatter", mode: "markers", name: "ground", x: MECHANISM.ground.map((p) => p[0]), y: MECHANISM.ground.map((p) => p[1]),
    marker: { symbol: "triangle-up", size: 16, color: "#8b95a3" }, hoverinfo: "name",
  };
  const wanted = {};
  for (const run of MECHANISM.runs)
    for (const path of run.paths)
      if (path.target && !wanted[path.name])
        wanted[path.name] = {
          type: "scatter", mode: "lines", name: "path wanted of " + path.name, line: { color: pageColor("--ink"), width: 1, dash: "dash" },
          x: path.target.filter((_, i) => i % 2 === 0), y: path.target.filter((_, i) => i % 2 === 1),
        };
  return [ground, ...Object.values(wanted)];
}

const still = scenery();
const first = []; // number of the first trace of each run

function start() {
  const all = [...still];
  for (const run of MECHANISM.runs) {
    first.push(all.length);
    traces(run, 0, state.s).forEach((at, i) => all.push({ ...styles(run)[i], ...at }));
  }
  const layout = chartLayout({
    title: { text: "" }, showlegend: true, uirevision: "keep", margin: { l: 70, r: 15, t: 30, b: 50 },
    legend: { orientation: "h", y: -0.13 },
    xaxis: { title: { text: "x (m)" }, range: MECHANISM.range[0] },
    yaxis: { title: { text: "y (m)" }, range: MECHANISM.range[1], scaleanchor: "x" },
  });
  return Plotly.newPlot(stage, all, layout, CONFIG);
}

function show() {
  const data = [], numbers = [];
  MECHANISM.runs.forEach((run, r) => {
    if (stage.data[first[r]].visible !== true) return;
    traces(run, state.t, state.s).forEach((at, i) => {
      data.push(at);
      numbers.push(first[r] + i);
    });
  });
  showValues();
  const at_once = { mode: "immediate", transition: { duration: 0 }, frame: { duration: 0, redo: false } };
  return Plotly.animate(stage, { data, traces: numbers }, at_once);
}

begin(start);
