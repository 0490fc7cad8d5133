// The mechanism in motion: r = R + A (x + s Φ p) + (s − 1) shift, with the exaggeration s of the slider; `shift` keeps joints
// shut. Planar scenes are seen along z by an orthographic camera, which pans and zooms but does not turn.

for (const run of MECHANISM.runs) {
  for (const body of run.bodies) {
    for (const key of ["position", "quaternion", "shift", "points", "shapes", "p", "triangles"]) body[key] = typedArray(body[key]);
    body.count = body.points.length / 3;
    body.n = body.p.length / run.time.length;
  }
  for (const marker of [...run.joints, ...run.tools])
    for (const key of ["position", "exaggeration", "directions"]) marker[key] = typedArray(marker[key]);
  for (const path of run.paths) if (path.target) path.target = typedArray(path.target);
}

// Rows of A of the unit quaternion at output k: docs/theory.md, 3D.
function rotation(e, k) {
  const [w, x, y, z] = e.subarray(4 * k, 4 * k + 4);
  return [
    [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
    [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
    [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
  ];
}

// Coordinates of the surface of a body at output k.
function surface(body, k, s) {
  const A = rotation(body.quaternion, k), found = [0, 1, 2].map(() => new Float32Array(body.count)), at = [0, 0, 0];
  const origin = [0, 1, 2].map((c) => body.position[3 * k + c] + (s - 1) * body.shift[3 * k + c]);
  for (let i = 0; i < body.count; i++) {
    for (let c = 0; c < 3; c++) {
      let moved = 0;
      for (let l = 0, row = (3 * i + c) * body.n; l < body.n; l++) moved += body.shapes[row + l] * body.p[k * body.n + l];
      at[c] = body.points[3 * i + c] + s * moved;
    }
    for (let c = 0; c < 3; c++) found[c][i] = origin[c] + A[c][0] * at[0] + A[c][1] * at[1] + A[c][2] * at[2];
  }
  return { x: found[0], y: found[1], z: found[2] };
}

// Before the bodies of a planar scene, which would hide it.
const lifted = ([x, y, z]) => [x, y, z + MECHANISM.above];
const markerAt = (marker, k, s) =>
  lifted([0, 1, 2].map((c) => marker.position[3 * k + c] + (s - 1) * marker.exaggeration[3 * k + c]));

function coordinates(points) {
  return { x: points.map((p) => p && p[0]), y: points.map((p) => p && p[1]), z: points.map((p) => p && p[2]) };
}

// Lines along the j-th directions of markers, from `from` to `to` times their length; null parts them.
function arms(markers, j, k, s, from, to) {
  const points = [];
  for (const marker of markers)
    for (const number of j === null ? Array(marker.count).keys() : j < marker.count ? [j] : []) {
      const at = markerAt(marker, k, s), first = 3 * (k * marker.count + number);
      const along = (way) => at.map((value, c) => value + way * marker.directions[first + c]);
      points.push(along(from), along(to), null);
    }
  return coordinates(points);
}

// Traces of a run at time t: bodies, axes of joints, joints, axes of tools, paths taken so far; always in the same order.
function traces(run, t, s) {
  const k = outputAt(run, t);
  return [
    ...run.bodies.map((body) => surface(body, k, s)),
    arms(run.joints, null, k, s, -MECHANISM.axis_length, MECHANISM.axis_length),
    coordinates(run.joints.map((joint) => markerAt(joint, k, s))),
    ...[0, 1, 2].map((j) => arms(run.tools, j, k, s, 0, MECHANISM.tool_length)),
    ...run.tools.map((tool) => coordinates(Array.from({ length: k + 1 }, (_, output) => markerAt(tool, output, 1)))),
  ];
}

function styles(run) {
  const group = { legendgroup: run.label, showlegend: false }, line = { type: "scatter3d", mode: "lines", ...group };
  const light = MECHANISM.is_plane ? { ambient: 1, diffuse: 0, specular: 0 } : { ambient: 0.8, diffuse: 0.6, specular: 0.2 };
  const lighting = { ...light, facenormalsepsilon: 0, vertexnormalsepsilon: 0 };
  const bodies = run.bodies.map((body, i) => ({
    type: "mesh3d", ...group, name: run.label, showlegend: i === 0, color: run.color, flatshading: false, lighting,
    i: every(body.triangles, 3, 0), j: every(body.triangles, 3, 1), k: every(body.triangles, 3, 2),
    hovertemplate: `${body.name}<extra></extra>`,
  }));
  const names = run.joints.map((joint) => joint.name);
  return [
    ...bodies,
    { ...line, name: "axes of joints", line: { color: pageColor("--axis"), width: 4 }, hoverinfo: "skip" },
    { ...line, mode: "markers", text: names, marker: { color: pageColor("--ink"), size: 3 }, hovertemplate: "%{text}<extra></extra>" },
    ...["x", "y", "z"].map((axis, j) => ({ ...line, line: { color: MECHANISM.tool_colors[j], width: 6 }, name: axis, hoverinfo: "name" })),
    ...run.tools.map((tool) => ({ ...line, name: tool.name, line: { color: run.color, width: 3 }, hoverinfo: "name" })),
  ].map((trace) => ({ ...trace, visible: run.visible ? true : "legendonly" }));
}

// What stands still: where the ground is, and the paths wanted.
function scenery() {
  const ground = {
    type: "scatter3d", mode: "markers", name: "ground", ...coordinates(MECHANISM.ground),
    marker: { symbol: "square", size: 5, color: "#8b95a3" }, hoverinfo: "name",
  };
  const wanted = {};
  for (const run of MECHANISM.runs)
    for (const path of run.paths)
      if (path.target && !wanted[path.name])
        wanted[path.name] = {
          type: "scatter3d", mode: "lines", name: "prescribed path of " + path.name, hoverinfo: "name",
          line: { color: pageColor("--ink"), width: 3, dash: "dash" },
          x: every(path.target, 3, 0), y: every(path.target, 3, 1), z: every(path.target, 3, 2).map((z) => z + MECHANISM.above),
        };
  return [...(MECHANISM.ground.length ? [ground] : []), ...Object.values(wanted)];
}

const { right, up, viewer } = MECHANISM.view, FLAT = MECHANISM.is_plane;
const DISTANCE = 2.1, SEEN = FLAT ? 2 : 1.74; // of the camera from the middle, of the height there, in Plotly's unit
const LABELS = FLAT ? { across: 150, up: 50, down: 50 } : { across: 100, up: 10, down: 50 }; // pixels that labels of the axes take
const MIDDLE = FLAT ? 0.5 : 0.43; // of the box, from the top, of the height
const PAPER = [690, 400]; // pixels
const first = []; // number of the first trace of each run

// How long a metre is, in Plotly's unit: the box of the axes fills the picture, its near corners as the viewer sees them.
function metre([width, height]) {
  const across = (SEEN * (width - LABELS.across)) / (2 * height);
  const upwards = SEEN * (MIDDLE - LABELS.up / height), downwards = SEEN * (1 - MIDDLE - LABELS.down / height);
  const corners = Array.from({ length: 8 }, (_, k) => MECHANISM.range.map(([a, b], c) => ((k >> c) % 2 - 0.5) * (b - a)));
  const along = (corner, axis) => corner.reduce((sum, value, c) => sum + value * axis[c], 0);
  const sizes = corners.map((corner) => {
    const nearness = FLAT ? 0 : along(corner, viewer) / DISTANCE, height = along(corner, up);
    return nearness + Math.max(Math.abs(along(corner, right)) / across, height / upwards, -height / downwards);
  });
  return 1 / Math.max(...sizes);
}

// Axes of the scene in the colours of the page; one metre is as long on each.
function sceneAxes(size = [stage.clientWidth, stage.clientHeight]) {
  const longest = Math.max(...MECHANISM.range.map(([a, b]) => b - a)), found = { aspectmode: "manual", aspectratio: {} };
  const unit = metre(size);
  ["x", "y", "z"].forEach((name, c) => {
    const [a, b] = MECHANISM.range[c];
    found[`${name}axis`] = {
      ...axis3D(), range: [a, b], title: { text: `${name} (m)` }, visible: c < 2 || !FLAT, tickangle: FLAT ? 0 : "auto",
      showbackground: false, showspikes: false,
      nticks: tickCount([a, b], longest),
    };
    found.aspectratio[name] = unit * (b - a);
  });
  return found;
}

function start() {
  const all = scenery();
  first.length = 0;
  for (const run of MECHANISM.runs) {
    first.push(all.length);
    traces(run, 0, state.s).forEach((at, i) => all.push({ ...styles(run)[i], ...at }));
  }
  const rows = Math.ceil((MECHANISM.runs.length - 4) / 3); // of the legend, beyond what the height is for
  if (NARROW && rows > 0) stage.style.height = `calc(22rem + ${20 * rows}px)`;
  const xyz = ([x, y, z]) => ({ x, y, z });
  const camera = {
    eye: xyz(viewer.map((value) => DISTANCE * value)), up: xyz(FLAT ? up : [0, 0, 1]), center: xyz(FLAT ? [0, -0.1, 0] : [0, 0, -0.14]),
    projection: { type: FLAT ? "orthographic" : "perspective" },
  };
  if (FLAT) camera.eye.y += camera.center.y; // straight along z
  const layout = {
    ...paint(), margin: { l: 0, r: 0, t: 0, b: 0 }, showlegend: true, uirevision: "keep",
    legend: { orientation: "h", y: 0, font: { size: 11 } },
    scene: { ...sceneAxes(), camera, dragmode: FLAT ? "pan" : "turntable", uirevision: "keep" },
  };
  return Plotly.react(stage, all, layout, CONFIG);
}

// Plotly goes back to the camera of its layout at every change of the data, and writes there what the user does only when
// a drag ends: the layout is told before.
function keepCamera() {
  const scene = stage._fullLayout.scene._scene;
  if (!scene) return;
  stage.layout.scene.camera = scene.getCamera();
  if (FLAT) stage.layout.scene.aspectratio = scene.glplot.getAspectratio(); // by which that camera zooms
}

// Where pictures are slow to come, as without a graphics card, the robot stands still while the user drags: the browser
// would be too busy to turn it.
const SLOW = 100; // ms between pictures
let held = false, last = 0;
stage.addEventListener("pointerdown", () => (held = true), true);
for (const end of ["pointerup", "pointercancel"]) window.addEventListener(end, () => (held = false), true);

async function released() {
  const slow = performance.now() - last > SLOW;
  last = performance.now();
  do await new Promise((resolve) => setTimeout(resolve, slow ? 30 : 0));
  while (slow && held);
}

function show() {
  const found = { x: [], y: [], z: [] }, numbers = [];
  MECHANISM.runs.forEach((run, r) => {
    if (stage.data[first[r]].visible !== true) return;
    traces(run, state.t, state.s).forEach((at, i) => {
      for (const c of ["x", "y", "z"]) found[c].push(at[c]);
      numbers.push(first[r] + i);
    });
  });
  showValues();
  if (!numbers.length) return Promise.resolve();
  state.showing = true;
  keepCamera();
  return Plotly.restyle(stage, found, numbers).then(released).finally(() => (state.showing = false));
}

const fit = (size) => Plotly.relayout(stage, { "scene.aspectratio": sceneAxes(size).aspectratio });
window.addEventListener("beforeprint", () => fit(PAPER));
window.addEventListener("afterprint", () => fit());

SCREEN.addEventListener("change", () => start().then(show));

begin(start);
