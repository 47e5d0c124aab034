// Plays a motion: packed poses go to a stage (plane.js or space.js), packed curves to plots; one clock moves both.
"use strict";

function unpack(packed, rows) {
  // Numbers as int16 between the low and high end of each column, row after row: a Float32Array and its column count.
  if (packed.values) return packed; // a live page writes them itself
  const text = atob(packed.data), raw = new Int16Array(text.length / 2), columns = packed.low.length;
  for (let k = 0; k < raw.length; k++) raw[k] = text.charCodeAt(2 * k) | (text.charCodeAt(2 * k + 1) << 8);
  const found = new Float32Array(rows * columns);
  for (let k = 0; k < found.length; k++) {
    const c = k % columns, span = packed.high[c] - packed.low[c];
    found[k] = raw[k] === -32768 ? NaN : packed.low[c] + span * (raw[k] + 32767) / 65534;
  }
  return { values: found, columns };
}

function typeset(runs) { // letters as a book sets them: italic, upright, below the line
  return runs.map(([text, style]) => {
    const part = document.createElement(style === "subscript" ? "sub" : style === "italic" ? "em" : "span");
    part.textContent = text;
    return part;
  });
}

function onGestures(element, drag, zoom) {
  // One pointer drags; two pointers, or the wheel with Ctrl (a pinch on a touchpad), zoom about a place of the element.
  const held = new Map();
  const apart = () => { const [a, b] = [...held.values()]; return Math.hypot(a[0] - b[0], a[1] - b[1]); };
  const zoomAt = (x, y, factor) => { const box = element.getBoundingClientRect(); zoom(factor, x - box.left, y - box.top); };
  element.addEventListener("pointerdown", (event) => {
    held.set(event.pointerId, [event.clientX, event.clientY]);
    element.setPointerCapture(event.pointerId);
  });
  element.addEventListener("pointermove", (event) => {
    const from = held.get(event.pointerId), to = [event.clientX, event.clientY];
    if (!from || held.size > 2) return;
    const before = held.size === 2 ? apart() : 0;
    held.set(event.pointerId, to);
    if (held.size === 1) { drag(to[0] - from[0], to[1] - from[1]); return; }
    const [a, b] = [...held.values()];
    zoomAt((a[0] + b[0]) / 2, (a[1] + b[1]) / 2, apart() / (before || 1));
  });
  for (const ending of ["pointerup", "pointercancel"]) element.addEventListener(ending, (event) => held.delete(event.pointerId));
  element.addEventListener("wheel", (event) => {
    if (!event.ctrlKey && !document.fullscreenElement) return; // the page scrolls
    event.preventDefault();
    zoomAt(event.clientX, event.clientY, Math.exp(-event.deltaY * 0.002));
  }, { passive: false });
}

async function paintSvg(pen, svg, wide, high) {
  // Paint an SVG on a canvas; away from the page it has the colours that it falls back to, those of paper.
  const copy = svg.cloneNode(true), image = new Image();
  copy.setAttribute("width", wide);
  copy.setAttribute("height", high);
  image.src = "data:image/svg+xml;charset=utf-8," + encodeURIComponent(new XMLSerializer().serializeToString(copy));
  await image.decode();
  pen.drawImage(image, 0, 0, wide, high);
}

