// The clock and the sliders below the moving mechanism, which its own script draws (`start`) and moves (`show`).

const MECHANISM = JSON.parse(document.getElementById("mechanism-data").textContent);
const stage = document.getElementById("mechanism");
const control = (id) => document.getElementById(id);

for (const run of MECHANISM.runs) run.time = typedArray(run.time);

// The last output of a run not after time t.
function outputAt(run, t) {
  let low = 0, high = run.time.length - 1;
  while (low < high) {
    const middle = Math.ceil((low + high) / 2);
    if (run.time[middle] <= t + 1e-7 * run.time[run.time.length - 1]) low = middle;
    else high = middle - 1;
  }
  return low;
}

const end = Math.max(...MECHANISM.runs.map((run) => run.time[run.time.length - 1]));
const state = { t: 0, playing: false, showing: false, last: null, s: MECHANISM.exaggeration, speed: MECHANISM.speed };

function showValues() {
  control("time").value = end > 0 ? (1000 * state.t) / end : 0;
  control("time-value").value = state.t.toPrecision(4) + " s";
  control("exaggeration-value").value = Number(state.s.toPrecision(3));
  control("speed-value").value = state.speed.toPrecision(2);
}

function step(now) {
  if (!state.playing) return;
  state.t += state.last === null ? 0 : ((now - state.last) / 1000) * state.speed;
  if (state.t > end) state.t = 0;
  state.last = now;
  show().then(() => requestAnimationFrame(step));
}

function play(on) {
  state.playing = on;
  state.last = null;
  control("play").textContent = on ? "pause" : "play";
  if (on) requestAnimationFrame(step);
}

control("play").addEventListener("click", () => play(!state.playing));
control("time").addEventListener("input", (event) => {
  play(false);
  state.t = (event.target.value / 1000) * end;
  show();
});
control("exaggeration").value = Math.log10(state.s);
control("exaggeration").addEventListener("input", (event) => {
  state.s = 10 ** event.target.value;
  if (!state.playing) show();
});
control("speed").value = Math.log10(state.speed);
control("speed").addEventListener("input", (event) => {
  state.speed = 10 ** event.target.value;
  if (!state.playing) show();
});

// Draw by `start` what `show` then moves.
function begin(start) {
  start().then(() => {
    stage.on("plotly_restyle", () => state.playing || state.showing || show()); // a run that is shown again has to catch up
    show();
    if (!matchMedia("(prefers-reduced-motion: reduce)").matches && end > 0) play(true);
  });
}
