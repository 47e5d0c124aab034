// Panels of curves on canvases: dragging zooms into a span of time, a double click shows all again, a click goes there.
// All lines and letters but the curves have the colour of the canvas, as a style sheet gives it.
"use strict";

function makePlots(root, data, go) {
  const plot = data.plot, rows = plot ? plot.x.length : 0, x = plot ? plot.x : [];
  const all = rows ? [x[0], x[rows - 1]] : [0, 1];
  let span = all.slice(), now = all[0], painted = "";
  const panels = (plot ? plot.panels : []).map(makePanel);

  function makePanel(panel, number) {
    const figure = document.createElement("figure"), caption = document.createElement("figcaption");
    const canvas = document.createElement("canvas"), still = document.createElement("canvas");
    const across = number === plot.panels.length - 1 ? ` over ${plot.across}` : "";
    const values = panel.curves.map((curve) => {
      const entry = document.createElement("span"), line = document.createElement("i"), value = document.createElement("b");
      line.style.borderTopColor = curve.colour;
      line.style.borderTopStyle = curve.dash.length ? "dashed" : "solid";
      entry.append(line, ...typeset(curve.runs), value);
      caption.append(entry);
      return value;
    });
    caption.append((panel.unit ? `[${panel.unit}]` : "") + across);
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", `${panel.label} over ${plot.across}`);
    canvas.title = "drag to zoom, double click to see all, click to go there";
    figure.append(caption, canvas);
    root.append(figure);
    listen(canvas);
    return { canvas, still, panel, readings: values, ...unpack(panel.packed, rows) };
  }
  function listen(canvas) {
    let from = null;
    const at = (event) => {
      const box = canvas.getBoundingClientRect(), [left, right] = edges(box.width);
      return span[0] + (event.clientX - box.left - left) / (right - left) * (span[1] - span[0]);
    };
    canvas.addEventListener("pointerdown", (event) => { from = at(event); canvas.setPointerCapture(event.pointerId); });
    canvas.addEventListener("pointercancel", () => { from = null; });
    canvas.addEventListener("pointerup", (event) => {
      if (from === null) return;
      const to = at(event), [low, high] = [Math.min(from, to), Math.max(from, to)];
      from = null;
      if (high - low < 0.01 * (span[1] - span[0])) { go(to / plot.second); return; }
      span = [Math.max(low, all[0]), Math.min(high, all[1])];
      show(now);
    });
    canvas.addEventListener("dblclick", () => { span = all.slice(); show(now); });
  }
  const edges = (width) => [Math.min(62, 0.16 * width), width - 12];

  function ticks(low, high, most) {
    // Round numbers between the ends: as many as there is room for, three at least.
    for (const few of [most, 2 * most]) {
      const rough = (high - low) / few, size = Math.pow(10, Math.floor(Math.log10(rough)));
      const step = [1, 2, 5, 10].map((f) => f * size).find((s) => s >= 0.999 * rough), found = [];
      for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push(k * step);
      if (found.length > 2 || few > most) return found;
    }
  }
  function written(number, step) {
    const size = Math.abs(number), sign = (text) => text.replace("-", "−");
    if (size < 0.5 * step) return "0";
    if (size >= 1e5 || size < 1e-3) return sign(number.toExponential(1));
    return sign(number.toFixed(Math.max(0, Math.min(6, -Math.floor(Math.log10(step) + 1e-9)))));
  }
  function drawCurve(pen, curve, column, { values, columns }, to) {
    pen.beginPath();
    let down = false;
    for (let k = 0; k < rows; k++) {
      const y = values[k * columns + column];
      if ((k + 1 < rows && x[k + 1] < span[0]) || (k > 0 && x[k - 1] > span[1]) || Number.isNaN(y)) { down = false; continue; }
      if (down) pen.lineTo(...to(x[k], y)); else pen.moveTo(...to(x[k], y));
      down = true;
    }
    pen.strokeStyle = curve.colour === "currentColor" ? getComputedStyle(pen.canvas).color : curve.colour;
    pen.setLineDash(curve.dash);
    pen.lineWidth = 1.5;
    pen.stroke();
  }
  function frameOf({ canvas, panel }) { // where the axes are, and a function from numbers to pixels
    const width = canvas.clientWidth, [left, right] = edges(width), [low, high] = panel.range;
    const top = 6, bottom = canvas.clientHeight - 20;
    const to = (t, y) => [
      left + (t - span[0]) / (span[1] - span[0] || 1) * (right - left), bottom - (y - low) / (high - low || 1) * (bottom - top),
    ];
    return { width, left, right, top, bottom, to };
  }
  function line(pen, ...points) {
    pen.beginPath();
    points.forEach((point, k) => (k ? pen.lineTo(...point) : pen.moveTo(...point)));
    pen.stroke();
  }
  function paint(one) {
    const { canvas, still, panel } = one, ratio = window.devicePixelRatio || 1;
    const { width, left, right, top, bottom, to } = frameOf(one), [low, high] = panel.range;
    canvas.width = still.width = Math.round(width * ratio);
    canvas.height = still.height = Math.round(canvas.clientHeight * ratio);
    const pen = canvas.getContext("2d");
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.font = `12px ${getComputedStyle(canvas).fontFamily}`;
    pen.fillStyle = pen.strokeStyle = getComputedStyle(canvas).color;
    const across = ticks(span[0], span[1], Math.max(2, width / 110)), up = ticks(low, high, 4);
    pen.textAlign = "center";
    for (const t of across) {
      const [px] = to(t, low), text = written(t, across[1] - across[0]), half = pen.measureText(text).width / 2;
      pen.fillText(text, Math.min(px, width - half - 1), bottom + 15); // the last one is not cut off at the edge
    }
    pen.textAlign = "right";
    for (const y of up) pen.fillText(written(y, up[1] - up[0]), left - 6, to(span[0], y)[1] + 4);
    pen.save();
    pen.globalAlpha = 0.18;
    for (const t of across) line(pen, [to(t, low)[0], top], [to(t, low)[0], bottom]);
    for (const y of up) line(pen, [left, to(span[0], y)[1]], [right, to(span[0], y)[1]]);
    pen.beginPath();
    pen.rect(left, top, right - left, bottom - top);
    pen.clip();
    pen.globalAlpha = 0.45;
    pen.setLineDash([2, 3]);
    for (const mark of plot.marks) line(pen, [to(mark, low)[0], top], [to(mark, low)[0], bottom]);
    pen.globalAlpha = 1;
    panel.curves.forEach((curve, c) => drawCurve(pen, curve, c, one, to));
    pen.restore();
    still.getContext("2d").drawImage(canvas, 0, 0);
  }
  function read({ panel, readings, values, columns }, at) { // the numbers of now beside the names
    let k = x.findIndex((t) => t >= at);
    if (k < 0) k = rows - 1;
    const part = k > 0 && x[k] > x[k - 1] ? (at - x[k - 1]) / (x[k] - x[k - 1]) : 1, [low, high] = panel.range;
    readings.forEach((reading, c) => {
      const b = values[k * columns + c], a = k > 0 ? values[(k - 1) * columns + c] : b, y = a + part * (b - a);
      const span = panel.packed.high[c] - panel.packed.low[c]; // digits that tell its changes, five at most
      const step = Math.max(span / 1000, (high - low) / 1e6, Math.abs(y) / 1e5);
      reading.textContent = Number.isNaN(y) ? "" : written(y, step);
    });
  }
  function show(t) {
    now = t;
    const at = t * (plot ? plot.second : 1), key = span.join() + "," + (panels[0] ? panels[0].canvas.clientWidth : 0);
    for (const one of panels) {
      const { canvas, still } = one, ratio = window.devicePixelRatio || 1;
      if (!canvas.clientWidth) return;
      [canvas.dataset.from, canvas.dataset.to] = span;
      if (key !== painted) paint(one);
      read(one, at);
      const pen = canvas.getContext("2d"), { top, bottom, to } = frameOf(one), [px] = to(at, 0);
      pen.setTransform(1, 0, 0, 1, 0, 0);
      pen.clearRect(0, 0, canvas.width, canvas.height);
      pen.drawImage(still, 0, 0);
      if (at < span[0] || at > span[1]) continue;
      pen.setTransform(ratio, 0, 0, ratio, 0, 0);
      pen.strokeStyle = "#c2410c";
      line(pen, [px, top], [px, bottom]);
    }
    painted = key;
  }
  return { show, resize: () => { painted = ""; } };
}