function animate(root, makeStage) {
  const data = JSON.parse(root.querySelector(".animation-data").textContent);
  const times = data.times, last = times.length - 1, start = times[0], end = times[last], length = end - start;
  const TRAIL = 0.1 * length; // how long (s) what a trail shows is
  const digits = Math.max(0, Math.min(6, Math.ceil(2.5 - Math.log10(length || 1)))); // a 200th of the run at least
  const frame = root.querySelector(".stage"), slider = root.querySelector("input[type=range]");
  const output = root.querySelector("output"), paths = root.querySelector("[data-for=paths]");
  const speed = root.querySelector("[data-for=speed]");
  const button = (name) => root.querySelector(`[data-do=${name}]`);
  const isOn = (name) => button(name).getAttribute("aria-pressed") === "true";
  const stage = makeStage(frame, data);
  const plots = makePlots(root.querySelector(".plots"), data, seek);
  const kept = traceKey();
  let clock = start, playing = false, before = 0;

  function traceKey() {
    // A check box for each point whose path can be shown, in the colour of the path.
    return data.traces.map(({ runs, colour }) => {
      const label = document.createElement("label"), box = document.createElement("input"), line = document.createElement("i");
      box.type = "checkbox";
      box.checked = true;
      box.addEventListener("change", draw);
      line.style.borderTopColor = colour;
      label.append(box, line, ...typeset(runs));
      root.querySelector(".key").append(label);
      return box;
    });
  }
  function place(t) {
    // The frame before t and how far t lies on the way to the next.
    let low = 0, high = last;
    while (high - low > 1) { const m = (low + high) >> 1; if (times[m] <= t) low = m; else high = m; }
    const span = times[high] - times[low];
    return [low, high, span > 0 ? Math.min(1, Math.max(0, (t - times[low]) / span)) : 0];
  }
  function draw() {
    const [low, high, part] = place(clock), shown = paths.value !== "off", fades = paths.value === "trail";
    const trails = { first: fades ? place(clock - TRAIL)[0] : 0, fades, shown: kept.map((box) => shown && box.checked) };
    root.querySelector(".key").hidden = !shown;
    stage.show(low, high, part, trails);
    plots.show(clock);
    output.textContent = "t = " + clock.toFixed(digits) + " s";
    slider.value = String((clock - start) / (length || 1));
    slider.setAttribute("aria-valuetext", clock.toFixed(digits) + " s");
  }
  function seek(t) {
    clock = Math.min(end, Math.max(start, t));
    draw();
  }
  function step(now) {
    if (!playing) return;
    clock += (now - before) / 1000 * Number(speed.value);
    before = now;
    if (clock >= end && isOn("loop") && length > 0) clock = start;
    if (clock >= end) { clock = end; play(false); }
    draw();
    root.dataset.frames = String(Number(root.dataset.frames || 0) + 1);
    if (playing) requestAnimationFrame(step);
  }
  function play(on) {
    playing = on;
    button("play").textContent = on ? "Pause" : "Play";
    if (!on) return;
    if (clock >= end) clock = start;
    before = performance.now();
    requestAnimationFrame(step);
  }
  function turn(name, on = !isOn(name)) {
    button(name).setAttribute("aria-pressed", String(on));
    if (stage.switches[name]) stage.switches[name](on);
    draw();
  }
  function toFrame(number) {
    play(false);
    seek(times[Math.min(last, Math.max(0, number))]);
  }
  function back() {
    const [low, , part] = place(clock);
    toFrame(part > 0 ? (clock >= end ? last - 1 : low) : low - 1);
  }
  async function save() {
    const wide = frame.clientWidth, high = frame.clientHeight, picture = document.createElement("canvas");
    picture.width = 2 * wide;
    picture.height = 2 * high;
    const pen = picture.getContext("2d"), names = frame.querySelector(".names");
    pen.scale(2, 2);
    pen.fillStyle = "#fff";
    pen.fillRect(0, 0, wide, high);
    await stage.paint(pen, wide, high);
    if (names && isOn("names")) await paintSvg(pen, names, wide, high);
    const link = document.createElement("a");
    link.download = `${root.dataset.name} at ${clock.toFixed(digits)} s.png`;
    link.href = picture.toDataURL("image/png");
    link.click();
  }
  const commands = {
    play: () => play(!playing),
    back,
    next: () => toFrame(place(clock)[0] + 1),
    loop: () => turn("loop"),
    names: () => turn("names"),
    follow: () => turn("follow"),
    reset: () => { stage.reset(); draw(); },
    save,
    fill: () => (document.fullscreenElement ? document.exitFullscreen() : root.requestFullscreen()),
  };
  const keys = {
    " ": commands.play, ",": commands.back, ".": commands.next, l: commands.loop, n: commands.names, v: commands.follow,
    r: commands.reset, s: commands.save, f: commands.fill,
    ArrowLeft: () => seek(clock - length / 50), ArrowRight: () => seek(clock + length / 50),
    Home: () => seek(start), End: () => seek(end),
  };
  function press(event) {
    // In a report the keys act on the animation that has the focus; a page of its own has no other use for them.
    const command = keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    const taken = event.target.matches("select, input[type=checkbox]") || (event.key === " " && event.target.matches("button"));
    if (!command || taken || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    command();
  }
  for (const each of root.querySelectorAll("[data-do]")) each.addEventListener("click", commands[each.dataset.do]);
  for (const name of Object.keys(stage.switches)) button(name).hidden = false;
  button("fill").hidden = !document.fullscreenEnabled;
  slider.addEventListener("input", () => seek(start + Number(slider.value) * length));
  paths.addEventListener("change", draw);
  (document.querySelector("main.alone") ? document : root).addEventListener("keydown", press);
  const again = () => { plots.resize(); stage.recolour(); draw(); };
  window.addEventListener("resize", again);
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", again);
  draw();
}
