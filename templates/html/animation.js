// Plays a motion: packed poses go to a stage (plane.js or space.js), packed curves to plots; one clock moves both.
"use strict";

function unpack(packed, rows) {
  // Numbers as int16 between the low and high end of each column, row after row: a Float32Array and its column count.
  const text = atob(packed.data), raw = new Int16Array(text.length / 2), columns = packed.low.length;
  for (let k = 0; k < raw.length; k++) raw[k] = text.charCodeAt(2 * k) | (text.charCodeAt(2 * k + 1) << 8);
  const found = new Float32Array(rows * columns);
  for (let k = 0; k < found.length; k++) {
    const c = k % columns, span = packed.high[c] - packed.low[c];
    found[k] = raw[k] === -32768 ? NaN : packed.low[c] + span * (raw[k] + 32767) / 65534;
  }
  return { values: found, columns };
}

function animate(root, packed, makeStage) {
  const data = JSON.parse(packed.textContent), times = data.times, last = times.length - 1, end = times[last];
  const stage = makeStage(root.querySelector(".stage"), data);
  const plots = makePlots(root.querySelector(".plots"), data, (t) => { clock = t; draw(); });
  const button = root.querySelector("button"), slider = root.querySelector("input[type=range]");
  const told = root.querySelector("output"), speed = root.querySelector("select");
  const traces = root.querySelector("input[type=checkbox]");
  let clock = times[0], playing = false, before = 0;

  function place(t) {
    // The frame before t and how far t lies on the way to the next.
    let low = 0, high = last;
    while (high - low > 1) { const m = (low + high) >> 1; if (times[m] <= t) low = m; else high = m; }
    const span = times[high] - times[low];
    return [low, high, span > 0 ? Math.min(1, Math.max(0, (t - times[low]) / span)) : 0];
  }
  function draw() {
    const [low, high, part] = place(clock);
    stage.show(low, high, part, traces.checked);
    plots.show(clock);
    told.textContent = "t = " + clock.toFixed(end < 10 ? 3 : 2) + " s";
    if (document.activeElement !== slider || playing) slider.value = String((clock - times[0]) / (end - times[0] || 1));
  }
  function step(now) {
    if (!playing) return;
    clock += (now - before) / 1000 * Number(speed.value);
    before = now;
    if (clock >= end) { clock = end; toggle(false); }
    draw();
    root.dataset.frames = String(Number(root.dataset.frames || 0) + 1);
    if (playing) requestAnimationFrame(step);
  }
  function toggle(on) {
    playing = on;
    button.textContent = on ? "Pause" : "Play";
    if (!on) return;
    if (clock >= end) clock = times[0];
    before = performance.now();
    requestAnimationFrame(step);
  }
  button.addEventListener("click", () => toggle(!playing));
  slider.addEventListener("input", () => { clock = times[0] + Number(slider.value) * (end - times[0]); draw(); });
  traces.addEventListener("change", draw);
  stage.changed = draw;
  window.addEventListener("resize", () => { plots.resize(); draw(); });
  document.addEventListener("keydown", (event) => {
    if (event.key === " " && event.target === document.body) { event.preventDefault(); toggle(!playing); }
  });
  draw();
}
