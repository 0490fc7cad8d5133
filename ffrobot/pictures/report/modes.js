// Mode shapes: x + a Φ_k on the surface of a link, a being what the slider says.

const MODES_3D = JSON.parse(document.getElementById("modes-3d-data").textContent);
const modeStage = document.getElementById("modes-3d");
const modeState = { link: 0, mode: 0, amplitude: 1, playing: false };

for (const link of MODES_3D.links) {
  for (const key of ["points", "triangles", "modes"]) link[key] = typedArray(link[key]);
  link.count = link.points.length / 3;
}

// Coordinates of the deformed surface; the size of the displacement, which the amplitude does not change.
function modeShape() {
  const link = MODES_3D.links[modeState.link], start = 3 * link.count * modeState.mode;
  const moved = [[], [], []], size = [];
  for (let i = 0; i < link.count; i++) {
    let square = 0;
    for (let c = 0; c < 3; c++) {
      const phi = link.modes[start + 3 * i + c];
      square += phi * phi;
      moved[c].push(link.points[3 * i + c] + modeState.amplitude * link.amplitude * phi);
    }
    size.push(Math.sqrt(square) / 32767);
  }
  return { x: moved[0], y: moved[1], z: moved[2], intensity: size };
}

// Axes that hold every mode at every amplitude, one metre being as long on each.
function modeAxes(link) {
  const reach = 1.05 * 32767 * link.amplitude, ranges = [0, 1, 2].map((c) => {
    const values = every(link.points, 3, c);
    return [Math.min(...values) - reach, Math.max(...values) + reach];
  });
  const longest = Math.max(...ranges.map(([a, b]) => b - a));
  // Of slender links the numbers of y and z would meet in their corner.
  const ticks = ([a, b]) => (a < 0 && b > 0 && 3 * (b - a) < longest ? { tickvals: [0] } : { nticks: tickCount([a, b], longest) });
  const axis = (c, name) => ({
    ...axis3D(), range: ranges[c], title: { text: `${name} (m)` }, showbackground: false, ...ticks(ranges[c]),
  });
  // The height of the picture is two units; beside the link there are labels and the color bar, which phones have above it.
  const [width, height] = [modeStage.clientWidth - (NARROW ? 100 : 150), modeStage.clientHeight - (NARROW ? 85 : 0)];
  const length = 2.6 * Math.min(1, width / (1.3 * height));
  const ratio = (c) => (length * (ranges[c][1] - ranges[c][0])) / longest;
  return {
    xaxis: axis(0, "x"), yaxis: axis(1, "y"), zaxis: axis(2, "z"),
    aspectmode: "manual", aspectratio: { x: ratio(0), y: ratio(1), z: ratio(2) },
    camera: {
      projection: { type: "orthographic" },
      up: { x: MODES_3D.up[0], y: MODES_3D.up[1], z: MODES_3D.up[2] },
      eye: { x: MODES_3D.viewer[0], y: MODES_3D.viewer[1], z: MODES_3D.viewer[2] },
    },
  };
}

function drawModes() {
  const link = MODES_3D.links[modeState.link];
  const faces = { i: every(link.triangles, 3, 0), j: every(link.triangles, 3, 1), k: every(link.triangles, 3, 2) };
  const rest = {
    type: "mesh3d", ...faces, color: "#9a9a9a", opacity: 0.15, hoverinfo: "skip",
    x: every(link.points, 3, 0), y: every(link.points, 3, 1), z: every(link.points, 3, 2),
  };
  const shape = {
    type: "mesh3d", ...faces, ...modeShape(), colorscale: "Viridis", cmin: 0, cmax: 1, flatshading: true,
    // Small triangles are no degenerate ones: their normals count.
    lighting: { ambient: 0.6, diffuse: 0.6, specular: 0.1, facenormalsepsilon: 0, vertexnormalsepsilon: 0 },
    hoverinfo: "x+y+z",
    colorbar: { title: { text: "displacement", side: NARROW ? "top" : "right" }, orientation: NARROW ? "h" : "v", thickness: 12, len: 0.7 },
  };
  const layout = { ...paint(), margin: { l: 0, r: 0, t: 10, b: 0 }, scene: modeAxes(link) };
  return Plotly.react(modeStage, [rest, shape], layout, CONFIG);
}

function showMode() {
  control("mode-amplitude").value = modeState.amplitude;
  control("mode-amplitude-value").value = modeState.amplitude.toFixed(2);
  const { x, y, z, intensity } = modeShape();
  return Plotly.restyle(modeStage, { x: [x], y: [y], z: [z], intensity: [intensity] }, [1]);
}

function swing(now) {
  if (!modeState.playing) return;
  modeState.amplitude = Math.sin(now / 400);
  showMode().then(() => requestAnimationFrame(swing));
}

function swingModes(on) {
  modeState.playing = on;
  control("mode-play").textContent = on ? "pause" : "play";
  if (on) requestAnimationFrame(swing);
}

function fill(select, names) {
  select.replaceChildren(...names.map((name, i) => Object.assign(document.createElement("option"), { value: i, textContent: name })));
}

function chooseLink(number) {
  modeState.link = number;
  modeState.mode = 0;
  fill(control("mode-number"), MODES_3D.links[number].names);
}

if (modeStage) {
  fill(control("mode-link"), MODES_3D.links.map((link) => link.label));
  chooseLink(0);
  new IntersectionObserver((entries, watcher) => {
    if (!entries.some((entry) => entry.isIntersecting)) return;
    watcher.disconnect();
    drawModes().then(showMode);
  }, { rootMargin: "500px" }).observe(modeStage);
  control("mode-link").addEventListener("change", (event) => {
    chooseLink(Number(event.target.value));
    drawModes();
  });
  control("mode-number").addEventListener("change", (event) => {
    modeState.mode = Number(event.target.value);
    showMode();
  });
  control("mode-amplitude").addEventListener("input", (event) => {
    swingModes(false);
    modeState.amplitude = Number(event.target.value);
    showMode();
  });
  control("mode-play").addEventListener("click", () => swingModes(!modeState.playing));
}
